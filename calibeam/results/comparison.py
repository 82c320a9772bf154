"""Two recordings of one motion, measured and simulated: aligned, compared link by link, their difference diagnosed.

compare.json, version 1, is described in docs/formats.md.
"""

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from acquisition.recording import Recording, Samples
from calibeam.results.diagnosis import diagnose_recording
from calibeam.software import SOFTWARE
from calibrate.diagnose.compare.chain import READINGS, Difference, differences
from calibrate.diagnose.compare.matched import Matched, match
from calibrate.diagnose.compare.observed import difference_samples
from calibrate.diagnose.compare.parted import ROUNDING, Parted, judged
from calibrate.diagnose.compare.streams import StreamPair, late_against_joints, stream_pairs
from calibrate.diagnose.diagnosis import Verdict
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.diagnose.streams.recorded import devices_of
from calibrate.errors import DataError
from calibrate.identification.identify import wrong_file
from calibrate.report.quantities import angle, length


class LinkRecord(msgspec.Struct, frozen=True):
    """One link of the chain over the matched samples; `own`: without what the links in front of it explain."""

    link: str
    unit: str
    rows: int
    rms_raw: float
    rms_own: float
    largest_own: float
    largest_column: str
    largest_t_s: float
    noise: float | None
    noise_from: str
    p: float | None
    parts: bool
    first_t_s: float | None
    mean_own: tuple[float, ...]
    scatter: float  # from row to row: the noise that was found


class StreamRecord(msgspec.Struct, frozen=True):
    """One device's stream in both recordings."""

    stream: str
    unit: str
    status: str
    offset_s: float | None  # simulated clock less measured clock, at `middle_s` of the measured one
    offset_sigma_s: float | None
    drift: float | None
    drift_sigma: float | None
    middle_s: float
    samples: int
    level: tuple[float, ...] | None
    rms: float | None
    noise: float | None
    largest: float | None
    largest_s: float | None
    parts: bool | None
    later_than_joints_s: float | None
    later_than_joints_sigma_s: float | None


class ComparisonFile(msgspec.Struct, frozen=True):
    """Everything; `first_link` is None where nothing parts."""

    schema: int
    kind: str
    software: str
    measured: str
    simulated: str
    matched: int
    only_measured_t_s: tuple[float, ...]
    only_simulated_t_s: tuple[float, ...]
    first_link: str | None
    says: str
    links: tuple[LinkRecord, ...]
    streams: tuple[StreamRecord, ...]
    notes: tuple[str, ...]
    diagnosis: DiagnosisFile | None


