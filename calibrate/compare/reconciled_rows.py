"""How far a simulation is away from a recording on rows that nothing was fitted to, before and after, and what remains.

Rows are split by pose, so that repeats stay together.
"""

from collections.abc import Iterator, Mapping, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from acquisition.recording import Recording, Samples
from acquisition.recording.examination import Examination, ExaminationRecord, not_examined
from acquisition.recording.rig import Rig
from acquisition.recording.samples import ORIENTATION, POSITION, SPOTS, WIRE
from calibrate.compare.comparison_file import ComparisonFile
from calibrate.compare.corrected import simulated_of
from calibrate.compare.fit_to_simulation import device_between
from calibrate.compare.matched import (
    is_seated,
)
from calibrate.diagnose import limits
from calibrate.diagnose.assess import Verdict
from calibrate.diagnose.motion import JointTorquesRecord
from calibrate.diagnose.record.schema import TORQUES_IN_MOTION, DiagnosisFile
from calibrate.errors import DataError
from calibrate.model.sensors import (
    full_pose,
    position,
    spots,
    wire,
)
from calibrate.quantities import length, significant

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
BEYOND = 3.0  # times the stated noise of the instrument: more is not noise unless repeated poses scatter as much
REPEATED = "scatter within repeats"  # how the source of such a noise begins
FRAME = 6  # of a measuring device
AGREES = 1.3  # rms over noise on unseen rows, up to which nothing is left
UNSEEN = 0.25  # share of the poses
FEWEST_UNSEEN = 5
FEW_ROWS = 0.05  # share of the unseen rows up to which they are listed
SAME_POSE_RAD = 2e-3  # a servo comes back closer, and other poses are farther away
QUANTITIES = {
    spots.KIND.name: SPOTS,
    position.KIND.name: POSITION,
    full_pose.KIND.name: POSITION,
    wire.KIND.name: (WIRE,),
}


class RowRecord(msgspec.Struct, frozen=True):
    """Of one unseen row: rms of its coordinates, measured less simulated; `after_m`: with geometry and physics."""

    instrument: str
    t_s: float
    before_m: float
    geometry_m: float
    after_m: float


class UnseenRowsRecord(msgspec.Struct, frozen=True):
    """Measured less simulated of one instrument on the unseen rows, rms of a coordinate."""

    instrument: str
    rows: int
    before_m: float
    geometry_m: float
    after_m: float
    noise_m: float
    noise_from: str
    before: float  # over noise
    geometry: float
    after: float
    stated_m: float | None = None  # noise of the instrument by the rig file


class AllRowsRecord(msgspec.Struct, frozen=True):
    """Of too few rows to diagnose: measured less simulated on all, rms of a coordinate; `low_m` to `high_m`: 95 %."""

    instrument: str
    rows: int
    rms_m: float
    low_m: float
    high_m: float
    stated_m: float | None


class LackingRecord(msgspec.Struct, frozen=True):
    """What the simulation lacks, as `before` or the diagnosis reports it."""

    where: str
    physics: str
    says: str
    alternatives: tuple[str, ...]


class ReconcileFile(msgspec.Struct, frozen=True):
    """Everything; what was found in full stands in the files beside it."""

    schema: int
    kind: str
    software: str
    measured: str
    simulation: str
    verdict: str  # agree, differ or undecided
    says: str
    seed: int
    seen: int
    unseen_rows: tuple[int, ...]  # from 0, in the measured samples that the simulation has, too
    unseen: tuple[UnseenRowsRecord, ...]
    rows: tuple[RowRecord, ...]
    left_out: tuple[LackingRecord, ...]
    remains: tuple[str, ...]
    next: tuple[str, ...]
    notes: tuple[str, ...]
    all_rows: tuple[AllRowsRecord, ...] = ()
    torques: tuple[JointTorquesRecord, ...] = ()  # of a recording in motion
    examinations: tuple[ExaminationRecord, ...] = ()


def split(samples: Samples, seed: int) -> tuple[Ints, Ints]:
    """Rows seen and unseen, a pose and its repeats on one side."""
    pose = poses_of(samples)
    drawn = np.random.default_rng(seed).permutation(int(pose.max(initial=-1)) + 1)
    away = drawn[: round(UNSEEN * len(drawn))]
    unseen = np.flatnonzero(np.isin(pose, away))
    return np.flatnonzero(~np.isin(pose, away)), unseen


def enough(seen: Ints, unseen: Ints) -> bool:
    return len(seen) >= limits.FEWEST_FOR_NAMES and len(unseen) >= FEWEST_UNSEEN


def poses_of(samples: Samples) -> Ints:
    """(row,) number of the pose, from 0."""
    steps = np.round(samples.joints() / SAME_POSE_RAD)
    return np.unique(steps, axis=0, return_inverse=True)[1].reshape(-1)


