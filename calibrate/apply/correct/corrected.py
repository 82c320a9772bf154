"""Joint commands at which the real tool, as a model has it with its physics, stands where it is wanted.

The controller is taken to compute with the rig file's arm: for the pose it is given, it commands the joints of that arm
to. The model's flange P(q) = G(q) D(q) is its geometry G with what the physics adds, D, which changes slowly; so the
geometric arm is sent to W D(q)^-1 for a wanted flange W, and D is evaluated again until nothing changes. Each round
leaves about a thousandth of what was left before.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import parse_rig
from calibrate.apply.correct.mounting import Mounting, mounting
from calibrate.apply.predicting import flange_with_physics, placed
from calibrate.errors import DataError
from calibrate.model.arms.coupled_readings import by_reading, recoupled
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.model_file import ModelFile
from calibrate.model.placement import point_by_twist
from calibrate.model.predict import Predictor
from calibrate.model.rigid import inverse
from calibrate.model.with_effects.applied import BY_JOINT

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Branch = Callable[[Floats], Bools]  # joint readings (solution, joint) -> which of them a program asks for

ROUNDS = 12
MOST_POSES = 3_000  # an inverse takes 10 to 20 ms a pose: more would take over a minute
CLOSE = 1e-9  # m and rad: far below what any arm repeats
MOVED_RAD = 1e-4  # a joint that went less far has not moved, as in effects/conditions.py
RANGE_SLACK = 1e-9  # of the recorded range: rounding
OK, LIMIT, UNREACHABLE, OUTSIDE, SINGULAR = "ok", "limit", "unreachable", "outside", "singular"
SAME = 9  # decimals to which frames of one program are the same
TURNED = 3  # poses of a frame: fewer show no turn of it
UNMEASURED = 0.5  # of the predicted error: from here on the tool's own uncertainty is what limits it
SINGULAR_GAIN = 10.0  # joints of a regular posture turn about as far as the tool is off: 1
SINGULAR_RAD = np.radians(0.5)  # a joint that turns less does so unseen


class Inverse(Protocol):
    """Joint readings for flange poses of an arm."""

    def solutions(self, arm: RigArm, T_base_flange: Floats, near_rad: Floats) -> Floats:
        """(solution, joint) within the limits of the arm for one pose (4, 4), nearest to `near_rad` (joint,) first."""
        ...

    def refined(self, arm: RigArm, T_base_flange: Floats, start_rad: Floats) -> tuple[Floats, Bools]:
        """(pose, joint) on the branch of each start, whether or not within the limits, and (pose,) whether found."""
        ...


@dataclass(frozen=True, eq=False)
class Wanted:
    """Poses of the tool in the base, in the order in which they are visited. NaN: not stated."""

    T_base_tool: Floats  # (pose, 4, 4)
    joints_rad: Floats  # (pose, joint) of a point that is given as joint angles: its pose is that of the rig's arm
    near_rad: Floats  # (pose, joint) posture whose branch is wanted
    conditions: Mapping[str, Floats]  # column of samples.csv -> (pose,)
    in_order: bool = True  # whether each pose is reached from the one before
    branches: tuple[Branch | None, ...] = ()  # one a pose; empty: none asks for one
    source: str = "poses"  # the file, in errors

    def __len__(self) -> int:
        return len(self.T_base_tool)


@dataclass(frozen=True, eq=False)
class Options:
    """`tool`: pose (4, 4) in the flange that the controller and the real tool share; None: the rig file's point for the
    controller and the model's for the real one. `approach`: side from which every joint comes by an overshoot point,
    0 for none.
    """

    tool: Floats | None = None
    approach: int = 0
    overshoot_rad: float = np.radians(2.0)
    margin_rad: float = np.radians(1.0)  # to a limit of a joint: nearer is reported
    joint_targets: bool = False  # those of a program, too, as poses of the rig file's arm
    tool_name: str = ""  # as the program has it


@dataclass(frozen=True, eq=False)
class ToolErrors:
    """Distance and turn between real tool and wanted pose, by the model, and one sigma of both; NaN: unknown."""

    error_m: Floats  # (pose,)
    error_rad: Floats
    s_error_m: Floats
    s_error_rad: Floats
    shift_m: Floats  # (pose, 3) wanted less real, along the axes of the base

    @property
    def rms_m(self) -> float:
        """Of the error that is to be expected: the predicted one and its sigma together, over what is reached."""
        return self.rms_where(np.ones(len(self.error_m), dtype=bool))

    def rms_where(self, rows: Bools) -> float:
        """The same over some rows (pose,)."""
        known = rows & np.isfinite(self.error_m)
        squares = self.error_m[known] ** 2 + np.nan_to_num(self.s_error_m[known]) ** 2
        return float(np.sqrt(np.mean(squares))) if len(squares) else float("nan")


@dataclass(frozen=True)
class FrameError:
    """Rms of the error that is to be expected at the poses of a frame: with it measured again, and as it is."""

    name: str
    again_m: float
    as_it_is_m: float


@dataclass(frozen=True, eq=False)
class Corrected:
    """Rows are those of the wanted poses; NaN where nothing can be commanded."""

    q_rad: Floats  # (pose, joint) to command
    nominal_rad: Floats  # (pose, joint) that the controller would have commanded
    via_rad: Floats | None  # (pose, joint) overshoot points, visited before
    T_base_tool: Floats  # (pose, 4, 4) for a controller that computes with the rig file's arm
    before: ToolErrors
    after: ToolErrors
    status: tuple[str, ...]
    says: tuple[str, ...]  # why, where the status is not ok
    notes: tuple[str, ...]

    def of_frames(self, frames: Floats, names: Sequence[str]) -> tuple[FrameError, ...]:
        """Of each frame (pose, 4, 4) with its names, empty for a pose in none. One that was taught with the uncorrected
        arm holds the rigid motion that lies best on that arm's errors at its poses.
        """
        keys, out = _alike(frames), list[FrameError]()
        keys[np.array([not name for name in names])] = -1
        held_m = taken_up(keys, self.T_base_tool[:, :3, 3], self.before.shift_m)
        for key in dict.fromkeys(keys[np.isfinite(held_m) & (keys >= 0)].tolist()):
            rows = keys == key
            again_m = self.after.rms_where(rows)
            called = ", ".join(dict.fromkeys(names[row] for row in np.flatnonzero(rows).tolist()))
            out.append(FrameError(called, again_m, float(np.hypot(again_m, np.sqrt(np.nanmean(held_m[rows] ** 2))))))
        return tuple(out)


def correct(
    model: ModelFile, wanted: Wanted, inverse_of: Inverse, options: Options, most: int = MOST_POSES
) -> Corrected:
    """Commands for every pose that can be reached; what cannot is named, nothing is clipped.

    DataError for a model without its rig, and where an effect of the model cannot be evaluated.
    """
    if len(wanted) > most:
        raise DataError(
            f"{wanted.source}: {len(wanted)} poses; at most {most} are corrected at a time, split it into parts"
        )
    arms = Arms.of(model, options)
    found = commanded(arms, wanted, inverse_of, options)
    q_rad, nominal_rad, conditions, why = found.q_rad, found.nominal_rad, found.conditions, found.why
    via_rad = q_rad - options.approach * options.overshoot_rad if options.approach else None
    refuse_beyond(arms, q_rad, via_rad, why)
    before, _, _ = predicted_errors(model, wanted, nominal_rad, conditions, options)
    after, beyond, notes = predicted_errors(model, wanted, q_rad, conditions, options)
    far_m = np.maximum(np.abs(wanted.T_base_tool[:, :3, 3]).max(axis=1), 0.1)
    off_rad = before.error_rad + before.error_m / far_m  # what joints of a regular posture turn by, about
    singular = near_singular(q_rad - nominal_rad, off_rad)
    status, says = _stated(arms, q_rad, why, beyond, singular, options.margin_rad)
    as_stated = np.full(wanted.T_base_tool.shape, np.nan)
    good: Bools = np.asarray(np.isfinite(q_rad).all(axis=1))
    as_stated[good] = arms.drawn.frames(q_rad[good])[:, -1] @ arms.stated_tool
    if via_rad is not None:
        via_rad = np.where(good[:, None], via_rad, np.nan)
    if options.tool is not None:
        notes = (*notes, *arms.of_tool(after, options.tool_name))
    if arms.low_rad is None:
        notes = (*notes, "the model does not hold its recorded joint range: poses beyond it are not marked")
    return Corrected(q_rad, nominal_rad, via_rad, as_stated, before, after, status, says, notes)


@dataclass(frozen=True, eq=False)
class Commands:
    """Of wanted poses: NaN and, in `why`, status and reason of the row where there is none."""

    q_rad: Floats  # (pose, joint) at which the real tool is there
    nominal_rad: Floats  # (pose, joint) that a controller with the rig file's arm commands
    conditions: Mapping[str, Floats]  # column of samples.csv -> (pose,), with the moves that lead to the poses
    why: dict[int, tuple[str, str]]


def commanded(arms: "Arms", wanted: Wanted, inverse_of: Inverse, options: Options) -> Commands:
    """Joints for every pose that can be reached; their limits are not looked at. DataError as of `correct`."""
    nominal_rad, why = _nominal(arms, wanted, inverse_of)
    reached = np.isfinite(nominal_rad).all(axis=1)
    q_rad = nominal_rad.copy()
    conditions = moves_conditions(wanted, nominal_rad, options)
    if reached.any():
        rows = np.flatnonzero(reached)
        goal = wanted.T_base_tool[rows] @ inverse(arms.real_tool)
        some = {name: values[rows] for name, values in conditions.items()}
        found_rad, solved = _solved(arms, goal, nominal_rad[rows], some, inverse_of)
        q_rad[rows] = np.where(solved[:, None], found_rad, np.nan)
        for row in rows[~solved]:
            why[row] = (UNREACHABLE, "no posture of the calibrated arm puts the tool there")
    return Commands(q_rad, nominal_rad, conditions, why)


@dataclass(frozen=True, eq=False)
class Arms:
    """The arm as the controller and as the model have it, with the tool of each."""

    model: ModelFile
    drawn: RigArm
    geometric: RigArm
    flange: Mounting
    stated_tool: Floats  # (4, 4) in the flange
    real_tool: Floats
    low_rad: Floats | None  # (joint,) recorded range; None: the model does not hold it
    high_rad: Floats | None

    @classmethod
    def of(cls, model: ModelFile, options: Options) -> "Arms":
        predictor = Predictor.of(model)
        rig = parse_rig(model.rig.text or "", f"rig.toml in the model of {model.rig.name}")
        drawn, geometric = RigArm.of_rig(rig), RigArm.of_rig(predictor.rig, predictor.values)
        held = {} if model.session is None else model.session.conditions
        joints = [held.get(f"q{j + 1}_rad") for j in range(rig.n_joints)]
        table = np.array([j for j in joints if j], dtype=np.float64)
        whole = len(table) == rig.n_joints
        flange = mounting(predictor, drawn, geometric)
        if options.tool is not None:
            stated, real = options.tool, flange.T @ options.tool
        else:
            stated, real = np.eye(4), flange.T.copy()
            stated[:3, 3] = drawn.point_m
            real[:3, 3] = predictor.tip_at(np.eye(4)[None])[0]
        read = recoupled(by_reading(rig.arm), table.T) if whole else table
        low, high = (read.min(axis=0), read.max(axis=0)) if whole else (None, None)
        return cls(model, drawn, geometric, flange, stated, real, low, high)

    @property
    def n_joints(self) -> int:
        return self.drawn.n_joints

    @property
    def s_tool_m(self) -> float:
        """One sigma of where the stated tool is, for want of knowing how the flange lies."""
        return self.flange.sigma_m(self.stated_tool[:3, 3])

    def of_tool(self, after: ToolErrors, name: str) -> tuple[str, ...]:
        """A sentence where a stated tool is worth less than the corrected arm."""
        sigma_m, lever_m = self.s_tool_m, self.flange.lever_m(self.stated_tool[:3, 3])
        if sigma_m <= after.rms_m * UNMEASURED:
            return ()
        points = "measured point" if len(self.flange.measured_m) == 1 else "nearest measured point"
        far = f"lies {1e3 * lever_m:.0f} mm from the {points}" if np.isfinite(lever_m) else "is not measured"
        named = f"tool {name}" if name else "the tool"
        return (
            f"{named} {far}: teach it again, or measure three points of it as [[target]] "
            f"in one session; the flange's turn is known to ± {1e3 * self.flange.sigma_rad:.1g} mrad only, which is "
            f"± {1e6 * sigma_m:.0f} µm of the predicted error",
        )


def predicted_errors(
    model: ModelFile, wanted: Wanted, q_rad: Floats, conditions: Mapping[str, Floats], options: Options
) -> tuple[ToolErrors, tuple[str, ...], tuple[str, ...]]:
    """Of the real tool at commands (pose, joint); names of drivers of each row beyond their recorded range; notes."""
    n, arms = len(q_rad), Arms.of(model, options)
    values, off_m, beyond = np.full((4, n), np.nan), np.full((n, 3), np.nan), [""] * n
    rows = np.flatnonzero(np.isfinite(q_rad).all(axis=1))
    if rows.size == 0:
        return ToolErrors(values[0], values[1], values[2], values[3], off_m), tuple(beyond), ()
    samples = as_samples(q_rad[rows], {name: v[rows] for name, v in conditions.items()})
    point_m = None if options.tool is None else arms.real_tool[:3, 3]
    known = placed(model, samples, point_m=point_m, own_flange=True)
    off = wanted.T_base_tool[rows] @ inverse(known.T_base_flange @ arms.real_tool)
    turn = Rotation.from_matrix(off[:, :3, :3]).magnitude()
    there_m = (known.T_base_flange @ arms.real_tool)[:, :3, 3]
    off_m[rows] = shift = wanted.T_base_tool[rows, :3, 3] - there_m
    values[:, rows] = (
        np.linalg.norm(shift, axis=1),
        turn,
        np.hypot(np.linalg.norm(known.tip_sigma_m, axis=1), 0.0 if point_m is None else arms.s_tool_m),
        np.hypot(np.linalg.norm(known.flange_sigma[:, 3:], axis=1), arms.flange.sigma_rad),
    )
    for row, names in zip(rows.tolist(), known.outside, strict=True):
        beyond[row] = names
    return ToolErrors(values[0], values[1], values[2], values[3], off_m), tuple(beyond), known.notes


def _nominal(arms: Arms, wanted: Wanted, inverse_of: Inverse) -> tuple[Floats, dict[int, tuple[str, str]]]:
    """(pose, joint) that a controller with the rig file's arm commands, NaN for none; row -> status and reason."""
    q_rad, why = wanted.joints_rad.copy(), dict[int, tuple[str, str]]()
    last_rad = 0.5 * (arms.drawn.lower_rad + arms.drawn.upper_rad)
    goal = wanted.T_base_tool @ inverse(arms.stated_tool)
    for row in range(len(wanted)):
        stated = wanted.near_rad[row]
        near_rad = stated if np.isfinite(stated).all() else last_rad
        if not np.isfinite(q_rad[row]).all():
            branch = wanted.branches[row] if wanted.branches else None
            found, why_not = _posture(arms.drawn, goal[row], near_rad, branch, inverse_of)
            if found is None:
                why[row] = why_not
                continue
            q_rad[row] = found
        last_rad = q_rad[row]
    return q_rad, why


