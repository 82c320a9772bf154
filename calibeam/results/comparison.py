"""Two recordings of one plan, measured and simulated: what they differ by from the outside in, and whether they agree.

`compare` is what `calibeam compare` does, from recordings to one frozen record. compare.json, version 1, is described
in docs/formats.md.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording, Samples
from calibeam.results.diagnosis import SEED
from calibeam.results.simulator import simulated_by_model
from calibeam.software import SOFTWARE
from calibrate.compare.beside_simulation import (
    Beside,
    Constant,
    begin,
    beside,
    beside_structure,
    set_alike,
)
from calibrate.compare.chain import (
    READINGS,
    Difference,
    Pair,
    columns_of,
    differences,
    of_rig,
)
from calibrate.compare.corrected import compared_session, corrected_samples, simulated_of
from calibrate.compare.link_differs import (
    ALARM,
    ROUNDING,
    Parted,
    chance_of_structure,
    judged,
)
from calibrate.compare.matched import (
    Key,
    Matched,
    match,
    zeros_between,
)
from calibrate.compare.mismatches import (
    Level,
    Mismatch,
    Side,
    mismatches,
)
from calibrate.compare.rig_keys import RigKey, rig_differences
from calibrate.compare.streams import (
    NoiseDifference,
    StreamDifference,
    StreamPair,
    late_against_joints,
    noise_differences,
    stream_differences,
    stream_pairs,
)
from calibrate.diagnose.doubts import Named, Verdict
from calibrate.diagnose.record.schema import DiagnosisFile, SizeRecord
from calibrate.diagnose.record.to_file import file_of
from calibrate.diagnose.state import Fitted
from calibrate.diagnose.streams import devices_of, streams_of
from calibrate.errors import DataError
from calibrate.fit.identify.identify import wrong_file
from calibrate.model.effects.term import Size, plain
from calibrate.model.model_file import ModelFile
from calibrate.model.predict import Predictor
from calibrate.model.sensors.catalogue import kind_of
from calibrate.quantities import angle, length

Floats = NDArray[np.float64]


class RigRecord(msgspec.Struct, frozen=True):
    """A key that the two rig files state differently; null where one has no such key."""

    key: str
    measured: str | float | bool | None
    simulated: str | float | bool | None
    difference: float | None
    geometry: bool


class NameOfCause(msgspec.Struct, frozen=True):
    """An alternative explanation."""

    where: str
    physics: str


class DifferenceRecord(msgspec.Struct, frozen=True):
    """One difference, measured less simulated, the unit of each size in its name."""

    level: str
    where: str
    physics: str
    sizes: dict[str, SizeRecord]
    side: str
    decides: bool
    p: float | None
    says: str
    alternatives: tuple[NameOfCause, ...]
    simulated: dict[str, float]  # with the structure of the simulation: its own values of these parameters


class DroppedRecord(msgspec.Struct, frozen=True):
    """A constant that is no difference: left as in the simulation, to within these sizes, which widen the others'."""

    where: str
    physics: str
    sizes: dict[str, SizeRecord]  # by the names of model.json


class ReadingRecord(msgspec.Struct, frozen=True):
    """Measured less simulated of one instrument, rms of a coordinate: as they stand, and after all that was found."""

    instrument: str
    unit: str
    rows: int
    rms_coordinate_before: float
    rms_coordinate_after: float
    noise: float | None


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
    verdict: str
    says: str
    rig: tuple[RigRecord, ...]
    differences: tuple[DifferenceRecord, ...]
    dropped: tuple[DroppedRecord, ...]
    readings: tuple[ReadingRecord, ...]
    first_link: str | None
    links: tuple[LinkRecord, ...]
    streams: tuple[StreamRecord, ...]
    notes: tuple[str, ...]
    diagnosis: DiagnosisFile | None


