"""The pages of a diagnosis, as a report of their own or as chapters of another.

Beside a model, what the calibrated arm holds already is no finding about it. `calibeam identify` fits the discs of
encoders where the rig file states `eccentricity_rad`; a diagnosis starts from an arm without them, and finds the same
discs as causes.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from acquisition.recording import Recording
from acquisition.recording.rig import Rig
from calibrate.diagnose.record.schema import DiagnosisFile, FindingRecord
from calibrate.errors import DataError
from calibrate.model.arms.eccentric import COSINE, SINE
from calibrate.model.model_file import ModelFile
from calibrate.report.diagnosis import overview
from calibrate.report.diagnosis.finding_page import chain_of, finding_page, title_of
from calibrate.report.elements.html import PROVENANCE_TITLE as PROVENANCE
from calibrate.report.elements.html import (
    Html,
    page,
    provenance,
    tag,
    write_page,
)

DISC = "encoder-eccentricity"


def beyond_model(file: DiagnosisFile, model: ModelFile) -> tuple[DiagnosisFile, tuple[FindingRecord, ...]]:
    """The diagnosis without what the model's geometry holds, and these findings; agreement where nothing else is left.

    A model with effects is of a diagnosis itself, and its findings stay.
    """
    held = () if model.effects else tuple(f for f in file.findings if _holds(model, f))
    if not held:
        return file, ()
    left = tuple(f for f in file.findings if f not in held)
    agree = file.verdict == "mismatch" and not left and file.unexplained is None and not file.also_unexplained
    verdict = "consistent" if agree else file.verdict
    # the error of geometry alone is that of an arm without discs, which is not the arm of this report
    return msgspec.structs.replace(file, findings=left, verdict=verdict, free_space=None), held


def _holds(model: ModelFile, finding: FindingRecord) -> bool:
    """Whether both coefficients of the joint's disc have numbers."""
    if finding.physics != DISC:
        return False
    joint = finding.where.partition(".")[0]
    known = {p.name for p in model.parameters if p.value is not None}
    return {f"{joint}.{SINE}", f"{joint}.{COSINE}"} <= known


def contents_of(file: DiagnosisFile) -> Mapping[str, str]:
    """Headings by anchor."""
    found = {f"finding-{i}": f"{i}. {title_of(finding)}" for i, finding in enumerate(file.findings, start=1)}
    return {"diagnosis": overview.TITLE, **found, "diagnosis-limits": overview.LIMITS_TITLE}


def chapters_of(file: DiagnosisFile, joints: int, held: Sequence[FindingRecord] = ()) -> tuple[Html, ...]:
    """In the order of `contents_of`; of an arm with so many joints. `held`: findings that the model holds already."""
    chain = chain_of(joints, tuple(dict.fromkeys(s.instrument for s in file.splits)))
    pages = (finding_page(i, finding, file, chain) for i, finding in enumerate(file.findings, start=1))
    return (overview.overview(file), *pages, overview.limits(file, held))


def inserted(
    contents: Mapping[str, str],
    chapters: Sequence[Html],
    file: DiagnosisFile | None,
    rig: Rig,
    held: Sequence[FindingRecord] = (),
) -> tuple[Mapping[str, str], tuple[Html, ...]]:
    """Contents and chapters of another report with the pages of a diagnosis before the last one; as they are if None.

    DataError where the diagnosis was made with another rig.
    """
    if file is None:
        return contents, tuple(chapters)
    if file.rig is not None and file.rig.name != rig.name:
        raise DataError(
            f"report: the diagnosis is of rig '{file.rig.name}', the recording of '{rig.name}'; "
            "give the diagnosis of this recording"
        )
    *first, last = contents.items()
    whole = dict([*first, *contents_of(file).items(), last])
    return whole, (*chapters[:-1], *chapters_of(file, len(rig.arm.joints), held), chapters[-1])


def write_diagnosis_report(path: Path, recording: Recording, file: DiagnosisFile) -> Path:
    """One HTML file at `path`, over what may be there; returns it. DataError where it cannot be written."""
    return write_page(path, diagnosis_report_html(recording, file))


def diagnosis_report_html(recording: Recording, file: DiagnosisFile) -> str:
    """The page as text."""
    said = [f"{file.samples} samples", *dict.fromkeys(s.instrument for s in file.splits), file.software]
    masthead = tag(
        "header",
        tag("p", "Diagnosis of an arm", cls="kicker"),
        tag("h1", recording.rig.name),
        tag("p", " · ".join(said), cls="byline"),
    )
    chapters = (
        *chapters_of(file, len(recording.rig.arm.joints)),
        provenance(recording, file.samples, "took part in the diagnosis", file.software),
    )
    contents = {**contents_of(file), "provenance": PROVENANCE}
    return page(f"Diagnosis of {recording.rig.name}", masthead, contents, chapters, file.software, kind="diagnosis")
