"""Samples of a device as attained poses in the base: as they are, and as they would be with a model's correction.

A corrected command moves the attained pose by what the model, with its physics, predicts to be off at the command (to
first order in that error, which is a few millimetres of an arm's length). The prediction is of the command, not of the
reading, so that scatter that the encoders see stays in the corrected figures, too.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Rig
from acquisition.recording.samples import ORIENTATION, POSITION
from calibrate.apply.correct import Arms, Options
from calibrate.apply.predicting import Placed, placed
from calibrate.errors import DataError
from calibrate.fit.held_out import CLOSE_RAD, same_poses
from calibrate.iso9283.performance import AttainedPoses, PoseTest, performance_of
from calibrate.model.alignment import rigid_motion
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.effects.conditions import moves_of
from calibrate.model.model_file import ModelFile
from calibrate.model.predict import Predictor
from calibrate.model.rigid import inverse, transform

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Frame = Literal["fit", "model", "rig"]

SAME_DATA = (
    "same data: the model was fitted to these readings, so predicted and corrected figures would prove nothing; "
    "evaluate a test that was not used in the fit"
)
SAME_JOINTS = "same joint angles as of the fit: if it had these readings, predicted and corrected figures prove nothing"
JOINTLESS = "no joint angles in the samples"
FLAT_M = 1e-3  # smallest second extent of the poses by which a frame is fitted: below, they lie on a line
MOVED_M, MOVED_SHARE = 1e-3, 5.0  # a device that stands elsewhere: error in the model's frame, and over that of a fit


@dataclass(frozen=True, eq=False)
class EvaluatedTest:
    """Figures of a recording. `predicted` and `corrected` need a model: AP that it predicts, and all with its help.

    Neither is given of the readings that the model was fitted to.
    """

    rows: int
    frame: Frame | Literal["device"]  # device: as measured, for nobody knows what was commanded
    measured: PoseTest
    predicted_m: Mapping[int, tuple[float, float]]  # pose -> AP that the model predicts, and one sigma
    corrected: PoseTest | None
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Commanded:
    """Rows of the samples that are of a pose, what was sent there and where that is by the drawn arm."""

    rows: Ints
    pose: Ints
    q_rad: Floats  # (row, joint) sent to the arm
    wanted_rad: Floats  # (row, joint) whose pose by the drawn arm is wanted
    notes: tuple[str, ...]


def evaluate(
    samples: Samples, rig: Rig, known: ModelFile | None = None, plan: PosePlan | None = None, frame: Frame | None = None
) -> EvaluatedTest:
    """`plan`: its poses are what was wanted, whatever was commanded; without it the commands, else the readings.

    `frame`: of the device in the base; by default that of the model, else the best fit. DataError where positions, a
    target point or poses are missing.
    """
    chosen: Frame = frame or ("fit" if known is None else "model")
    of_these = known is not None and known.made_of(samples)
    samples = samples.take(np.argsort(samples.column("t_s"), kind="stable"))
    sent = _commanded(samples, rig, plan)
    part = samples.take(sent.rows)
    if not np.isfinite(sent.wanted_rad).all():
        return _repeatability(samples, sent, known)
    point_m, notes = _target(rig, known)
    wanted = RigArm.of_rig(rig).frames(sent.wanted_rad)[:, -1]
    wanted_m = wanted[:, :3, :3] @ point_m + wanted[:, :3, 3]
    seen_m = np.stack([part.column(c) for c in POSITION], axis=1)
    turned = _turned(part)
    device = _device(chosen, rig, known, wanted_m, seen_m)
    side = _sides(samples)[sent.rows]
    t_s = part.column("t_s")
    attained_m = seen_m @ device[:3, :3].T + device[:3, 3]
    turn = None if turned is None else _off_rad(device[:3, :3] @ turned, wanted[:, :3, :3])
    measured = AttainedPoses(sent.pose, side, t_s, wanted_m, attained_m, turn)
    notes = (*sent.notes, *notes)
    if of_these:
        notes = (*notes, SAME_DATA)
    elif of_these is None:
        notes = (*notes, SAME_JOINTS)
    if known is None or of_these:
        return EvaluatedTest(len(part), chosen, performance_of(measured), {}, None, notes)
    by_model = placed(known, _at(part, sent.q_rad))
    aligned = _device(chosen, rig, known, by_model.tip_m, seen_m)
    off_m = seen_m @ aligned[:3, :3].T + aligned[:3, 3] - by_model.tip_m
    if turned is not None:
        turn = _off_rad(aligned[:3, :3] @ turned, by_model.T_base_flange[:, :3, :3])
    better = AttainedPoses(sent.pose, side, t_s, wanted_m, wanted_m + off_m, turn)
    if chosen != "fit":
        notes = (*notes, *_at_other_places(off_m, seen_m, by_model.tip_m))
    return EvaluatedTest(
        len(part),
        chosen,
        performance_of(measured),
        _predicted(sent.pose, wanted_m, by_model),
        performance_of(better),
        (*notes, *by_model.notes),
    )


def _repeatability(samples: Samples, sent: _Commanded, known: ModelFile | None) -> EvaluatedTest:
    """What needs no command: AP, AD and dAP are NaN. DataError with a model, which is asked at the commands."""
    if known is not None:
        raise DataError(f"{JOINTLESS}: --model needs the commanded joints; give --plan, or the columns q1_rad …")
    part = samples.take(sent.rows)
    seen_m = np.stack([part.column(c) for c in POSITION], axis=1)
    nowhere = np.full(seen_m.shape, np.nan)
    attained = AttainedPoses(sent.pose, _sides(samples)[sent.rows], part.column("t_s"), nowhere, seen_m, None)
    note = f"{JOINTLESS}: repeatability alone; for accuracy and orientation give --plan, or the columns q1_rad …"
    return EvaluatedTest(len(part), "device", performance_of(attained), {}, None, (note,))


def _commanded(samples: Samples, rig: Rig, plan: PosePlan | None) -> _Commanded:
    """DataError without positions, and for a row that is of no pose of the plan."""
    if any(c not in samples for c in POSITION):
        raise DataError(
            "no positions (columns x_m, y_m, z_m) in the samples; pose accuracy and repeatability are measured with a "
            "tracker or another device that measures where the tool is"
        )
    with_position = np.isfinite(samples.column(POSITION[0]))
    given = samples.commanded()
    notes: tuple[str, ...] = ()
    if given is None or np.isnan(given[with_position]).any():
        given = samples.joints()
        notes = ("no column cmd1_rad …: readings are used as commands; no figure includes the error of the controller",)
    number = samples.integers("repeat", 0)
    if np.isnan(given[with_position]).any() and not (number[with_position] > 0).any():
        raise DataError(f"{JOINTLESS} and no column repeat: the rows of one pose cannot be found; give one of them")
    if plan is not None:
        number = _of_plan(given, number, plan, with_position)
    elif not (number[with_position] > 0).any():
        number = _alike(given, with_position)
    rows = np.flatnonzero(with_position & (number > 0))
    if len(rows) == 0:
        raise DataError("no row with a position belongs to a repeated pose (column repeat); see calibeam iso9283 plan")
    pose, q_rad = number[rows], given[rows].copy()
    if plan is not None and np.isnan(q_rad).any():
        q_rad = np.array([_of_number(plan)[int(one)] for one in pose])
        notes = ("no joints in the samples: the poses of the plan are used as commands",)
    elif notes:  # readings scatter as the arm does; what was sent is the same in every cycle
        for one in np.unique(pose):
            q_rad[pose == one] = q_rad[pose == one].mean(axis=0)
    if plan is None:
        return _Commanded(rows, pose, q_rad, q_rad, notes)
    table = _of_number(plan)
    return _Commanded(rows, pose, q_rad, np.array([table[int(one)] for one in pose]), notes)


def _of_number(plan: PosePlan) -> dict[int, tuple[float, ...]]:
    """The joints of each numbered pose, as the plan has them first."""
    out: dict[int, tuple[float, ...]] = {}
    for pose in (pose for block in plan.block for pose in block.pose):
        if pose.repeat is not None:
            out.setdefault(pose.repeat, pose.q_rad)
    if not out:
        raise DataError("the plan has no pose with a number (repeat); give one of calibeam iso9283 plan")
    return out


def _of_plan(given: Floats, number: Ints, plan: PosePlan, wanted: NDArray[np.bool_]) -> Ints:
    """(row,) number of the plan's pose; by the column where it has one, else by the nearest joints."""
    table = _of_number(plan)
    if (number[wanted] > 0).any():
        strange = sorted(set(number[wanted & (number > 0)].tolist()) - table.keys())
        if strange:
            raise DataError(f"column repeat has the number {strange[0]}, the plan has {', '.join(map(str, table))}")
        return number
    numbers, joints = np.array(list(table)), np.array(list(table.values()))
    off = np.max(np.abs(given[:, None] - joints[None]), axis=2)
    return np.where(off.min(axis=1) < CLOSE_RAD, numbers[off.argmin(axis=1)], 0)


