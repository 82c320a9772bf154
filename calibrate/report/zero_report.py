"""The report of a dual-PSD session: one page that needs nothing else, on a screen, a phone or on paper."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from calibrate.diagnose.schema import DiagnosisFile
from calibrate.identification.evidence_record import EvidenceFields
from calibrate.report.answers import Answers
from calibrate.report.diagnosis.page import inserted
from calibrate.report.drift.chapter import TITLE as DRIFT
from calibrate.report.drift.chapter import drift_chapter
from calibrate.report.drift.drift import Drift
from calibrate.report.drift.words import sentence
from calibrate.report.elements import Html
from calibrate.report.evidence import Evidence
from calibrate.report.interactive.chapter import TITLE as INTERACTIVE
from calibrate.report.interactive.chapter import interactive_chapter
from calibrate.report.interactive.zero_figures import zero_figures
from calibrate.report.page import page
from calibrate.report.sections import (
    centring,
    point,
    proofs,
    provenance,
    residuals,
    rig,
    spots,
    summary,
    unseen,
    workspace,
    zeros,
)
from calibrate.report.zero_workspace import zero_arm
from calibrate.zeros.point_constraint import PointConstraintResult

NOT_IN_SPACE = "No measured errors are drawn: spots say how the beam fell, not where the tool is."
NOT_ASKED = "it was not asked for"


@dataclass(frozen=True)
class ZeroSession:
    """All that is known of a dual-PSD session."""

    evidence: Evidence
    point_constraint: PointConstraintResult | None = None
    why_no_point_constraint: str = NOT_ASKED
    left_out: tuple[str, ...] = ()  # sentences, each naming rows that were recorded but not fitted
    proved: EvidenceFields | None = None  # None where nothing was
    alarms: tuple[str, ...] = ()  # what to read before the numbers


def zero_page(
    session: ZeroSession,
    diagnosis: DiagnosisFile | None = None,
    drift: Drift | None = None,
    *,
    interactive: bool = False,
) -> str:
    """The page as text; `drift` adds its chapter, `interactive` figures that can be turned."""
    known = session.evidence
    rig_file, software = known.recording.rig, known.result.software
    chapters = dict(_chapters(session, drift, interactive=interactive))
    contents, parts = inserted(
        {anchor: title for anchor, (title, _) in chapters.items()},
        tuple(chapter for _, chapter in chapters.values()),
        diagnosis,
        rig_file,
    )
    first = summary.summary(zero_answers(session, drift), known)
    title, head = f"Joint zeros of {rig_file.name}", summary.masthead(known)
    return page(title, head, contents, (first, *parts), software, scripts=interactive)


def zero_answers(session: ZeroSession, drift: Drift | None = None) -> Answers:
    """The first screen."""
    answers = summary.answers(session.evidence, session.proved)
    return answers if drift is None else replace(answers, drift=sentence(drift), warnings=drift.warnings)


def _chapters(
    session: ZeroSession, drift: Drift | None, *, interactive: bool
) -> Iterator[tuple[str, tuple[str, Html]]]:
    """Anchor, heading, content."""
    known = session.evidence
    result = known.result
    if drift is not None:
        yield "drift", (DRIFT, drift_chapter(drift))
    pictures = workspace.workspace(zero_arm(known, session.proved), None, NOT_IN_SPACE)
    yield "workspace", (workspace.TITLE, pictures)
    if interactive:
        yield "interactive", (INTERACTIVE, interactive_chapter(zero_figures(known)))
    yield "rig", (rig.TITLE, rig.rig(known))
    yield "spots", (spots.TITLE, spots.spots(known))
    yield "centring", (centring.TITLE, centring.centring(known))
    yield "residuals", (residuals.TITLE, residuals.residuals(known))
    yield "zeros", (zeros.TITLE, zeros.zeros(known))
    beside = point.point(session.point_constraint, result.zeros, session.why_no_point_constraint)
    yield "point", (point.TITLE, beside)
    if session.proved is not None:
        yield "proofs", (proofs.TITLE, proofs.proofs(session.proved, session.alarms))
    yield "unseen", (unseen.TITLE, unseen.unseen(known, session.left_out))
    by = f"{result.software}, {result.steps} steps"
    yield (
        "provenance",
        (provenance.TITLE, provenance.provenance(known.recording, result.n_poses, "with both spots", by)),
    )
