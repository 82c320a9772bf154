"""The report of any session as one page: positions, wire, cones, bars, poses, spots, alone or together."""

from collections.abc import Iterator
from dataclasses import replace

from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.report.diagnosis.diagnosis_page import beyond_model, inserted
from calibrate.report.drift.drift_chapter import TITLE as DRIFT
from calibrate.report.drift.drift_chapter import drift_chapter, sentence
from calibrate.report.drift.two_calibrations import Drift
from calibrate.report.elements import html as elements
from calibrate.report.elements.html import (
    Html,
    page,
    section,
    tag,
)
from calibrate.report.elements.verdict import Answers
from calibrate.report.evidence.session_evidence import SessionEvidence, spot_session
from calibrate.report.figures.plots import INTERACTIVE_TITLE as INTERACTIVE
from calibrate.report.figures.plots import interactive_chapter
from calibrate.report.figures.session_figures import session_figures
from calibrate.report.sections import (
    arm_errors,
    centring,
    parameter_tables,
    proofs,
    recorded_data,
    rig_and_spots,
    summary,
    zeros,
)
from calibrate.report.sections.summary import when
from calibrate.report.sections.zeros import ZEROS, zeros_part
from calibrate.report.workspace import session_workspace
from calibrate.report.workspace.session_workspace import NOT_IN_SPACE, session_measured
from calibrate.report.workspace.workspace_errors import Room, session_arm, session_room


def session_page(
    known: SessionEvidence,
    diagnosis: DiagnosisFile | None = None,
    drift: Drift | None = None,
    *,
    interactive: bool = False,
    room: Room | str | None = None,
) -> str:
    """The page as text; `drift` adds its chapter, `interactive` figures that can be turned; `room` of session_room."""
    recording, model = known.recording, known.model
    room = session_room(known) if room is None else room
    diagnosis, held = (None, ()) if diagnosis is None else beyond_model(diagnosis, model)
    chapters = dict(_chapters(known, drift, room, interactive=interactive))
    contents, parts = inserted(
        {anchor: title for anchor, (title, _) in chapters.items()},
        tuple(chapter for _, chapter in chapters.values()),
        diagnosis,
        recording.rig,
        held,
    )
    first = summary.summary(session_answers(known, drift, room, diagnosis), known, room)
    title, head = f"The arm {recording.rig.name}", summary.masthead(known)
    running = " · ".join(
        part for part in (recording.rig.name, recording.rig.arm.serial_number, when(recording)) if part
    )
    return page(
        title, head, contents, (first, *parts), model.software, scripts=interactive, running=running, kind="report"
    )


def session_answers(
    known: SessionEvidence,
    drift: Drift | None = None,
    room: Room | str | None = None,
    diagnosis: DiagnosisFile | None = None,
) -> Answers:
    """The first screen; `room` of session_room, computed where it is not given."""
    diagnosis = None if diagnosis is None else beyond_model(diagnosis, known.model)[0]
    answers = summary.answers(known, session_room(known) if room is None else room, diagnosis)
    return answers if drift is None else replace(answers, drift=sentence(drift), warnings=drift.warnings)


def _chapters(
    known: SessionEvidence, drift: Drift | None, room: Room | str, *, interactive: bool
) -> Iterator[tuple[str, tuple[str, Html]]]:
    """Anchor, heading, content."""
    recording, model = known.recording, known.model
    if drift is not None:
        yield "drift", (DRIFT, drift_chapter(drift))
    arm = session_arm(known)
    measured = None if isinstance(arm, str) else session_measured(known, arm)
    yield "workspace", (session_workspace.WORKSPACE_TITLE, session_workspace.workspace(room, measured, NOT_IN_SPACE))
    if interactive:
        yield "interactive", (INTERACTIVE, interactive_chapter(session_figures(known)))
    yield from _chapters_of_spots(known)
    yield "errors", (arm_errors.TITLE, arm_errors.errors_chapter(known))
    yield "proofs", (proofs.TITLE, proofs.proofs_chapter(known))
    zero_parts = tuple(zeros_part(known))
    if zero_parts:
        yield "zeros", (ZEROS, tag("div", section("zeros", ZEROS, "", *zero_parts), cls="no-print"))
    yield "parameters", (parameter_tables.TITLE, parameter_tables.parameters_chapter(known))
    yield "data", (recorded_data.TITLE, recorded_data.data_chapter(known))
    made = elements.provenance(recording, model.poses, "took part in the fit", model.software)
    yield "provenance", (elements.PROVENANCE_TITLE, made)


def _chapters_of_spots(known: SessionEvidence) -> Iterator[tuple[str, tuple[str, Html]]]:
    """The rig with its beams, the faces, the centring; none for a session without spots."""
    session = spot_session(known)
    if session is None:
        return
    yield "rig", (rig_and_spots.RIG_TITLE, rig_and_spots.rig(session))
    yield "spots", (rig_and_spots.SPOTS_TITLE, rig_and_spots.spots(session))
    yield "centring", (centring.TITLE, centring.centring(session))
    if zeros.asked_for(known):
        yield "point", (zeros.POINT_TITLE, zeros.point(known))