def _alike(given: Floats, wanted: NDArray[np.bool_]) -> Ints:
    """(row,) number from 1 of rows with nearly the same joints, in the order in which they first come."""
    out = np.zeros(len(given), dtype=np.int64)
    out[wanted] = same_poses(given[wanted]) + 1
    return out


def _target(rig: Rig, known: ModelFile | None) -> tuple[Floats, tuple[str, ...]]:
    """(3,) of the target in the drawn flange, as the controller has it, and a sentence where it is the model's."""
    if rig.tool.point_m is not None:
        return np.array(rig.tool.point_m), ()
    if known is None:
        raise DataError(
            f"rig {rig.name}: no [tool] point_m: the commanded pose includes the position of the target in the flange; "
            "measure it (calibeam tool-axes), or give the --model of a calibration with this target"
        )
    # With a tool of no length, the real tool is the drawn flange as the model's arm carries it.
    mounted = Arms.of(known, Options(tool=np.eye(4))).real_tool
    point_m = Predictor.of(known).tip_at(inverse(mounted)[None])[0]
    return point_m, ("the rig file has no [tool] point_m: the position of the target is that of the model",)


def _device(frame: Frame, rig: Rig, known: ModelFile | None, there_m: Floats, seen_m: Floats) -> Floats:
    """(4, 4) of the device in the base."""
    if frame == "model":
        if known is None:
            raise DataError("--frame model: there is no model; give --model, or --frame fit")
        return Predictor.of(known).T_base_device
    if frame == "rig":
        if rig.device is None:
            raise DataError(f"rig {rig.name}: no [device]; give --frame fit")
        return transform(rig.device.origin_m, rig.device.rotation_rad)
    return _fitted(there_m, seen_m)


