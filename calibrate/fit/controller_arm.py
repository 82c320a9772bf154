"""The arm that a robot's controller computes with, from joint angles and the controller's own tool poses beside them.

A controller with a factory calibration, with absolute accuracy, or with other data of tool or base reports poses that
the rig file's arm does not give. What differs is asked of the parts in turn, the fewest unknowns first; the first
choice that none with more predicts better, over poses that the fit has not seen, is taken.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.special import ndtri

from acquisition.recording import Recording
from acquisition.recording.rig import Rig
from acquisition.recording.samples import CONTROLLER, Floats
from calibrate.errors import DataError
from calibrate.fit.rank import analyse
from calibrate.model.alignment import nearest_rotation
from calibrate.model.arms.catalogue import serial_arm
from calibrate.model.arms.link_tolerance import FREE
from calibrate.model.arms.serial import SerialArm
from calibrate.model.parameters import Parameter, index_of
from calibrate.model.rigid import cross_matrix, inverse, transform

Bools = NDArray[np.bool_]

SMALLEST = 1e-12  # m and rad: a step below it ends the fit
FEWEST = 20  # poses: 120 numbers beside at most some 45 unknowns
MOST = 300  # poses, evenly from those of a stream: more add nothing to what a controller computes
MOVED_RAD = 0.02  # between two poses of a stream
ROUNDING = 1e-9  # m and rad: a controller computes in double precision
LEVEL = 1e-3  # of a false alarm, for a choice of parts and for a number
STEPS = 30
FOLDS = 5
FARTHEST = 1e3  # m and rad: no pose of an arm, nor is what is no number
OUTLYING = 6.0  # sigma (of the median): a pose that was written at another time than its angles
AXES = ("x", "y", "z", "rx", "ry", "rz")
FLAT = 1e-9  # of an axis in another one
FREELY = 1e-9  # of the largest singular value: what lies below, the poses do not determine
AWAY = 0.3  # m and rad: how far another solution is sought along what the poses do not determine
APART = 1e-6  # m and rad: a number that differs by more between two solutions is not determined
SAME_M = 1e-6  # of a tool's point: rounded in a table
PARTS = ("tool", "base", "zeros", "links")
POSES = (("actual_tcp_pose_m_rad",), ("controller_position_m", "controller_rotation_rad"))  # the second of an import
JOINTS, OFFSET = "actual_q_rad", "tcp_offset_m_rad"  # channels of a robot's stream


@dataclass(frozen=True, eq=False)
class ControllerPoses:
    """Joint angles (pose, joint), rad, the controller's tool in its base (pose, 4, 4), and where it states its tool."""

    q_rad: Floats
    T_base_tool: Floats
    T_flange_tool: Floats | None  # (pose, 4, 4); None: not recorded
    source: str

    @classmethod
    def of(cls, recording: Recording) -> "ControllerPoses | None":
        """Of a robot's stream, or else of the columns of the samples; None where there are none."""
        for stream in recording.streams.values():
            names = next((n for n in POSES if all(c in stream.values for c in (JOINTS, *n))), None)
            if names is not None and stream.host_s.size:
                q = np.asarray(stream.values[JOINTS], dtype=np.float64)
                pose = np.concatenate([np.asarray(stream.values[c], dtype=np.float64) for c in names], axis=1)
                offset = np.asarray(stream.values[OFFSET], dtype=np.float64) if OFFSET in stream.values else None
                if q.shape[1:] != (recording.rig.n_joints,):
                    continue  # the robot of another rig
                rows = _moved(q, np.asarray(np.all(np.abs(np.concatenate([q, pose], axis=1)) < FARTHEST, axis=1)))
                tool = None if offset is None else _transforms(offset[rows])
                return cls(q[rows], _transforms(pose[rows]), tool, f"stream {stream.name}")
        samples = recording.samples
        if not all(name in samples.columns for name in CONTROLLER) or not len(samples):
            return None
        pose = np.stack([np.asarray(samples.columns[c], dtype=np.float64) for c in CONTROLLER], axis=1)
        known = np.asarray(np.all(np.abs(pose) < FARTHEST, axis=1))
        if not known.any():
            return None
        rows = np.flatnonzero(known)[np.unique(np.linspace(0, int(known.sum()) - 1, MOST).astype(int))]
        return cls(samples.joints()[rows], _transforms(pose[rows]), None, "samples")

    @classmethod
    def recorded(cls, recording: Recording) -> bool:
        """Whether the recording has channels or columns for such poses, whatever stands in them."""
        channels = [stream.values for stream in recording.streams.values()]
        return any(all(c in values for c in names) for values in channels for names in POSES) or all(
            name in recording.samples.columns for name in CONTROLLER
        )

    @classmethod
    def joined(cls, several: "Sequence[ControllerPoses]") -> "ControllerPoses | None":
        """Those of several recordings of one robot, evenly at most MOST; None of none."""
        if not several:
            return None
        q, T = (np.concatenate([getattr(one, name) for one in several]) for name in ("q_rad", "T_base_tool"))
        tools = [one.T_flange_tool for one in several if one.T_flange_tool is not None]
        rows = np.unique(np.linspace(0, len(q) - 1, MOST).astype(int))
        tool = np.concatenate(tools)[rows] if len(tools) == len(several) else None
        return cls(q[rows], T[rows], tool, several[0].source)

    def rows(self, kept: Bools) -> "ControllerPoses":
        tool = None if self.T_flange_tool is None else self.T_flange_tool[kept]
        return replace(self, q_rad=self.q_rad[kept], T_base_tool=self.T_base_tool[kept], T_flange_tool=tool)


