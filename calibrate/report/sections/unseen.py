"""The chapter on what these data cannot tell, and on the data themselves."""

from collections.abc import Iterator, Sequence

import numpy as np

from calibrate.report.elements import Html, bullets, section, tag
from calibrate.report.evidence import Evidence
from calibrate.report.reasons import plain_reason
from calibrate.report.recording_tables import EXTRAS, coverage, findings, recorded, streams, temperatures
from calibrate.report.verdict import limited_by_measurement

TITLE = "What the data cannot see"
SCATTER = ("psd1_x_sigma_m", "scatter of every averaged spot", "poses that had not settled")


def unseen(evidence: Evidence, left_out: Sequence[str] = ()) -> Html:
    """Limits of the answer, then coverage and health of the recording."""
    recording = evidence.recording
    lead = "Limits that no computation can lift, and the state of the recording behind the numbers."
    return section(
        "unseen",
        TITLE,
        lead,
        bullets(_limits(evidence)),
        *_not_fitted(left_out),
        coverage(recording.rig, evidence.data.q_rad),
        recorded(recording, (*EXTRAS, SCATTER)),
        *streams(recording),
        findings(recording),
    )


def _not_fitted(left_out: Sequence[str]) -> list[Html]:
    return [tag("h3", "Recorded, but left out of the fit"), bullets(left_out)] if left_out else []


def _limits(evidence: Evidence) -> Iterator[str]:
    result, rig = evidence.result, evidence.recording.rig
    for z in result.zeros:
        if z.value_rad is None:
            reason = plain_reason(f"joint{z.joint}.zero", result.identifiability, z.why)
            yield f"Zero of joint {z.joint}: {reason}."
        elif not limited_by_measurement(z):
            yield f"Zero of joint {z.joint}: more poses will not better it; a tighter drawing would."
    if len(evidence.places) < 2:
        yield "One fixture place only: errors that are the same over the whole workspace stay hidden."
    if rig.tolerance is None:
        yield "The rig file states no tolerance: links and bracket were believed as usual, not as known."
    held = {
        p.name.partition(".")[2].partition("_")[0] for p in result.parameters if p.name.startswith("psd") and not p.free
    }
    if "gain" in held:
        yield (
            "Scale: the detectors' scale is taken as exact, and with it the size of the arm. A measured distance "
            "between two places would check it."
        )
    if held - {"gain"}:
        yield "The fixture itself: how PSD 2 sits to PSD 1 is taken from the drawing as exact."
    spans = [np.ptp(values) for _, values in temperatures(evidence.recording)]
    if not spans or max(spans) < 1.0:
        yield "Warming: temperatures were not recorded or changed by less than 1 °C; the zeros hold at that one."
    if "repeat" not in evidence.recording.samples:
        yield "Missing physics: no pose was repeated, so noise and model error cannot be told apart."
