"""A path gone through before the arm moves: slowed until its rates fit, and refused where it cannot be driven.

The first thing that is wrong is named with its segment, its time and its joint or box.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.cell import Cell, body_points, entered
from acquisition.motion.errors import RefusedMotionError
from acquisition.motion.inverse.solver import Solver
from acquisition.motion.paths.path import STANDING, Belt, Path
from acquisition.motion.paths.segments import Pace, Segment

Floats = NDArray[np.float64]
BeltAt = Callable[[float], Belt]  # as it is expected at a time of the path

SAMPLE_S = 0.02  # a twentieth of a transition, and 5 mm of way at reduced speed
LEAST_GRIP = 0.02  # singular value: 1 rad/s of a joint then moves the tool no faster than 20 mrad/s somehow
SLOWEST = 50.0  # a segment that had to be slowed down more than this goes through a singular posture
ROUNDS = 6
OVER = 1.02  # of a limit: differences of samples are not better than that
LONGEST_S = 3600.0


@dataclass(frozen=True, eq=False)
class Plan:
    """A path that may be driven, and its samples for drawing."""

    solver: Solver
    start_rad: Floats
    segments: tuple[Segment, ...]  # slowed where needed
    pace: Pace
    t_s: Floats  # (sample,)
    q_rad: Floats  # (sample, joint)
    segment: NDArray[np.int64]  # (sample,) index
    corners_s: tuple[float, ...]
    actions: tuple[tuple[float, str], ...]
    ends_rad: tuple[Floats | None, ...]  # of segments by joints, for the solutions on the way

    def path(self) -> Path:
        """A fresh path, to be followed from its beginning."""
        return Path(self.solver, self.start_rad, self.segments, self.pace, self.ends_rad)

    @property
    def carried(self) -> bool:
        """Whether any of it moves with a belt."""
        return any(segment.place.coord is not None for segment in self.segments)

    def rates(self) -> tuple[Floats, Floats]:
        """Speed and acceleration (sample, joint), by differences."""
        speed = np.gradient(self.q_rad, self.t_s, axis=0)
        return speed, np.gradient(speed, self.t_s, axis=0)

    def name_of(self, index: int) -> str:
        segment = self.segments[min(index, len(self.segments) - 1)]
        return f"segment {min(index, len(self.segments) - 1) + 1} '{segment.name}' ({segment.by.value})"


def plan(
    solver: Solver,
    start_rad: Floats,
    segments: Sequence[Segment],
    pace: Pace,
    cell: Cell,
    belt: BeltAt = lambda t_s: STANDING,
) -> Plan:
    """RefusedMotionError where the path cannot or may not be driven, before anything moves."""
    slowed = tuple(segments)
    made = _gone_through(solver, start_rad, slowed, pace, belt)
    for _ in range(ROUNDS):
        factors = _too_fast(made, cell)
        if np.all(factors <= OVER):
            break
        slowed = tuple(replace(s, slower=s.slower * float(f)) for s, f in zip(slowed, factors, strict=True))
        if any(s.slower > SLOWEST for s in slowed):
            made = replace(made, segments=slowed)  # refused below, by its name
            break
        made = _gone_through(solver, start_rad, slowed, pace, belt)
    _check_grip(made)
    _check_range(made)
    _check_boxes(made, cell)
    _check_rates(made, cell)
    return made


def _gone_through(solver: Solver, start_rad: Floats, segments: tuple[Segment, ...], pace: Pace, belt: BeltAt) -> Plan:
    path = Path(solver, start_rad, segments, pace)
    times: list[float] = []
    q_rad: list[Floats] = []
    index: list[int] = []
    t_s = 0.0
    while t_s < path.ends_s + SAMPLE_S:
        q_rad.append(path.at(t_s, belt(t_s)))
        times.append(t_s)
        index.append(path.index)
        t_s = len(times) * SAMPLE_S
        if t_s > LONGEST_S:
            raise RefusedMotionError(f"{path.segment}: the path takes more than {LONGEST_S:.0f} s; check its speeds")
    return Plan(
        solver,
        start_rad,
        segments,
        pace,
        np.array(times),
        np.array(q_rad),
        np.array(index),
        tuple(path.corners_s),
        tuple(path.actions),
        tuple(path.ends_rad),
    )


def _too_fast(made: Plan, cell: Cell) -> Floats:
    """(segment,) by what each must be slowed; a transition counts for both segments that it joins."""
    speed, acceleration = made.rates()
    worst = np.max(np.abs(speed) / made.pace.speed_rad_s, axis=1)
    worst = np.maximum(worst, np.max(np.abs(acceleration) / made.pace.acceleration_rad_s2, axis=1))
    worst = np.maximum(worst, _too_fast_here(made, cell))
    factors = np.ones(len(made.segments))
    tacc_s = made.pace.tacc_s
    for i in range(len(factors)):
        last_s = made.corners_s[i + 1] + tacc_s
        here = (made.t_s >= made.corners_s[i] - tacc_s) & (made.t_s <= last_s)
        factors[i] = max(1.0, float(np.max(worst[here])))
    return factors


def _tool_speed(made: Plan, cell: Cell) -> tuple[Floats, Floats]:
    """Points of wrist, flange and tool (sample, point, 3) and their speeds (sample, point) m/s."""
    frames = made.solver.arm.frames(made.q_rad)
    points = body_points(frames[:, -3:], cell.tool_m)
    return points, np.linalg.norm(np.gradient(points, made.t_s, axis=0), axis=2)


def _too_fast_here(made: Plan, cell: Cell) -> Floats:
    """(sample,) tool speed by the cap of the areas it is in."""
    worst = np.zeros(len(made.t_s))
    if not cell.slow:
        return worst
    points, speed = _tool_speed(made, cell)
    for area in cell.slow:
        inside = area.box.distance_m(points) <= 0.0
        worst = np.maximum(worst, np.max(np.where(inside, speed, 0.0), axis=1) / area.speed_m_s)
    return worst


def _check_grip(made: Plan) -> None:
    for k in range(0, len(made.t_s), 5):  # every tenth of a second: the grip changes with the posture, slowly
        joint, worth = made.solver.weakest(made.q_rad[k])
        moves = np.any(made.q_rad[k] != made.start_rad)
        if worth < LEAST_GRIP and moves and made.segments[_clipped(made, k)].by.value != "joint":
            raise RefusedMotionError(
                f"{made.name_of(int(made.segment[k]))} at {made.t_s[k]:.2f} s: joint {joint} is near-singular (least "
                f"singular value {worth:.4f}, limit {LEAST_GRIP}); go there by joints, or move the target"
            )


def _check_range(made: Plan) -> None:
    arm = made.solver.arm
    outside = (made.q_rad < arm.lower_rad) | (made.q_rad > arm.upper_rad)
    if outside.any():
        k, joint = np.argwhere(outside)[0]
        raise RefusedMotionError(
            f"{made.name_of(int(made.segment[k]))} at {made.t_s[k]:.2f} s: joint {joint + 1} at "
            f"{np.degrees(made.q_rad[k, joint]):.1f} deg leaves its range {np.degrees(arm.lower_rad[joint]):.1f} to "
            f"{np.degrees(arm.upper_rad[joint]):.1f} deg; choose another branch or target"
        )


def _check_boxes(made: Plan, cell: Cell) -> None:
    points = body_points(made.solver.arm.frames(made.q_rad), cell.tool_m)
    for box in cell.keep_out:
        if (hit := entered(box, points, cell.clearance_m)) is not None:
            k, near_m = hit
            raise RefusedMotionError(
                f"{made.name_of(int(made.segment[k]))} at {made.t_s[k]:.2f} s: the arm comes within "
                f"{1e3 * near_m:.0f} mm of the keep-out box '{box.name}' (clearance {1e3 * cell.clearance_m:.0f} mm); "
                "move round it"
            )


def _check_rates(made: Plan, cell: Cell) -> None:
    if any(s.slower > SLOWEST for s in made.segments) or np.any(_too_fast(made, cell) > OVER):
        factors = np.array([s.slower for s in made.segments])
        i = int(np.argmax(factors))
        here = (made.t_s >= made.corners_s[i] - made.pace.tacc_s) & (
            made.t_s <= made.corners_s[i + 1] + made.pace.tacc_s
        )
        speed, _ = made.rates()
        joint = int(np.argmax(np.max(np.abs(speed[here]) / made.pace.speed_rad_s, axis=0)))
        raise RefusedMotionError(
            f"{made.name_of(i)}: joint {joint + 1} would have to be {factors[i]:.1f} times slower than planned to stay "
            "within its limits; a singular posture is near: go there by joints, or move the target"
        )


def _clipped(made: Plan, k: int) -> int:
    return min(int(made.segment[k]), len(made.segments) - 1)