def _moved(q_rad: Floats, known: Bools) -> NDArray[np.intp]:
    """Rows that differ from the one before them, at most MOST."""
    rows = np.flatnonzero(known)
    kept = list[int]()
    for row in rows.tolist():
        if not kept or np.max(np.abs(q_rad[row] - q_rad[kept[-1]])) > MOVED_RAD:
            kept.append(row)
    if not kept:
        return rows
    return np.array(kept, dtype=np.intp)[np.unique(np.linspace(0, len(kept) - 1, MOST).astype(int))]


def _transforms(pose: Floats) -> Floats:
    """(pose, 4, 4) of x, y, z in m and a rotation vector in rad (pose, 6)."""
    out = np.tile(np.eye(4), (len(pose), 1, 1))
    out[:, :3, :3], out[:, :3, 3] = Rotation.from_rotvec(pose[:, 3:]).as_matrix(), pose[:, :3]
    return out


@dataclass(frozen=True)
class ArmDifference:
    """One number of the controller's arm that is not that of the rig file."""

    name: str
    unit: str
    value: float  # the controller's less the rig file's
    sigma: float


@dataclass(frozen=True, eq=False)
class ControllerArm:
    """What a controller computes with."""

    parts: tuple[str, ...]  # "base", "zeros", "links" that are not those of the rig file
    other_tool: bool  # neither the bare flange nor the rig file's point
    differences: tuple[ArmDifference, ...]
    undetermined: tuple[str, ...]  # reasons, of numbers that these poses do not show
    theta: dict[str, float]  # corrections of the arm by name
    T_base: Floats  # (4, 4) of the rig file's base in the controller's
    T_flange_tool: Floats  # (4, 4)
    tool_sigma: (
        Floats | None
    )  # (6,) of its point (m) and turn (rad), axes of the flange; inf: not determined; None: stated
    poses: int
    left_out: int
    left_m: float  # rms of a coordinate
    left_rad: float
    source: str


@dataclass(frozen=True, eq=False)
class _State:
    theta: Floats
    base: Floats
    tool: Floats


