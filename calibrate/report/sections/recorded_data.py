"""The chapter on the data: rows left out with their reason, coverage of the joints, health of the recording."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording, check
from acquisition.recording.rig import Rig
from calibrate.quantities import fixed, significant
from calibrate.report.elements.html import (
    Html,
    folded,
    join,
    section,
    table,
    tag,
)
from calibrate.report.evidence.session_evidence import SessionEvidence

Floats = NDArray[np.float64]

EXTRAS = (
    ("cmd1_rad", "commanded joint angles", "whether the controller reached its command"),
    ("enc1_rad", "second encoders on the joints", "transmission errors between motor and link"),
    ("repeat", "repeated poses", "noise apart from missing physics"),
    ("approach1", "direction of approach", "backlash"),
)


def coverage(rig: Rig, q_rad: Floats) -> Html:
    """How much of each joint's range the poses (pose, joint) use."""
    rows = [
        (
            f"J{i}",
            *(fixed(float(np.degrees(v)), 1) for v in (q.min(), q.max(), np.ptp(q))),
            f"{np.ptp(q) / (j.upper_rad - j.lower_rad):.0%}",
        )
        for i, (j, q) in enumerate(zip(rig.arm.joints, q_rad.T, strict=True), start=1)
    ]
    head = ("Joint", "from (°)", "to (°)", "span (°)", "of its range")
    return table(head, rows, numeric=(1, 2, 3, 4), caption="Joint angles in the fitted poses")


def recorded(recording: Recording, extras: Sequence[tuple[str, str, str]]) -> Html:
    """Which of these columns there are: name, what it is, what it shows; and the temperatures."""
    samples = recording.samples
    rows: list[tuple[str, ...]] = [
        (what, "yes" if column in samples else "no", f"shows {shows}" if column in samples else f"cannot show {shows}")
        for column, what, shows in extras
    ]
    rows += _temperature_rows(recording)
    return table(("Quantity", "recorded", "what it shows"), rows, caption="Beside angles and spots")


def _temperature_rows(recording: Recording) -> list[tuple[str, ...]]:
    """One row for all sensors that agree to a tenth of a degree."""
    of_range: dict[tuple[str, str], list[str]] = {}
    for name, values in temperatures(recording):
        where = name.removeprefix("temp_").removesuffix("_degC")
        of_range.setdefault((fixed(float(values.min()), 1), fixed(float(values.max()), 1)), []).append(where)
    return [
        (f"temperature {', '.join(where)}", "yes", f"{low} to {high} °C") for (low, high), where in of_range.items()
    ]


def temperatures(recording: Recording) -> list[tuple[str, Floats]]:
    """Columns of temperatures that hold a value, and these values."""
    samples = recording.samples
    names = [n for n in samples.names if n.startswith("temp_") and n.endswith("_degC")]
    read = [(n, samples.column(n)[np.isfinite(samples.column(n))]) for n in names]
    return [(n, values) for n, values in read if len(values)]


def streams(recording: Recording) -> list[Html]:
    """Rates and gaps of the raw streams."""
    if not recording.streams:
        return [tag("p", "No raw streams are in the recording, only settled samples.")]
    rows: list[tuple[str, ...]] = []
    for stream in recording.streams.values():
        span_s = float(np.ptp(stream.host_s)) if len(stream.host_s) > 1 else 0.0
        rate = significant((len(stream.host_s) - 1) / span_s) if span_s > 0.0 else ""
        lost = sum(max(gap.missing, 0) for gap in stream.gaps)
        rows.append((stream.name, str(len(stream.host_s)), rate, str(len(stream.gaps)), str(lost)))
    head = ("Stream", "samples", "per second", "gaps", "lost")
    note = (
        "Per second of the recording computer's clock: emulated devices may run faster than real time. A lost sample "
        "of the encoders is a SYNC that this computer sent too late; the settled samples average over those that came."
    )
    channels = [(s.name, ", ".join(c.name for c in s.channels)) for s in recording.streams.values()]
    return [
        table(head, rows, numeric=(1, 2, 3, 4), caption="Raw streams"),
        tag("p", note),
        folded("Channels of each stream", table(("Stream", "channels"), channels), on_paper=False),
    ]


def findings(recording: Recording) -> Html:
    """What the check of the recording states."""
    found = check(recording)
    if not found:
        return tag("p", "The check of the recording found nothing wrong.")
    head, caption = ("Severity", "problem", "where", "what"), "Found by the check of the recording"
    groups: dict[tuple[str, str, str], list[str]] = {}
    for finding in found:
        key = (finding.severity.value, finding.problem.value, finding.where)
        groups.setdefault(key, []).append(finding.says)
    rows = [
        (*key, says[0] if len(says) == 1 else f"{len(says)} times; first: {says[0]}") for key, says in groups.items()
    ]
    every = [(*key, one) for key, says in groups.items() for one in says]
    folds = [folded(f"All {len(every)} findings", table(head, every), on_paper=False)] if len(every) > len(rows) else []
    return join(table(head, rows, caption=caption), *folds)


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