FEWEST = 20  # samples of a search; fewer hold no more than the geometry
READING = tuple(reading.link for reading in READINGS)
EXPLAINED = (*READING, "encoders")  # links whose differences are asked of the model
CLEAR = 5.0  # sigmas of a time that is reported
LENGTH_OR_ANGLE = re.compile(r"_(m|rad)(?: [0-9]+)?$")
LATENCY = "latency"
SHORTEST_S = 1e-4  # of a device that comes later: below, the motion does not show it
SAYS = {"rad": angle, "m": length}  # how a person reads a size


@dataclass(frozen=True, eq=False)
class _Asked:
    """What a search gave; `beside` None: it was not made, and `why` has the reason."""

    beside: Beside | None
    readings: tuple[ReadingRecord, ...]
    diagnosis: DiagnosisFile | None
    left: tuple[Mismatch, ...]  # structure of the readings that remains and that no search has named
    why: str | None


def compare(
    measured: Recording,
    simulation: Recording | ModelFile,
    *,
    diagnosed: bool = True,
    structure: ModelFile | None = None,
) -> ComparisonFile:
    """DataError where the two are not of one arm and one plan, or where the model cannot predict the recording.

    `simulation`: its recording of the same plan, or a model, whose own uncertainty then counts as no difference.
    `diagnosed`: explain what differs. `structure`: the model that a recorded simulation is made of: its values stand
    beside the differences.
    """
    made_of = simulation if isinstance(simulation, ModelFile) else None
    simulated = simulated_by_model(simulation, measured) if isinstance(simulation, ModelFile) else simulation
    for recording in (measured, simulated):
        _refuse_wrong(recording)
    rows = match(measured.samples, simulated.samples, _plans(measured, simulated))
    pair = measured.samples.take(rows.measured), simulated.samples.take(rows.simulated)
    zeros_rad = zeros_between(*pair)
    pair = _without_zeros(pair, zeros_rad), pair[1]
    asked, model, alike = _asked(measured, simulated, pair, zeros_rad, made_of, diagnosed=diagnosed)
    links = differences(model, alike)
    parted = judged(links, model, alike)
    rig = rig_differences(measured.rig, simulated.rig)
    found = [*_rig(rig), *_joints(parted, links)]
    if asked.beside is not None:
        found += mismatches(asked.beside, zeros_rad)
    found += [*_zeros_alone(asked, zeros_rad), *asked.left]
    streams = stream_pairs(devices_of(measured), devices_of(simulated))
    found += _streams_apart(measured, simulated, asked, streams)
    found.sort(key=lambda one: one.order)
    explained = any(one.decides and one.level not in (Level.RIG, Level.STREAMS) for one in found)
    parted = tuple(_as_explained(one, asked, explained) for one in parted)
    verdict = _verdict(found, parted, asked)
    return ComparisonFile(
        1,
        "calibeam-comparison",
        SOFTWARE,
        measured.path.name,
        simulated.path.name,
        len(rows.measured),
        *_unmatched(measured.samples, simulated.samples, rows),
        verdict.value,
        _says(verdict, found, asked),
        tuple(_rig_record(one) for one in rig),
        tuple(_record(one, structure or made_of) for one in found),
        () if asked.beside is None else tuple(_dropped(one) for one in asked.beside.dropped),
        asked.readings,
        next((one.link for one in parted if one.parts), None),
        tuple(_link(one, pair[0]) for one in parted),
        _streams(streams),
        tuple(_notes(asked)),
        asked.diagnosis,
    )


def _refuse_wrong(recording: Recording) -> None:
    """DataError naming the recording whose file is written by another convention as a whole."""
    try:
        wrong = wrong_file(recording.rig, recording.samples)
    except (DataError, np.linalg.LinAlgError):
        return  # joints alone, or another arm: no reading shows which convention was meant
    if wrong:
        raise DataError(f"{recording.path}: {'; besides, '.join(blunder.says for blunder in wrong)}")


def _plans(measured: Recording, simulated: Recording) -> tuple[tuple[Key, ...], tuple[Key, ...]] | None:
    one, two = _plan(measured), _plan(simulated)
    return None if one is None or two is None else (one, two)