def write_comparison(path: Path, file: ComparisonFile) -> None:
    """OSError where it cannot be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(msgspec.json.format(msgspec.json.encode(file), indent=2) + b"\n")


FEWEST = 20  # samples of a diagnosis; fewer hold no more than the geometry
READING = tuple(reading.link for reading in READINGS)
CLEAR = 5.0  # sigmas of a time that is told
SAYS = {"rad": angle, "m": length}  # how a person reads a size


def compare(measured: Recording, simulated: Recording, *, diagnosed: bool = True) -> ComparisonFile:
    """DataError where the two are not of one arm and one motion. `diagnosed`: seek physics in what differs."""
    for recording in (measured, simulated):
        _refuse_wrong(recording)
    rows = match(measured.samples, simulated.samples)
    pair = measured.samples.take(rows.measured), simulated.samples.take(rows.simulated)
    links = differences(simulated.rig, pair)
    told = judged(links, simulated.rig, pair)
    streams = stream_pairs(devices_of(measured), devices_of(simulated))
    notes: list[str] = []
    diagnosis = _diagnosis(measured, simulated, pair, links, told, notes) if diagnosed else None
    if diagnosis is not None and diagnosis.verdict == Verdict.MISMATCH.value:
        told = tuple(_by_structure(one) for one in told)
    first = next((link.link for link in told if link.parts), None)
    return ComparisonFile(
        1,
        "calibeam-comparison",
        SOFTWARE,
        measured.path.name,
        simulated.path.name,
        len(rows.measured),
        *_unmatched(measured.samples, simulated.samples, rows),
        first,
        _says(told, pair[0]),
        tuple(_link(one, pair[0]) for one in told),
        _streams(streams),
        tuple(notes),
        diagnosis,
    )


def _refuse_wrong(recording: Recording) -> None:
    """DataError naming the recording whose file is written by another convention as a whole."""
    try:
        wrong = wrong_file(recording.rig, recording.samples)
    except (DataError, np.linalg.LinAlgError):
        return  # joints alone, or another arm: no reading tells which convention was meant
    if wrong:
        raise DataError(f"{recording.path}: {'; besides, '.join(blunder.says for blunder in wrong)}")


def _by_structure(one: Parted) -> Parted:
    """A reading whose difference has a cause parts, however large its noise was believed to be."""
    if one.link not in READING or one.parts:
        return one
    return replace(
        one, parts=True, first_row=0, noise=None, noise_from="less than believed: the difference has a cause"
    )


def _unmatched(measured: Samples, simulated: Samples, rows: Matched) -> tuple[tuple[float, ...], tuple[float, ...]]:
    one = measured.column("t_s")[rows.only_measured]
    two = simulated.column("t_s")[rows.only_simulated]
    return tuple(one.tolist()), tuple(two.tolist())


def _says(told: tuple[Parted, ...], measured: Samples) -> str:
    first = next((link for link in told if link.parts), None)
    if first is None:
        return "measured and simulated agree in every link of the chain, within the noise that is known or believed"
    says = SAYS[first.unit]
    before = [link.link for link in told[: told.index(first)]]
    agree = f"{', '.join(before)} agree; " if before else ""
    at_s = measured.column("t_s")[first.first_row or 0]
    noise = "" if first.noise is None else f", where noise makes {says(first.noise)} ({first.noise_from})"
    return (
        f"{agree}they part at the {first.link}, from t = {at_s:.3f} s on: "
        f"{says(first.rms_own)} rms{noise}, at most {says(first.largest_own)} in {first.largest_channel}"
    )


def _link(one: Parted, measured: Samples) -> LinkRecord:
    t_s = measured.column("t_s")
    return LinkRecord(
        one.link,
        one.unit,
        one.rows,
        one.rms_raw,
        one.rms_own,
        one.largest_own,
        one.largest_channel,
        float(t_s[one.largest_row]),
        one.noise,
        one.noise_from,
        one.p,
        one.parts,
        None if one.first_row is None else float(t_s[one.first_row]),
        one.offset,
        one.scatter,
    )


def _streams(pairs: tuple[StreamPair, ...]) -> tuple[StreamRecord, ...]:
    late = late_against_joints(pairs)
    return tuple(
        StreamRecord(
            one.stream,
            one.unit,
            one.clock.status.value,
            one.clock.offset_s,
            one.clock.offset_sigma_s,
            one.clock.drift,
            one.clock.drift_sigma,
            one.clock.middle_s,
            one.samples,
            one.level,
            one.rms,
            one.noise,
            one.largest,
            one.largest_s,
            one.parts,
            *late.get(one.stream, (None, None)),
        )
        for one in pairs
    )


def _diagnosis(
    measured: Recording,
    simulated: Recording,
    pair: tuple[Samples, Samples],
    links: tuple[Difference, ...],
    told: tuple[Parted, ...],
    notes: list[str],
) -> DiagnosisFile | None:
    """Of readings that the simulation would give if it were the model, plus what the measured ones differ by."""
    if not any(one.link in READING and one.largest_own > ROUNDING for one in told):
        return None
    if len(pair[0]) < FEWEST:
        notes.append(f"{len(pair[0])} samples are too few to seek physics in; {FEWEST} are needed")
        return None
    rig, samples = simulated.rig, difference_samples(simulated.rig, pair, links)
    source = replace(simulated, path=measured.path, rig=rig, samples=samples, streams={}, events=())
    try:
        return diagnose_recording(source)[1]
    except (DataError, np.linalg.LinAlgError) as why:
        notes.append(f"no physics was sought: {why}")
        return None
