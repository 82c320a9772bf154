"""Mismatches that need no search: keys of the rig files, set-points, zeros of degrees, and the streams of both."""

import re
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording
from calibrate.compare.chain import Difference
from calibrate.compare.comparison_examinations import with_examinations
from calibrate.compare.comparison_file import (
    ComparisonFile,
    Level,
    Mismatch,
    Side,
    StreamRecord,
    difference_record,
)
from calibrate.compare.encoder_zeros import pair_zeros, zero_mismatches_of
from calibrate.compare.fit_to_simulation import SimulationFit
from calibrate.compare.link_differs import JudgedLink
from calibrate.compare.rig_keys import RigKey, rig_differences
from calibrate.compare.streams import (
    ZEROLESS,
    NoiseDifference,
    StreamDifference,
    StreamPair,
    late_against_joints,
    noise_differences,
    stream_differences,
    stream_pair,
)
from calibrate.diagnose.assess import Verdict
from calibrate.diagnose.state import Fitted
from calibrate.diagnose.streams import StreamReport, devices_of, streams_of
from calibrate.errors import DataError
from calibrate.model.effects.term import Size, plain
from calibrate.quantities import angle, length

Floats = NDArray[np.float64]

CLEAR = 5.0  # sigmas of a time that is reported
LENGTH_OR_ANGLE = re.compile(r"_(m|rad)(?: [0-9]+)?$")
LATENCY = "latency"
SHORTEST_S = 1e-4  # of a device that comes later: below, the motion does not show it
SAYS = {"rad": angle, "m": length}  # how a person reads a size


def rig_mismatches(keys: tuple[RigKey, ...]) -> Iterator[Mismatch]:
    """First of all, key by key: what places a reading decides."""
    for one in keys:
        by = "" if one.difference is None else f" (measured less simulated {_by(one)})"
        says = (
            f"The rig files differ in {one.key}: {_value(one.measured)} measured, {_value(one.simulated)} simulated{by}"
        )
        sizes = {} if one.difference is None else {one.key: Size(one.difference, 0.0)}
        yield Mismatch(Level.RIG, one.key, "rig-file", sizes, says, decides=one.geometry)


def _by(one: RigKey) -> str:
    """The difference in the unit that the key's name ends with."""
    if one.difference is None:
        return ""
    unit = LENGTH_OR_ANGLE.search(one.key)
    return f"{one.difference:+.6g}" if unit is None else _signed(one.difference, unit[1])


def _signed(value: float, unit: str) -> str:
    return f"{'+' if value >= 0.0 else ''}{SAYS[unit](value)}"


def _value(value: str | float | bool | None) -> str:
    return "nothing" if value is None else f"{value:.9g}" if isinstance(value, float) else str(value)


def joint_mismatches(judged_links: tuple[JudgedLink, ...], links: tuple[Difference, ...]) -> Iterator[Mismatch]:
    """Reported angles less the set-points: what a controller leaves over, where both recordings hold set-points."""
    if not any(one.link == "command" for one in links):
        return
    for one in judged_links:
        if one.link == "joints" and one.parts:
            j = int(np.argmax(np.abs(one.mean_own)))
            says = (
                f"Reported less commanded angles differ by {angle(one.rms_own)} rms, most in {one.largest_column} "
                f"(mean of joint {j + 1}: {_signed(one.mean_own[j], 'rad')})"
            )
            yield Mismatch(Level.JOINTS, f"joint{j + 1}.angle", "not-at-set-point", {}, says, p=one.p)


def zero_mismatches(zeros_rad: Floats) -> Iterator[Mismatch]:
    """Zeros of degrees where no search has sized them."""
    for j in np.flatnonzero(zeros_rad):
        size = {"zero_rad": Size(-float(zeros_rad[j]), float("nan"))}
        says = f"Joint {j + 1} reads {_signed(float(zeros_rad[j]), 'rad')} more in all samples: another zero"
        yield Mismatch(Level.JOINT_ZEROS, f"joint{j + 1}.angle", "joint-zero-moved", size, says)


Reports = tuple[StreamReport | None, StreamReport | None]


def stream_reports(measured: Recording, simulated: Recording, found: SimulationFit | None) -> Reports:
    """What each recording's streams show. `found`: what a search gave, None where none was made."""
    models: tuple[Fitted | None, Fitted | None] = (None, None)
    if found is not None and found.diagnosed.physics is not None:
        models = found.diagnosed.physics.model, found.simulated.fitted
    return streams_of(measured, models[0]), streams_of(simulated, models[1])