@dataclass(frozen=True, eq=False)
class _Fit:
    arm: SerialArm
    poses: ControllerPoses
    sizes: tuple[float, float] = (1.0, 1.0)

    def columns(self, parts: Sequence[str]) -> tuple[Parameter, ...]:
        zero = [p.name.endswith(".zero") for p in self.arm.parameters]
        own = [
            p for p, z in zip(self.arm.parameters, zero, strict=True) if p.free and ("zeros" if z else "links") in parts
        ]
        moved = [
            Parameter(f"{part}.{axis}", "rad" if axis.startswith("r") else "m", 1e-3)
            for part in ("base", "tool")
            if part in parts
            for axis in AXES
        ]
        return (*own, *moved)

    def predicted(self, at: _State) -> Floats:
        flange = at.base @ self.arm.flange(at.theta, self.poses.q_rad)
        stated = self.poses.T_flange_tool
        return flange @ at.tool if stated is None else flange @ at.tool @ stated

    def residual(self, at: _State) -> Floats:
        """(pose, 6) measured less predicted, in units of the sizes."""
        T, goal = self.predicted(at), self.poses.T_base_tool
        turn = Rotation.from_matrix(goal[:, :3, :3] @ np.swapaxes(T[:, :3, :3], 1, 2)).as_rotvec()
        return np.concatenate([(goal[:, :3, 3] - T[:, :3, 3]) / self.sizes[0], turn / self.sizes[1]], axis=1)

    def jacobian(self, at: _State, parts: Sequence[str]) -> Floats:
        """(pose, 6, column)"""
        T = self.predicted(at)
        n, arm, index = len(T), self.arm.twists(at.theta, self.poses.q_rad), index_of(self.arm.parameters)
        names = [p.name for p in self.columns(parts) if p.name in index]
        R, p = at.base[:3, :3], at.base[:3, 3]
        w = R @ arm[:, 3:, [index[name] for name in names]]
        blocks = [np.concatenate([R @ arm[:, :3, [index[name] for name in names]] + cross_matrix(p) @ w, w], axis=1)]
        if "base" in parts:
            blocks.append(np.tile(np.eye(6), (n, 1, 1)))
        if "tool" in parts:
            F = at.base @ self.arm.flange(at.theta, self.poses.q_rad) @ at.tool
            body = np.zeros((n, 6, 6))
            body[:, :3, :3] = body[:, 3:, 3:] = F[:, :3, :3]
            body[:, :3, 3:] = cross_matrix(F[:, :3, 3]) @ F[:, :3, :3]
            blocks.append(body)
        twist = np.concatenate(blocks, axis=2)
        shift = twist[:, :3] - cross_matrix(T[:, :3, 3]) @ twist[:, 3:]
        return np.concatenate([shift / self.sizes[0], twist[:, 3:] / self.sizes[1]], axis=1)

    def held_out(self, parts: Sequence[str], at: _State) -> Floats:
        """(pose,) squared error of each pose by a fit to the poses of the other folds, not below rounding.

        Folds are stretches of the recording: a pose beside one that is known would hide what is wrong elsewhere.
        """
        n = len(self.poses.q_rad)
        fold, out = np.arange(n) * FOLDS // n, np.empty(n)
        for k in range(FOLDS):
            there = replace(self, poses=self.poses.rows(fold != k)).solved(parts, at)
            out[fold == k] = np.sum(replace(self, poses=self.poses.rows(fold == k)).residual(there) ** 2, axis=1)
        return np.maximum(out, sum((ROUNDING / size) ** 2 for size in self.sizes))

    def covariance(self, at: _State, parts: Sequence[str]) -> Floats:
        """(column, column) of the estimates, by what each pose leaves: its six numbers may err together.

        Source: H. White, A heteroskedasticity-consistent covariance matrix estimator, Econometrica 48 (1980) 817.
        """
        J, r = self.jacobian(at, parts), self.residual(at)
        scale = np.array([p.plausible for p in self.columns(parts)])
        whole = np.linalg.pinv((J * scale).reshape(-1, len(scale)), rcond=1e-10).reshape(len(scale), len(r), 6)
        pulls = scale[:, None] * np.einsum("kni,ni->kn", whole, r)
        return pulls @ pulls.T

    def moved(self, at: _State, parts: Sequence[str], step: Floats) -> _State:
        """`step` (column,): of the arm added, of base and tool as motions, in the base's and in the tool's own axes."""
        index, by = index_of(self.arm.parameters), dict(zip((p.name for p in self.columns(parts)), step, strict=True))
        theta = at.theta.copy()
        for name in by.keys() & index.keys():
            theta[index[name]] += by[name]
        base, tool = (_motion(by, part) for part in ("base", "tool"))
        return _State(theta, base @ at.base, at.tool @ tool)

    def solved(self, parts: Sequence[str], start: _State) -> _State:
        at, columns = start, self.columns(parts)
        if not columns:
            return at
        scale = np.array([p.plausible for p in columns])
        for _ in range(STEPS):
            J = self.jacobian(at, parts).reshape(-1, len(columns)) * scale
            step = scale * np.asarray(np.linalg.lstsq(J, self.residual(at).ravel(), rcond=1e-10)[0], dtype=np.float64)
            at = self.moved(at, parts, step)
            if np.max(np.abs(step)) < SMALLEST:
                break
        return at