def _plan(recording: Recording) -> tuple[Key, ...] | None:
    """Of each sample its place in the plan, as the session has written it; None where it did not."""
    said = [event.detail.get("pose") for event in recording.events if event.kind == "sample"]
    poses = [pose for pose in said if isinstance(pose, Mapping)]
    if not poses or len(poses) != len(said) or len(said) != len(recording.samples):
        return None
    return tuple(tuple(sorted(pose.items())) for pose in poses)


def _without_zeros(pair: Pair, zeros_rad: Floats) -> Samples:
    """The measured table with joints that read as the simulated ones do, but for less than a servo moves."""
    if not np.any(zeros_rad):
        return pair[0]
    names = [f"q{j + 1}_rad" for j in range(pair[0].n_joints)]
    return columns_of(pair[0], {n: pair[0].column(n) - zeros_rad[j] for j, n in enumerate(names)})


def _asked(
    measured: Recording,
    simulated: Recording,
    pair: Pair,
    zeros_rad: Floats,
    made_of: ModelFile | None,
    *,
    diagnosed: bool,
) -> tuple[_Asked, Predictor, Pair]:
    """What a search gives, the simulation's geometry, and the pair as if set up alike."""
    same = _same(pair)
    try:
        simulation = simulated_of(simulated.rig, pair[1])
        here = simulation.model
        alike = pair if same else set_alike(simulation, pair)
    except (DataError, np.linalg.LinAlgError) as why:
        return _Asked(None, (), None, (), f"no reading to compare: {why}"), of_rig(simulated.rig), pair
    if not diagnosed or same:
        return _Asked(None, (), None, (), None), here, alike
    if len(pair[0]) < FEWEST:
        why = f"{len(pair[0])} samples are too few to explain a difference; {FEWEST} are needed"
        return _Asked(None, (), None, (), why), here, alike
    differing = [f"joint{j + 1}.zero" for j in np.flatnonzero(zeros_rad)]
    try:
        rng = np.random.default_rng(SEED)
        if made_of is None or made_of.covariance is None or differing:
            found = beside(simulation, pair, rng, differing)
        else:
            found = beside_structure(simulation, pair, rng, made_of)
        samples = corrected_samples(simulation, pair, found.T_simulated_measured)
        before = begin(simulation, compared_session(simulated.rig, samples))
    except (DataError, np.linalg.LinAlgError) as why:
        return _Asked(None, (), None, (), f"the difference could not be explained: {why}"), here, alike
    if found.diagnosed.physics is None:
        why = f"the difference could not be explained: {found.diagnosed.why_not}"
        return _Asked(None, (), None, (), why), here, alike
    source = replace(measured, rig=simulated.rig, rig_text=simulated.rig_text, streams={}, events=())
    file = file_of(found.diagnosed, source)
    after = found.diagnosed.physics.model
    return _Asked(found, tuple(_readings(before, after, file)), file, tuple(_left(after)), None), here, alike


def _same(pair: Pair) -> bool:
    """Whether both are one recording: what a fit of their difference leaves is rounding, in which much can be seen."""
    one, other = pair
    if one.columns.keys() != other.columns.keys():
        return False
    return all(_same_column(values, other.columns[name]) for name, values in one.columns.items())


def _same_column(one: NDArray[Any], other: NDArray[Any]) -> bool:
    if one.dtype.kind == other.dtype.kind == "f":
        return np.allclose(one, other, rtol=0.0, atol=ROUNDING, equal_nan=True)
    return np.array_equal(one, other)


def _notes(asked: _Asked) -> Iterator[str]:
    """What was not compared, and why."""
    if asked.why is not None:
        yield asked.why
    if asked.beside is not None:
        for name in asked.beside.simulated.uncorrected:
            yield f"{kind_of(name).noun}: what the simulation's own readings miss its geometry by is not taken out"
        for part in asked.beside.blind:
            joint = part.where.removesuffix(".angle").removeprefix("joint")
            yield f"the target lies on the axis of joint {joint}: whether its zero differs cannot be determined"