def _posture(
    arm: RigArm, goal: Floats, near_rad: Floats, branch: Branch | None, inverse_of: Inverse
) -> tuple[Floats | None, tuple[str, str]]:
    """(joint,) nearest to `near_rad` on the wanted branch; or status and reason."""
    within = inverse_of.solutions(arm, goal, near_rad)
    good = within
    if branch is not None:
        good = _in_every_turn(arm, within)
        good = good[branch(good)]
        good = good[np.argsort(np.linalg.norm(good - near_rad, axis=1), kind="stable")]
    if len(good):
        return good[0], (OK, "")
    if len(within):
        return None, (UNREACHABLE, "no posture with the configuration that the program states")
    turn = 2.0 * np.pi * np.ones(arm.n_joints)
    free = inverse_of.solutions(replace(arm, lower_rad=-turn, upper_rad=turn), goal, near_rad)
    if not len(free):
        return None, (UNREACHABLE, "out of reach of the nominal arm")
    beyond = np.maximum(arm.lower_rad - free, free - arm.upper_rad)
    best = int(np.argmin(beyond.max(axis=1)))
    joint = int(np.argmax(beyond[best]))
    return None, (LIMIT, _beyond_limit(arm, joint, float(free[best, joint])))


def _in_every_turn(arm: RigArm, q_rad: Floats) -> Floats:
    """(solution, joint): also those that differ by whole turns, where the range of a joint has room for them."""
    for turn_rad in 2.0 * np.pi * np.eye(arm.n_joints):
        q_rad = np.concatenate([q_rad, q_rad - turn_rad, q_rad + turn_rad])
        q_rad = q_rad[np.all((q_rad >= arm.lower_rad) & (q_rad <= arm.upper_rad), axis=1)]
    return q_rad