def _motion(by: dict[str, float], part: str) -> Floats:
    v = np.array([by.get(f"{part}.{axis}", 0.0) for axis in AXES])
    return transform(v[:3], v[3:])


def controller_arm(rig: Rig, poses: ControllerPoses) -> ControllerArm:
    """DataError for poses that are too few."""
    if len(poses.q_rad) < FEWEST:
        raise DataError(f"{poses.source}: {len(poses.q_rad)} different poses of the controller's tool; give {FEWEST}")
    arm, tools = serial_arm(rig.arm, FREE), poses.T_flange_tool
    flange = arm.flange(np.zeros(len(arm.parameters)), poses.q_rad)
    goal = poses.T_base_tool if tools is None else poses.T_base_tool @ inverse(tools)
    start = placed(flange, goal)
    alone = _mean_motion(flange, goal)
    left = np.zeros((0, 6))
    kept, fit = np.ones(len(flange), dtype=bool), _Fit(arm, poses)
    for _ in range(STEPS):
        whole = fit.solved(PARTS, _State(np.zeros(len(arm.parameters)), *start))
        left = _Fit(arm, poses).residual(whole)
        good = _within(left)
        if np.array_equal(good, kept):
            break
        kept, fit = good, _Fit(arm, poses.rows(good))
    fit = _Fit(arm, poses.rows(kept), _sizes(left[kept]))
    states, errors = dict[tuple[str, ...], _State](), dict[tuple[str, ...], Floats]()
    for parts in _choices(with_tool=tools is None):
        base, tool = start if {"base", "tool"} <= set(parts) else (np.eye(4), alone if "tool" in parts else np.eye(4))
        at = states[parts] = fit.solved(parts, _State(np.zeros(len(arm.parameters)), base, tool))
        errors[parts] = fit.held_out(parts, at)
        if np.all(np.abs(fit.residual(at)) * np.repeat(fit.sizes, 3) < ROUNDING):
            break  # exact: nothing can do better
    tried = list(errors)
    parts = next(p for k, p in enumerate(tried) if not any(_better(errors[r], errors[p]) for r in tried[k + 1 :]))
    return _stated(rig, fit, states[parts], parts, len(kept) - int(kept.sum()))


def _better(rich: Floats, plain: Floats) -> bool:
    """Whether held-out errors (pose,) are smaller than others for certain.

    A pose counts once: what moves its six numbers together, as a pose that is read late, is no evidence six times.
    """
    gain = plain - rich
    return float(np.mean(gain)) > float(-ndtri(LEVEL) * np.std(gain) / np.sqrt(len(gain))) > 0.0


def _choices(*, with_tool: bool) -> list[tuple[str, ...]]:
    """The fewest unknowns first; links never without zeros."""
    placing = [("tool",), ("tool", "base")] if with_tool else [(), ("tool",), ("base",), ("tool", "base")]
    return [(*at, *own) for own in ((), ("zeros",), ("zeros", "links")) for at in placing]


