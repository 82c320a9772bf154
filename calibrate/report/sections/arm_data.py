"""The chapter on the data: rows left out with their reason, coverage of the joints, health of the recording."""

from collections.abc import Iterator

from calibrate.report.elements import Html, section, table, tag
from calibrate.report.sections.recorded_data import EXTRAS, coverage, findings, recorded, streams
from calibrate.report.session_evidence import SessionEvidence

TITLE = "The data"


def data_chapter(evidence: SessionEvidence) -> Html:
    """What the numbers rest on."""
    recording = evidence.recording
    return section(
        "data",
        TITLE,
        "Rows that were left out, how much of the joints' range was used, and what else was recorded.",
        *_left_out(evidence),
        coverage(recording.rig, evidence.q_rad),
        recorded(recording, EXTRAS),
        *streams(recording),
        findings(recording),
    )


def _left_out(evidence: SessionEvidence) -> Iterator[Html]:
    samples, model = evidence.recording.samples, evidence.model
    blank = len(samples) - model.poses - evidence.left_out
    if blank > 0:
        yield tag("p", f"{blank} rows hold no reading that could be used.")
    if not model.blunders:
        yield tag("p", "No faulty row was found; every reading was used.")
        return
    rows = [(b.kind.lower().replace("_", " "), str(len(b.rows)), b.says) for b in model.blunders]
    yield table(("Fault", "rows", "what"), rows, numeric=(1,), caption="Left out of the fit")