def stream_mismatches(
    measured: Recording, simulated: Recording, reports: Reports, pairs: tuple[StreamPair, ...]
) -> list[Mismatch]:
    """Of streams that both have: what each recording shows by itself, side by side, and what one motion shows."""
    if not measured.streams or not simulated.streams:
        return []
    apart = stream_differences(reports[0], reports[1])
    out = [_of_stream(one) for one in apart]
    late = {one.stream for one in apart if one.name.physics == LATENCY}
    out += [_of_lateness(name, *by) for name, by in late_against_joints(pairs).items() if name not in late and _is(*by)]
    out += [_of_motion(one) for one in pairs if one.parts]
    return out + [_of_noise(one) for one in noise_differences(devices_of(measured), devices_of(simulated))]


def _is(late_s: float, sigma_s: float) -> bool:
    return abs(late_s) >= max(CLEAR * sigma_s, SHORTEST_S)


def _of_lateness(stream: str, late_s: float, sigma_s: float) -> Mismatch:
    size = Size(late_s, sigma_s)
    words = plain("latency_s", size)
    says = f"Readings of the {stream} stream come later after the joints than in the simulation, by {words}"
    return Mismatch(Level.STREAMS, stream, LATENCY, {"latency_s": size}, says)


def _of_motion(one: StreamPair) -> Mismatch:
    size = "" if one.rms is None or one.noise is None else f" by {SAYS[one.unit](one.rms)} rms"
    noise = "" if one.noise is None else f", where noise makes {SAYS[one.unit](one.noise)}"
    says = f"The {one.stream} streams of one motion differ{size}{noise}"
    return Mismatch(Level.STREAMS, one.stream, "unlike-motion", {}, says)


def _of_stream(one: StreamDifference) -> Mismatch:
    has = [None if size is None else plain(one.parameter, size) for size in (one.measured, one.simulated)]
    side = Side.MEASURED if has[1] is None else Side.SIMULATED if has[0] is None else Side.BOTH
    words = f"{has[0] or 'nothing to see'} measured, {has[1] or 'nothing to see'} simulated"
    says = f"{one.name.physics} of {one.stream} at {one.name.where}: {words}"
    zero = Size(0.0, 0.0)
    here, there = one.measured or zero, one.simulated or zero
    sizes = {one.parameter: Size(here.value - there.value, float(np.hypot(here.sigma, there.sigma)))}
    return Mismatch(Level.STREAMS, one.name.where, one.name.physics, sizes, says, side=side)


def _of_noise(one: NoiseDifference) -> Mismatch:
    noise = [SAYS[one.unit](sigma) for sigma in (one.measured, one.simulated)]
    says = f"Noise of the {one.stream} stream: {noise[0]} measured, {noise[1]} simulated"
    sizes = {f"noise_{one.unit}": Size(one.measured - one.simulated, float("nan"))}
    return Mismatch(Level.STREAMS, one.stream, "noise", sizes, says, decides=False)


def stream_records(pairs: tuple[StreamPair, ...]) -> tuple[StreamRecord, ...]:
    """As in the file."""
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


def compare_logs(measured: Recording, simulated: Recording, software: str) -> ComparisonFile:
    """Two logs of encoders without an arm: one motion, read twice or simulated, brought together by the motion itself.

    DataError where one holds no readings of encoders, or the two hold different numbers of encoders.

    Zeros of encoders are arbitrary, but the same in both logs; undecidable where the two do not show one motion.
    """
    devices = [devices_of(one).get(ZEROLESS) for one in (measured, simulated)]
    for recording, device in zip((measured, simulated), devices, strict=True):
        if device is None:
            raise DataError(f"{recording.path}: no readings of encoders; give a log of `calibeam log encoders`")
    one, two = (device for device in devices if device is not None)
    if one.track.channels != two.track.channels:
        raise DataError(
            f"{measured.path}: {one.track.channels} encoders, {simulated.path}: {two.track.channels}; "
            "give logs of the same encoders"
        )
    pair = stream_pair(ZEROLESS, one, two)
    zeros = pair_zeros(one, two)
    found = stream_mismatches(measured, simulated, stream_reports(measured, simulated, None), (pair,))
    found += zero_mismatches_of(zeros)
    records = tuple(difference_record(one, None) for one in found)
    verdict, says = _verdict_of_logs(found, pair)
    file = ComparisonFile(
        1,
        "calibeam-comparison",
        software,
        measured.path.name,
        simulated.path.name,
        0,
        (),
        (),
        verdict.value,
        says,
        rig_differences(measured.rig, simulated.rig),
        records,
        (),
        (),
        None,
        (),
        stream_records((pair,)),
        (),
        None,
    )
    return with_examinations(file, measured, simulated, zeros)


def _verdict_of_logs(found: list[Mismatch], pair: StreamPair) -> tuple[Verdict, str]:
    if any(m.decides for m in found):
        return Verdict.MISMATCH, "The two logs differ."
    if pair.parts is None:
        why = f"the two logs do not show one motion ({pair.clock.status.value})"
        return Verdict.UNDECIDABLE, f"The motions cannot be compared: {why}."
    return Verdict.CONSISTENT, "The encoders read the same in both logs to within the noise."