def set_alike_by(measured: Recording, simulated: Recording, seen: Ints) -> Samples:
    """The simulated readings as the measuring device has them where it stood, by the seen rows."""
    samples = simulated.samples
    if not all(name in samples for name in POSITION):
        return samples
    pair = measured.samples.take(seen), samples.take(seen)
    T = device_between(simulated_of(simulated.rig, pair[1]), pair)
    there_m = np.stack([samples.column(name) for name in POSITION], axis=1)
    here_m = (there_m - T[:3, 3]) @ T[:3, :3]
    return Samples({**samples.columns, **dict(zip(POSITION, here_m.T, strict=True))}, samples.n_joints)


def on_all_rows(measured: Samples, simulated: Samples, stated_m: Mapping[str, float | None]) -> Iterator[AllRowsRecord]:
    """The frame of the device that was fitted takes degrees of freedom; so few rows leave wide limits."""
    for name, columns in QUANTITIES.items():
        if not all(c in measured and c in simulated for c in columns):
            continue
        misfit = (_stacked(measured, columns) - _stacked(simulated, columns))[_rows_of(name, measured)]
        misfit = misfit[np.isfinite(misfit).all(axis=1)]
        dof = misfit.size - FRAME
        if dof < 1:
            continue
        rms_m = float(np.sqrt(np.sum(misfit**2) / dof))
        low_m, high_m = (float(rms_m * np.sqrt(dof / chi2.ppf(q, dof))) for q in (0.975, 0.025))
        yield AllRowsRecord(name, len(misfit), rms_m, low_m, high_m, stated_m.get(name))


def stated_m_of(rig: Rig) -> dict[str, float | None]:
    """Noise of a coordinate by instrument, as the rig file states it."""
    noise = rig.noise
    in_space = dict.fromkeys((position.KIND.name, full_pose.KIND.name), noise.position_m)
    return {spots.KIND.name: noise.psd_m, **in_space, wire.KIND.name: noise.wire_m}


def _rows_of(name: str, samples: Samples) -> NDArray[np.bool_]:
    """(row,) those that an instrument has read: a position with a turn is one of a 6-D target."""
    every = np.ones(len(samples), dtype=np.bool_)
    if name not in (position.KIND.name, full_pose.KIND.name):
        return every
    with_turn = all(column in samples for column in ORIENTATION)
    turned = np.isfinite(_stacked(samples, ORIENTATION)).all(axis=1) if with_turn else ~every
    return np.asarray(turned == (name == full_pose.KIND.name), dtype=np.bool_)


def refuse_unread(samples: Samples) -> None:
    if np.any(is_seated(samples)):
        raise DataError(
            "rows with a probe in a cone or at a bar: the joint angles are the reading; how far a simulation is off "
            "on unseen rows cannot be determined; use compare and diagnose"
        )
    if not any(name in samples for names in QUANTITIES.values() for name in names):
        raise DataError("the samples hold no spots, positions or wire lengths to bring a simulation to agree with")


def on_unseen_rows(
    measured: Samples,
    states: tuple[Samples, Samples, Samples],
    unseen: Ints,
    diagnosis: DiagnosisFile,
    stated_m: Mapping[str, float | None],
) -> tuple[tuple[UnseenRowsRecord, ...], tuple[RowRecord, ...]]:
    """DataError where no instrument has a noise and unseen readings."""
    floors = {floor.instrument: floor for floor in diagnosis.floors}
    records: list[UnseenRowsRecord] = []
    rows: list[RowRecord] = []
    for name, columns in QUANTITIES.items():
        floor = floors.get(name)
        if not all(c in measured and all(c in state for state in states) for c in columns):
            continue
        if floor is None or not floor.rms_m:
            continue
        read = _stacked(measured, columns)[unseen]
        misfits = [read - _stacked(state, columns)[unseen] for state in states]
        known = np.all([np.isfinite(m).all(axis=1) for m in misfits], axis=0) & _rows_of(name, measured)[unseen]
        if not known.any():
            continue
        was, plain, now = (float(np.sqrt(np.mean(m[known] ** 2))) for m in misfits)
        noise_m = float(floor.rms_m)
        over = was / noise_m, plain / noise_m, now / noise_m
        records.append(
            UnseenRowsRecord(name, int(known.sum()), was, plain, now, noise_m, floor.source, *over, stated_m.get(name))
        )
        each = [np.sqrt(np.mean(m[known] ** 2, axis=1)).tolist() for m in misfits]
        t_s = measured.column("t_s")[unseen][known].tolist()
        rows += [RowRecord(name, *row) for row in zip(t_s, *each, strict=True)]
    if not records:
        raise DataError("no unseen reading with a known noise: how far the simulation is off cannot be determined")
    return tuple(records), tuple(rows)


def _stacked(samples: Samples, names: tuple[str, ...]) -> Floats:
    return np.stack([samples.column(name) for name in names], axis=1)