def _beyond_limit(arm: RigArm, joint: int, q_rad: float) -> str:
    low, high = np.degrees(arm.lower_rad[joint]), np.degrees(arm.upper_rad[joint])
    return f"joint {joint + 1} would stand at {np.degrees(q_rad):.2f}°, outside its range {low:.1f}° to {high:.1f}°"


def _solved(
    arms: Arms, goal: Floats, start_rad: Floats, conditions: Mapping[str, Floats], inverse_of: Inverse
) -> tuple[Floats, Bools]:
    """(pose, joint) at which the model's flange is nearest to `goal` (pose, 4, 4), and (pose,) whether it was found.

    An effect that jumps (a sign of the torque) may leave a pose between two values: the nearer one is kept, and the
    predicted error shows what is left.
    """
    q_rad, best_rad = start_rad, start_rad.copy()
    least, found = np.full(len(goal), np.inf), np.zeros(len(goal), dtype=bool)
    for _ in range(ROUNDS):
        real = flange_with_physics(arms.model, as_samples(q_rad, conditions))[0]
        off = inverse(real) @ goal
        left = np.maximum(np.linalg.norm(off[:, :3, 3], axis=1), Rotation.from_matrix(off[:, :3, :3]).magnitude())
        better = found & (left < least)
        least[better], best_rad[better] = left[better], q_rad[better]
        going = ~found | (least >= CLOSE)  # the others stay, so that a pose among many ends where it does alone
        if not going.any():
            break
        plain = arms.geometric.frames(q_rad)[:, -1]
        next_rad, solved = inverse_of.refined(arms.geometric, plain @ inverse(real) @ goal, q_rad)
        q_rad = np.where((solved & going)[:, None], next_rad, q_rad)
        found |= solved
    return best_rad, found & np.isfinite(least)


