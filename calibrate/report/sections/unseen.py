"""The chapter on what these data cannot tell, and on the data themselves."""

from collections.abc import Iterator, Sequence

import numpy as np

from acquisition.recording.check import check
from acquisition.recording.recording import Recording
from calibrate.report.elements import Html, bullets, section, table, tag
from calibrate.report.evidence import Evidence
from calibrate.report.quantities import fixed, significant
from calibrate.report.reasons import plain_reason
from calibrate.report.verdict import limited_by_measurement

TITLE = "What the data cannot see"
EXTRAS = (
    ("cmd1_rad", "commanded joint angles", "whether the controller reached what it was told"),
    ("enc1_rad", "second encoders on the joints", "transmission errors between motor and link"),
    ("repeat", "repeated poses", "noise apart from missing physics"),
    ("approach1", "direction of approach", "backlash"),
    ("psd1_x_sigma_m", "scatter of every averaged spot", "poses that had not settled"),
)


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
        _coverage(evidence),
        _recorded(recording),
        *_streams(recording),
        _findings(recording),
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
        yield "Link lengths and angles were taken as drawn, since the rig file states no tolerance."
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
    temperatures = [np.ptp(values) for _, values in _temperatures(evidence.recording)]
    if not temperatures or max(temperatures) < 1.0:
        yield "Warming: temperatures were not recorded or changed by less than 1 °C; the zeros hold at that one."
    if "repeat" not in evidence.recording.samples:
        yield "Missing physics: no pose was repeated, so noise and model error cannot be told apart."


def _coverage(evidence: Evidence) -> Html:
    joints, q_rad = evidence.recording.rig.arm.joints, evidence.data.q_rad
    rows = [
        (
            f"J{i}",
            *(fixed(float(np.degrees(v)), 1) for v in (q.min(), q.max(), np.ptp(q))),
            f"{np.ptp(q) / (j.upper_rad - j.lower_rad):.0%}",
        )
        for i, (j, q) in enumerate(zip(joints, q_rad.T, strict=True), start=1)
    ]
    head = ("Joint", "from (°)", "to (°)", "span (°)", "of its range")
    return table(head, rows, numeric=(1, 2, 3, 4), caption="Joint angles in the fitted poses")


def _recorded(recording: Recording) -> Html:
    samples = recording.samples
    rows: list[tuple[str, ...]] = [
        (what, "yes" if column in samples else "no", f"shows {shows}" if column in samples else f"cannot show {shows}")
        for column, what, shows in EXTRAS
    ]
    for name, values in _temperatures(recording):
        where = name.removeprefix("temp_").removesuffix("_degC")
        rows.append(
            (f"temperature {where}", "yes", f"{fixed(float(values.min()), 2)} to {fixed(float(values.max()), 2)} °C")
        )
    return table(("Quantity", "recorded", "what it tells"), rows, caption="Beside angles and spots")


def _temperatures(recording: Recording) -> list[tuple[str, np.ndarray]]:
    samples = recording.samples
    names = [n for n in samples.names if n.startswith("temp_") and n.endswith("_degC")]
    read = [(n, samples.column(n)[np.isfinite(samples.column(n))]) for n in names]
    return [(n, values) for n, values in read if len(values)]


def _streams(recording: Recording) -> list[Html]:
    if not recording.streams:
        return [tag("p", "No raw streams are in the recording, only settled samples.")]
    rows: list[tuple[str, ...]] = []
    for stream in recording.streams.values():
        span_s = float(np.ptp(stream.host_s)) if len(stream.host_s) > 1 else 0.0
        rate = significant((len(stream.host_s) - 1) / span_s) if span_s > 0.0 else ""
        lost = sum(max(gap.missing, 0) for gap in stream.gaps)
        channels = ", ".join(c.name for c in stream.channels)
        rows.append((stream.name, str(len(stream.host_s)), rate, str(len(stream.gaps)), str(lost), channels))
    head = ("Stream", "samples", "per second", "gaps", "lost", "channels")
    note = (
        "Per second of the recording computer's clock: emulated devices may run faster than real time. A lost sample "
        "of the encoders is a SYNC that this computer sent too late; the settled samples average over those that came."
    )
    return [table(head, rows, numeric=(1, 2, 3, 4), caption="Raw streams"), tag("p", note)]


def _findings(recording: Recording) -> Html:
    findings = check(recording)
    if not findings:
        return tag("p", "The check of the recording found nothing wrong.")
    rows = [(finding.problem.value, finding.where, finding.says) for finding in findings]
    return table(("Problem", "where", "what"), rows, caption="Found by the check of the recording")