def _within(left: Floats) -> Bools:
    """(pose,) whether what is left of a pose (pose, 6) is not far beyond that of most."""
    size = np.stack([np.linalg.norm(left[:, :3], axis=1), np.linalg.norm(left[:, 3:], axis=1)], axis=1)
    return np.all(size <= OUTLYING * np.maximum(np.median(size, axis=0), ROUNDING), axis=1)


def _sizes(left: Floats) -> tuple[float, float]:
    """One sigma of a coordinate and of an angle, not below rounding."""
    m, rad = (float(np.sqrt(np.mean(part**2))) for part in (left[:, :3], left[:, 3:]))
    return max(m, ROUNDING), max(rad, ROUNDING)


def _stated(rig: Rig, fit: _Fit, at: _State, parts: tuple[str, ...], left_out: int) -> ControllerArm:
    columns, names = fit.columns(parts), [p.name for p in fit.arm.parameters]
    left = fit.residual(at) * np.repeat(fit.sizes, 3)
    theta, value = dict(zip(names, at.theta.tolist(), strict=True)), _numbers(fit, at)
    differences, undetermined, tool_sigma = list[ArmDifference](), list[str](), None
    if columns:
        seen = analyse(fit.jacobian(at, parts).reshape(-1, len(columns)), columns)
        limit = float(-ndtri(0.5 * LEVEL / len(columns)))
        sigmas = np.maximum(seen.sigma, np.sqrt(np.diag(fit.covariance(at, parts))))
        tool_sigma, open_ = _tool_sigma(at, columns, np.maximum(sigmas, ROUNDING)), _open(fit, at, parts)
        if tool_sigma is not None:  # a base that the poses cannot tell from the tool may be another one, too
            beside = open_ | _open(fit, at, [p for p in PARTS if p in parts or p == "base"])
            tool_sigma = np.where([f"tool.{axis}" in beside for axis in AXES], np.inf, tool_sigma)
        for p, sigma in zip(columns, sigmas.tolist(), strict=True):
            if not np.isfinite(sigma):
                undetermined.append(f"{p.name}: {seen.reason(p.name)}")
            elif not p.name.startswith("tool.") and p.name in open_:
                undetermined.append(f"{p.name}: it depends on numbers that these poses do not determine")
            elif not p.name.startswith("tool.") and abs(value[p.name]) > max(limit * sigma, ROUNDING * 10.0):
                differences.append(ArmDifference(p.name, p.unit, value[p.name], sigma))
    stated = fit.poses.T_flange_tool
    tool = at.tool if stated is None else at.tool @ stated[-1]
    m, rad = (float(np.sqrt(np.mean(part**2))) for part in (left[:, :3], left[:, 3:]))
    own_tool = _differs(rig, tool, max(m, ROUNDING))
    named = tuple(p for p in parts if p != "tool") if differences or undetermined else ()
    source = fit.poses.source
    return ControllerArm(
        named,
        own_tool,
        tuple(differences),
        tuple(undetermined),
        theta,
        at.base,
        tool,
        tool_sigma,
        len(left),
        left_out,
        m,
        rad,
        source,
    )


def _numbers(fit: _Fit, at: _State) -> dict[str, float]:
    """By name: corrections of the arm, shift and rotation vector of the base, point and turns of the tool."""
    base = [*at.base[:3, 3], *Rotation.from_matrix(at.base[:3, :3]).as_rotvec()]
    tool = [*at.tool[:3, 3], *Rotation.from_matrix(at.tool[:3, :3]).as_euler("xyz")]
    names = [p.name for p in fit.arm.parameters]
    names += [f"{part}.{axis}" for part in ("base", "tool") for axis in AXES]
    return dict(zip(names, map(float, (*at.theta, *base, *tool)), strict=True))