def _alike(frames: Floats) -> NDArray[np.intp]:
    """(pose,) the same number for the same frame (pose, 4, 4)."""
    return np.unique(np.round(frames, SAME).reshape(len(frames), -1), axis=0, return_inverse=True)[1].ravel()


def taken_up(keys: NDArray[np.intp], goal_m: Floats, shift_m: Floats) -> Floats:
    """(pose,) m that frames, numbered (pose,), hold of shifts (pose, 3), wanted less reached, at poses (pose, 3); NaN
    where a pose or its shift is unknown.
    """
    out, known = np.full(len(goal_m), np.nan), np.isfinite(goal_m + shift_m).all(axis=1)
    for key in np.unique(keys):
        rows = np.flatnonzero((keys == key) & known)
        if len(rows) == 0:
            continue
        twist = point_by_twist(goal_m[rows] - goal_m[rows].mean(axis=0)).reshape(-1, 6)
        by = twist if len(rows) >= TURNED else twist[:, :3]
        rigid = by @ np.linalg.lstsq(by, shift_m[rows].ravel(), rcond=1e-6)[0]
        out[rows] = np.linalg.norm(rigid.reshape(-1, 3), axis=1)
    return out


def as_samples(q_rad: Floats, conditions: Mapping[str, Floats]) -> Samples:
    """Rows of joints under conditions. The clock is of no matter: what is true of one session only is left out."""
    n, joints = q_rad.shape
    columns = {"t_s": np.arange(n, dtype=np.float64)} | {f"q{j + 1}_rad": q_rad[:, j] for j in range(joints)}
    return Samples(columns | dict(conditions), joints)