def _fitted(there_m: Floats, seen_m: Floats) -> Floats:
    """(4, 4) that brings positions (row, 3) seen by the device best onto those in the base."""
    extent = np.linalg.svd(there_m - there_m.mean(axis=0), compute_uv=False) / np.sqrt(len(there_m))
    if len(there_m) < 3 or extent[1] < FLAT_M:
        raise DataError(
            "--frame fit: fewer than three poses, or all on a line, do not determine the pose of the device; "
            "take more poses, or give --frame rig or a --model of the same set-up"
        )
    return rigid_motion(there_m, seen_m)


def _turned(part: Samples) -> Floats | None:
    """(row, 3, 3) orientation of the target in the device's frame, where every row has one."""
    if any(c not in part for c in ORIENTATION):
        return None
    vector = np.stack([part.column(c) for c in ORIENTATION], axis=1)
    return Rotation.from_rotvec(vector).as_matrix() if np.isfinite(vector).all() else None


def _off_rad(attained: Floats, wanted: Floats) -> Floats:
    """(row, 3) rotation vectors in the base from wanted to attained orientations (row, 3, 3).

    How the target is turned on the flange is found from the rows themselves: the mean of all poses is no error.
    """
    mounted = Rotation.from_matrix(np.swapaxes(wanted, 1, 2) @ attained).mean().as_matrix()
    return Rotation.from_matrix(attained @ np.swapaxes(wanted @ mounted, 1, 2)).as_rotvec()


def _sides(samples: Samples) -> Ints:
    """(row,) number of the way in which all joints came; -1 where this is not known."""
    names = [f"approach{j + 1}" for j in range(samples.n_joints)]
    if np.isnan(samples.joints()).all() and names[0] not in samples:
        return np.full(len(samples), -1, dtype=np.int64)
    recorded = [name for name in names if name in samples]
    if recorded:
        ways = np.nan_to_num(np.stack([samples.column(name) for name in recorded], axis=1))
    else:
        ways = moves_of(samples)[1]
    number = np.unique(ways, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)
    if not recorded:  # a joint that moves later has not moved yet: whence it came, nobody recorded
        number[np.any((ways == 0.0) & np.any(ways != 0.0, axis=0), axis=1)] = -1
    return number


def _at(part: Samples, q_rad: Floats) -> Samples:
    """The rows with what was sent as their readings."""
    joints = {f"q{j + 1}_rad": column for j, column in enumerate(q_rad.T)}
    return Samples(dict(part.columns) | joints, part.n_joints)


def _predicted(pose: Ints, wanted_m: Floats, by_model: Placed) -> dict[int, tuple[float, float]]:
    """Pose -> AP that the model predicts, one sigma along the predicted error."""
    out: dict[int, tuple[float, float]] = {}
    for one in np.unique(pose):
        rows = pose == one
        off_m = np.mean(by_model.tip_m[rows] - wanted_m[rows], axis=0)
        length_m = float(np.linalg.norm(off_m))
        sigma_m = by_model.tip_sigma_m[rows].mean(axis=0)
        along = off_m / length_m if length_m > 0.0 else np.zeros(3)
        out[int(one)] = length_m, float(np.linalg.norm(along * sigma_m))
    return out


def _at_other_places(off_m: Floats, seen_m: Floats, there_m: Floats) -> tuple[str, ...]:
    """A sentence where the device has been moved since the model's session."""
    rms = float(np.sqrt(np.mean(np.sum(off_m**2, axis=1))))
    try:
        T = _fitted(there_m, seen_m)
    except DataError:
        return ()
    left = seen_m @ T[:3, :3].T + T[:3, 3] - there_m
    least = float(np.sqrt(np.mean(np.sum(left**2, axis=1))))
    if rms < MOVED_M or rms < MOVED_SHARE * least:
        return ()
    return (
        f"with the stated pose of the device the model is {1e3 * rms:.1f} mm off, by a best fit {1e3 * least:.3f} mm: "
        "the device seems to have been moved since the model's session; give --frame fit",
    )