def _open(fit: _Fit, at: _State, parts: Sequence[str]) -> set[str]:
    """Names of numbers that another solution has otherwise, away along all that the poses do not determine.

    Near a solution a number may seem determined that is none: the point of a tool whose turn is open goes on a circle.
    """
    columns, here = fit.columns(parts), fit.solved(parts, at)
    scale = np.array([p.plausible for p in columns])
    _, size, ways = np.linalg.svd(fit.jacobian(here, parts).reshape(-1, len(columns)) * scale, full_matrices=True)
    size = np.concatenate([size, np.zeros(len(columns) - len(size))])
    way: Floats = scale * np.sum(ways[size <= FREELY * size[0]], axis=0)
    if not way.any():
        return set()
    there = fit.solved(parts, fit.moved(here, parts, AWAY * way / np.max(np.abs(way))))
    one, other = _numbers(fit, here), _numbers(fit, there)
    return {name for name in one if abs(_apart(name, one[name], other[name])) > APART}


def _apart(name: str, one: float, other: float) -> float:
    """Of turns less than half a turn."""
    turns = name.rpartition(".")[2].startswith("r")
    return (other - one + np.pi) % (2.0 * np.pi) - np.pi if turns else other - one


def _tool_sigma(at: _State, columns: Sequence[Parameter], sigmas: Floats) -> Floats | None:
    """(6,) along and about the axes of the flange; a motion of the tool is fitted in its own. None without a fit."""
    by_name = dict(zip((p.name for p in columns), sigmas.tolist(), strict=True))
    own = [by_name.get(f"tool.{axis}") for axis in AXES]
    if None in own:
        return None
    turn = np.abs(at.tool[:3, :3])
    turn[turn < FLAT] = 0.0
    with np.errstate(invalid="ignore"):  # an axis that takes no part in one that is not determined
        parts = np.array(own, dtype=float).reshape(2, 1, 3) * turn[None]
    return np.sqrt(np.nansum(parts**2, axis=2)).ravel()


def _differs(rig: Rig, tool: Floats, sigma_m: float) -> bool:
    """Whether the controller's tool is neither the bare flange nor the rig file's point."""
    known = [np.zeros(3), *([np.array(rig.tool.point_m)] if rig.tool.point_m is not None else [])]
    return all(np.linalg.norm(tool[:3, 3] - point_m) > max(SAME_M, 5.0 * sigma_m) for point_m in known)


def _mean_motion(T_from: Floats, T_to: Floats) -> Floats:
    """(4, 4) C with T_from C nearest to T_to (pose, 4, 4): the mean turn and the median shift of what lies between."""
    between = inverse(T_from) @ T_to
    out = np.eye(4)
    out[:3, :3] = Rotation.from_matrix(between[:, :3, :3]).mean().as_matrix()
    out[:3, 3] = np.median(between[:, :3, 3], axis=0)
    return out


def placed(T_arm: Floats, T_goal: Floats) -> tuple[Floats, Floats]:
    """Base and tool (4, 4) with base T_arm tool nearest to T_goal (pose, 4, 4), in closed form.

    Source: M. Shah, Solving the robot-world/hand-eye calibration problem using the Kronecker product, J. Mechanisms and
    Robotics 5 (2013) 031007: the turns by the largest singular vectors, then the shifts by linear least squares.
    """
    A, B = T_arm[:, :3, :3], T_goal[:, :3, :3]  # X A Z = B
    K = np.einsum("nij,nkl->ikjl", B, A).reshape(9, 9)
    U = np.linalg.svd(K)[0]
    turn = U[:, 0].reshape(3, 3)  # a singular vector has either sign: of a rotation, it is the right-handed one
    base = nearest_rotation(turn * np.sign(np.cross(turn[0], turn[1]) @ turn[2]))
    tool = Rotation.from_matrix(np.swapaxes(base @ A, 1, 2) @ B).mean().as_matrix()
    n = len(A)
    M = np.concatenate([np.tile(np.eye(3), (n, 1, 1)), base @ A], axis=2).reshape(-1, 6)
    v = (T_goal[:, :3, 3] - (base @ T_arm[:, :3, 3:])[..., 0]).ravel()
    shift = np.linalg.lstsq(M, v)[0]
    X, Z = np.eye(4), np.eye(4)
    X[:3, :3], X[:3, 3], Z[:3, :3], Z[:3, 3] = base, shift[:3], tool, shift[3:]
    return X, Z