def moves_conditions(wanted: Wanted, q_rad: Floats, options: Options) -> dict[str, Floats]:
    """Conditions with the side from which each joint comes and its last move, where they are known and not stated."""
    n, joints = q_rad.shape
    moves = np.full((n, joints), np.nan)
    if options.approach:
        moves[:] = options.approach * options.overshoot_rad
        side = np.full((n, joints), float(options.approach))
    else:
        if wanted.in_order:
            moves[1:] = np.diff(q_rad, axis=0)
        side = _sides(moves)
    table: dict[str, Floats] = {}
    for j in range(joints):
        if np.isfinite(side[:, j]).any():
            table[BY_JOINT["approach"].format(j + 1)] = side[:, j]
            table[BY_JOINT["last_move"].format(j + 1)] = moves[:, j]
    return table | dict(wanted.conditions)


def _sides(moves: Floats) -> Floats:
    """(pose, joint) sign of the last move that was one; NaN where none is known."""
    side = np.where(np.abs(moves) > MOVED_RAD, np.sign(moves), np.nan)
    for row in range(1, len(side)):
        still = np.isfinite(moves[row]) & (np.abs(moves[row]) <= MOVED_RAD)
        side[row] = np.where(still, side[row - 1], side[row])
    return side


def refuse_beyond(arms: Arms, q_rad: Floats, via_rad: Floats | None, why: dict[int, tuple[str, str]]) -> None:
    """Commands beyond a limit are no commands; in place."""
    for what, table in (("", q_rad), ("overshoot point: ", via_rad)):
        if table is None:
            continue
        beyond = np.maximum(arms.drawn.lower_rad - table, table - arms.drawn.upper_rad)
        for row in np.flatnonzero(np.nan_to_num(beyond, nan=-1.0).max(axis=1) > 0.0):
            joint = int(np.argmax(beyond[row]))
            why[int(row)] = (LIMIT, what + _beyond_limit(arms.drawn, joint, float(table[row, joint])))
            q_rad[row] = np.nan


