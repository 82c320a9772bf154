"""The pages of a diagnosis, as a report of their own or as chapters of another."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from acquisition.recording import Recording
from acquisition.recording.rig import Rig
from calibrate.diagnose.schema import DiagnosisFile, FindingRecord
from calibrate.errors import DataError
from calibrate.report.diagnosis import limits, overview
from calibrate.report.diagnosis.chain_figure import chain_of
from calibrate.report.diagnosis.finding_page import finding_page, title_of
from calibrate.report.elements import PROVENANCE_TITLE as PROVENANCE
from calibrate.report.elements import Html, page, provenance, tag, write_page


def contents_of(file: DiagnosisFile) -> Mapping[str, str]:
    """Headings by anchor."""
    found = {f"finding-{i}": f"{i}. {title_of(finding)}" for i, finding in enumerate(file.findings, start=1)}
    return {"diagnosis": overview.TITLE, **found, "diagnosis-limits": limits.TITLE}


def chapters_of(file: DiagnosisFile, joints: int, held: Sequence[FindingRecord] = ()) -> tuple[Html, ...]:
    """In the order of `contents_of`; of an arm with so many joints. `held`: findings that the model holds already."""
    chain = chain_of(joints, tuple(dict.fromkeys(s.instrument for s in file.splits)))
    pages = (finding_page(i, finding, file, chain) for i, finding in enumerate(file.findings, start=1))
    return (overview.overview(file), *pages, limits.limits(file, held))


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
    return page(f"Diagnosis of {recording.rig.name}", masthead, contents, chapters, file.software)