def _readings(before: Fitted, after: Fitted, file: DiagnosisFile) -> Iterator[ReadingRecord]:
    """Of every quantity of an instrument, a 6-D target's position and turn apart."""
    one = {m.name: m.problem.observed - e for m, e in zip(before.session.measured, before.around.expected, strict=True)}
    floors = {f.instrument: f.rms_m for f in file.floors}
    for m, expected in zip(after.session.measured, after.around.expected, strict=True):
        for k, quantity in enumerate(kind_of(m.name).quantities):
            was, is_now = one[m.name][:, quantity.part], (m.problem.observed - expected)[:, quantity.part]
            name = f"{m.name} {quantity.name}".strip()
            noise = floors.get(m.name) if k == 0 else None
            yield ReadingRecord(name, quantity.unit, m.problem.rows, _rms(was), _rms(is_now), noise)


def _rms(misfit: Floats) -> float:
    return float(np.sqrt(np.mean(misfit**2)))


def _left(after: Fitted) -> Iterator[Mismatch]:
    """What follows the order of the rows where the search has found nothing to name: less than a cause, not noise."""
    if after.noise.shared is not None:
        return
    for m, expected in zip(after.session.measured, after.around.expected, strict=True):
        misfit = m.problem.observed - expected
        p = chance_of_structure(misfit)
        if p < ALARM and float(np.max(np.abs(misfit))) > ROUNDING:
            says = (
                f"What is left of the {kind_of(m.name).noun} follows the order of the samples, and no cause explains it"
            )
            yield Mismatch(Level.UNEXPLAINED, "", "unknown", {}, says, p=p)


def _rig(keys: tuple[RigKey, ...]) -> Iterator[Mismatch]:
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


def _joints(parted: tuple[Parted, ...], links: tuple[Difference, ...]) -> Iterator[Mismatch]:
    """Reported angles less the set-points: what a controller leaves over, where both recordings hold set-points."""
    if not any(one.link == "command" for one in links):
        return
    for one in parted:
        if one.link == "joints" and one.parts:
            j = int(np.argmax(np.abs(one.offset)))
            says = (
                f"Reported less commanded angles differ by {angle(one.rms_own)} rms, most in {one.largest_channel} "
                f"(mean of joint {j + 1}: {_signed(one.offset[j], 'rad')})"
            )
            yield Mismatch(Level.JOINTS, f"joint{j + 1}.angle", "not-at-set-point", {}, says, p=one.p)


def _zeros_alone(asked: _Asked, zeros_rad: Floats) -> Iterator[Mismatch]:
    """Zeros of degrees where no search has sized them."""
    if asked.beside is not None:
        return
    for j in np.flatnonzero(zeros_rad):
        size = {"zero_rad": Size(-float(zeros_rad[j]), float("nan"))}
        says = f"Joint {j + 1} reads {_signed(float(zeros_rad[j]), 'rad')} more in all samples: another zero"
        yield Mismatch(Level.JOINT_ZEROS, f"joint{j + 1}.angle", "joint-zero-moved", size, says)


def _streams_apart(
    measured: Recording, simulated: Recording, asked: _Asked, pairs: tuple[StreamPair, ...]
) -> list[Mismatch]:
    """Of streams that both have: what each recording shows by itself, side by side, and what one motion shows."""
    if not measured.streams or not simulated.streams:
        return []
    models: tuple[Fitted | None, Fitted | None] = (None, None)
    if asked.beside is not None and asked.beside.diagnosed.physics is not None:
        models = asked.beside.diagnosed.physics.model, asked.beside.simulated.fitted
    reports = [streams_of(one, model) for one, model in zip((measured, simulated), models, strict=True)]
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