def _stated(
    arms: Arms,
    q_rad: Floats,
    why: Mapping[int, tuple[str, str]],
    beyond: tuple[str, ...],
    singular: list[str],
    margin_rad: float,
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Status and reason of every row."""
    status: list[str] = []
    says: list[str] = []
    for row, q in enumerate(q_rad):
        if row in why:
            state, reason = why[row]
        else:
            near = _near_limit(arms, q, margin_rad)
            outside = [name for name in beyond[row].split(",") if name] + _beyond_range(arms, q)
            state = LIMIT if near else SINGULAR if singular[row] else OUTSIDE if outside else OK
            out = f"beyond the calibrated range: {', '.join(dict.fromkeys(outside))}" if outside else ""
            reason = "; ".join(part for part in (near, singular[row], out) if part)
        status.append(state)
        says.append(reason)
    return tuple(status), tuple(says)


def near_singular(turned_rad: Floats, off_rad: Floats) -> list[str]:
    """(pose) a sentence where a joint turns far for a small correction (pose, joint); empty elsewhere."""
    most, joint = np.abs(turned_rad).max(axis=1), np.abs(turned_rad).argmax(axis=1)
    return [
        f"near a singular posture: the correction turns joint {j + 1} by {np.degrees(turn):.1f}°"
        if turn > max(SINGULAR_RAD, SINGULAR_GAIN * off)
        else ""
        for turn, j, off in zip(most, joint, off_rad, strict=True)
    ]


def _near_limit(arms: Arms, q: Floats, margin_rad: float) -> str:
    room = np.minimum(q - arms.drawn.lower_rad, arms.drawn.upper_rad - q)
    joint = int(np.argmin(room))
    return f"joint {joint + 1} is {np.degrees(room[joint]):.2f}° from its limit" if room[joint] < margin_rad else ""


def _beyond_range(arms: Arms, q: Floats) -> list[str]:
    if arms.low_rad is None or arms.high_rad is None:
        return []
    slack = RANGE_SLACK * np.maximum(arms.high_rad - arms.low_rad, 1e-12)
    out = (q < arms.low_rad - slack) | (q > arms.high_rad + slack)
    return [f"q{j + 1}" for j in np.flatnonzero(out)]


def wanted_joints(arms: Arms, q_rad: Floats) -> Floats:
    """(pose, 4, 4) where a controller with the rig file's arm has its tool at joints (pose, joint)."""
    return arms.drawn.frames(q_rad)[:, -1] @ arms.stated_tool