def what_remains(
    records: tuple[UnseenRowsRecord, ...], rows: tuple[RowRecord, ...], diagnosis: DiagnosisFile, after: ComparisonFile
) -> Iterator[str]:
    """Why the two do not agree yet; nothing where they do."""
    for one in records:
        if not one.after <= AGREES:
            where = _few_rows(one, [row for row in rows if row.instrument == one.instrument])
            yield f"{one.instrument}: {one.after:.2f} times the noise on unseen rows, more than {AGREES}{where}"
        elif one.stated_m and one.after_m > BEYOND * one.stated_m and not one.noise_from.startswith(REPEATED):
            yield (
                f"{one.instrument}: {length(one.after_m)} on unseen rows, {significant(one.after_m / one.stated_m)} "
                f"times the stated noise of {length(one.stated_m)}, and no repeated pose shows that it is noise"
            )
    for left in (diagnosis.unexplained, *diagnosis.also_unexplained):
        if left is not None:
            yield left.says
    if after.verdict != Verdict.CONSISTENT.value:
        yield from [one.says for one in after.differences if one.decides] or [after.says]


def _few_rows(one: UnseenRowsRecord, rows: Sequence[RowRecord]) -> str:
    """Which rows carry it, where the others agree: most often those at the very edge of a step or of a play."""
    worst = sorted(rows, key=lambda row: row.after_m, reverse=True)
    for count in range(1, round(FEW_ROWS * len(rows)) + 1):
        others = np.sqrt(np.mean([row.after_m**2 for row in worst[count:]])) / one.noise_m
        if others <= AGREES:
            listed = ", ".join(f"{row.t_s:.2f} s" for row in sorted(worst[:count], key=lambda row: row.t_s))
            return f"; {others:.2f} without {count} of {len(rows)} rows, at {listed}"
    return ""


def what_was_left_out(before: ComparisonFile, diagnosis: DiagnosisFile, has_physics: bool) -> Iterator[LackingRecord]:
    """Physics as the diagnosis of the seen rows names it, then what the comparison names beside it.

    `has_physics`: the simulation may hold some of its own, so that only the comparison shows what it lacks.
    """
    named: set[tuple[str, str]] = set()
    for finding in () if has_physics and before.diagnosis is not None else diagnosis.findings:
        named.add((finding.where, finding.physics))
        others = tuple(f"{r.physics} at {r.where}" for r in finding.rivals)
        yield LackingRecord(finding.where, finding.physics, finding.says, others)
    for one in before.differences:
        if one.decides and (one.where, one.physics) not in named:
            others = tuple(f"{a.physics} at {a.where}" for a in one.alternatives)
            yield LackingRecord(one.where, one.physics, one.says, others)


def verdict_text(records: tuple[UnseenRowsRecord, ...], before: ComparisonFile, remains: tuple[str, ...]) -> str:
    worst = max(records, key=lambda one: one.after)
    far = f"on unseen rows {significant(worst.before)} times the noise before, {significant(worst.after)} after"
    if remains:
        count = "one thing remains" if len(remains) == 1 else f"{len(remains)} things remain"
        return f"Simulation and recording do not agree yet: {far}; {count}."
    if before.verdict == Verdict.CONSISTENT.value:
        return f"Simulation and recording agree as they are: {far}."
    return f"With what was found the simulation agrees with the recording: {far}."


POSES = Examination("settled poses", ("q", "readings"), "record settled samples, and measure more poses")
RECONCILE_EXAMINATIONS = (POSES, TORQUES_IN_MOTION)


def examined(file: ReconcileFile, torques: ExaminationRecord | object) -> ReconcileFile:
    """The reconciliation with how its two examinations ended. `torques`: why those took no part, where they did not."""
    records = (_of_poses(file), _of_torques(file, torques))
    left = ", ".join(one.what for one in not_examined(records) if one.expected)
    says = f"{file.says} Not examined: {left}." if left and file.verdict == "agree" else file.says
    return msgspec.structs.replace(file, says=says, examinations=records)


def _of_poses(file: ReconcileFile) -> ExaminationRecord:
    if file.unseen:
        worst = max(file.unseen, key=lambda one: one.noise_m)
        left = "; ".join(file.remains)
        return POSES.found(left) if left else POSES.nothing(AGREES * worst.noise_m, "m")
    if file.all_rows and file.verdict == "differ" and not file.torques:
        return POSES.found(file.says)
    why = "; ".join(file.remains) if file.all_rows or not file.torques else "no settled samples were recorded"
    return POSES.not_examined(why or "too few rows", expected=not file.torques or bool(file.all_rows))


def _of_torques(file: ReconcileFile, left_out: ExaminationRecord | object) -> ExaminationRecord:
    if isinstance(left_out, ExaminationRecord):
        return left_out
    left = "; ".join(one for one in file.remains if "orque" in one)
    noise_nm = max((one.noise_nm for one in file.torques), default=0.0)
    return TORQUES_IN_MOTION.found(left) if left else TORQUES_IN_MOTION.nothing(AGREES * noise_nm, "Nm")