def _as_explained(one: Parted, asked: _Asked, explained: bool) -> Parted:
    """After a search a reading parts where it found something; noise is what it found, not what was assumed."""
    if asked.beside is None or one.link not in EXPLAINED:
        return one
    if not explained:
        return replace(one, parts=False, first_row=None)
    return one if one.parts else replace(one, parts=one.largest_own > ROUNDING, first_row=0)


def _verdict(found: list[Mismatch], parted: tuple[Parted, ...], asked: _Asked) -> Verdict:
    """No line above it may contradict it."""
    deciding = [one for one in found if one.decides]
    if any(one.level is not Level.UNEXPLAINED for one in deciding):
        return Verdict.MISMATCH
    if deciding:
        return Verdict.UNDECIDABLE
    if asked.beside is None and any(one.parts for one in parted):
        return Verdict.MISMATCH
    return Verdict.CONSISTENT if asked.why is None else Verdict.UNDECIDABLE


def _says(verdict: Verdict, found: list[Mismatch], asked: _Asked) -> str:
    deciding = [one for one in found if one.decides]
    anew = "; what is set up again for every recording is taken into account" if len(deciding) < len(found) else ""
    if verdict is Verdict.CONSISTENT:
        return f"Measured and simulated agree to within the noise at every level{anew}."
    if verdict is Verdict.UNDECIDABLE:
        return f"{deciding[0].says if deciding else asked.why}."
    named = [one for one in deciding if one.level is not Level.UNEXPLAINED]
    if not named:
        return "Measured and simulated differ; the links below show where."
    levels = list(dict.fromkeys(one.level.value.replace("-", " ") for one in named))
    left = " Something is left over besides." if len(named) < len(deciding) else ""
    many = f"{len(named)} differences" if len(named) > 1 else "1 difference"
    return f"Measured and simulated differ: {many} ({', '.join(levels)}){_how_far(asked)}.{left}"


def _how_far(asked: _Asked) -> str:
    if not asked.readings:
        return ""
    first = asked.readings[0]
    says = SAYS[first.unit]
    noise = "" if first.noise is None else f", noise {says(first.noise)}"
    before, after = says(first.rms_coordinate_before), says(first.rms_coordinate_after)
    return f"; {first.instrument} {before} apart before, {after} after{noise} (rms of a coordinate)"


def _unmatched(measured: Samples, simulated: Samples, rows: Matched) -> tuple[tuple[float, ...], tuple[float, ...]]:
    one = measured.column("t_s")[rows.only_measured]
    two = simulated.column("t_s")[rows.only_simulated]
    return tuple(one.tolist()), tuple(two.tolist())


def _rig_record(one: RigKey) -> RigRecord:
    return RigRecord(one.key, one.measured, one.simulated, one.difference, one.geometry)


def _dropped(one: Constant) -> DroppedRecord:
    return DroppedRecord(one.where, one.physics, _sizes(dict(zip(one.names, one.sizes, strict=True))))


def _sizes(sizes: Mapping[str, Size]) -> dict[str, SizeRecord]:
    return {name: SizeRecord(_number(size.value), _number(size.sigma)) for name, size in sizes.items()}


def _record(one: Mismatch, structure: ModelFile | None) -> DifferenceRecord:
    others = tuple(_cause(name) for name in one.alternatives)
    own = {} if structure is None else _own(one, structure)
    sizes, side = _sizes(one.sizes), one.side.value
    return DifferenceRecord(
        one.level.value, one.where, one.physics, sizes, side, one.decides, one.p, one.says, others, own
    )


def _own(one: Mismatch, structure: ModelFile) -> dict[str, float]:
    """The simulation's own values, by the model that it is made of."""
    known = {name: structure.chain[name] for name in one.names if name in structure.chain}
    for effect in structure.effects:
        if (effect.where, effect.physics) == (one.where, one.physics):
            known |= {name: p.value for name, p in effect.parameters.items() if p.value is not None}
    return known


def _cause(name: Named) -> NameOfCause:
    return NameOfCause(name.where, name.physics)


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None


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
