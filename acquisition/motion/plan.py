"""A path gone through before the arm moves: slowed until its rates fit, and refused where it cannot be driven.

The first thing that is wrong is named with its segment, its time and its joint or box.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import RefusedMotionError
from acquisition.motion.cell import Cell, body_points, entered
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.paths.path import STANDING, BeltState, Path
from acquisition.motion.paths.segments import By, Pace, Segment

Floats = NDArray[np.float64]
BeltAt = Callable[[float], BeltState]  # as it is expected at a time of the path

SAMPLE_S = 0.02  # a twentieth of a transition, and 5 mm of way at reduced speed
GRIP_EVERY = 5  # samples, a tenth of a second: the grip changes with the posture, slowly
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
    rests: tuple[tuple[float, str], ...]  # when, and for which action
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
            break  # refused below
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
        tuple(path.rests),
        tuple(path.ends_rad),
    )


def _shares(made: Plan, cell: Cell) -> list[tuple[str, Floats]]:
    """What is limited, in words, and what share of its limit it takes (sample,)."""
    speed, acceleration = made.rates()
    out = [
        (f"{what} of joint {joint + 1}", np.abs(rate[:, joint]) / limit[joint])
        for what, rate, limit in (
            ("the speed", speed, made.pace.speed_rad_s),
            ("the acceleration", acceleration, made.pace.acceleration_rad_s2),
        )
        for joint in range(speed.shape[1])
    ]
    return out + (_shares_of_areas(made, cell) if cell.slow else [])


def _shares_of_areas(made: Plan, cell: Cell) -> list[tuple[str, Floats]]:
    """Of wrist, flange and tool in each slow area, or in it by the next sample."""
    points = body_points(made.solver.arm.frames(made.q_rad)[:, -3:], cell.tool_m)
    speed_m_s = np.linalg.norm(np.gradient(points, made.t_s, axis=0), axis=2)
    out: list[tuple[str, Floats]] = []
    for area in cell.slow:
        inside = area.box.distance_m(points) <= speed_m_s * SAMPLE_S
        fastest_m_s = np.max(np.where(inside, speed_m_s, 0.0), axis=1)
        out.append((f"the speed of the tool in the area '{area.box.name}'", fastest_m_s / area.speed_m_s))
    return out


def _of_segment(made: Plan, i: int) -> NDArray[np.bool_]:
    """(sample,) of a segment; a transition counts for both segments that it joins."""
    tacc_s = made.pace.tacc_s
    return (made.t_s >= made.corners_s[i] - tacc_s) & (made.t_s <= made.corners_s[i + 1] + tacc_s)


def _too_fast(made: Plan, cell: Cell) -> Floats:
    """(segment,) by what each must be slowed, at least 1."""
    worst = np.max([share for _, share in _shares(made, cell)], axis=0)
    return np.array([max(1.0, float(np.max(worst[_of_segment(made, i)]))) for i in range(len(made.segments))])


def _check_grip(made: Plan) -> None:
    """Of segments by joints none is needed; the joint that has lost it is the one named."""
    joint_wise = np.array([segment.by in (By.JOINTS, By.CURVE) for segment in made.segments])
    index = np.minimum(made.segment, len(made.segments) - 1)
    moves = np.any(made.q_rad != made.start_rad, axis=1)
    for k in np.flatnonzero(moves & ~joint_wise[index])[::GRIP_EVERY]:
        joint, worth = made.solver.weakest(made.q_rad[k])
        if worth < LEAST_GRIP:
            stands = made.segments[index[k]].by is By.STAND
            raise RefusedMotionError(
                f"{made.name_of(int(index[k]))} at {made.t_s[k]:.2f} s: near-singular, joint {joint} hardly moves the "
                f"flange (least singular value {worth:.4f}, limit {LEAST_GRIP}); "
                + ("stand elsewhere" if stands else "go there by joints, or move the target")
            )


def _check_range(made: Plan) -> None:
    arm = made.solver.arm
    outside = (made.q_rad < arm.lower_rad) | (made.q_rad > arm.upper_rad)
    if outside.any():
        k, joint = np.argwhere(outside)[0]
        raise RefusedMotionError(
            f"{made.name_of(int(made.segment[k]))} at {made.t_s[k]:.2f} s: joint {joint + 1} at "
            f"{np.degrees(made.q_rad[k, joint]):.1f}° leaves its range {np.degrees(arm.lower_rad[joint]):.1f} to "
            f"{np.degrees(arm.upper_rad[joint]):.1f}°; choose another branch or target"
        )


def _check_boxes(made: Plan, cell: Cell) -> None:
    points = body_points(made.solver.arm.frames(made.q_rad), cell.tool_m, cell.com_m)
    for box in cell.keep_out:
        if (hit := entered(box, points, cell.clearance_m)) is not None:
            k, near_m = hit
            raise RefusedMotionError(
                f"{made.name_of(int(made.segment[k]))} at {made.t_s[k]:.2f} s: the middle of a link, or the "
                f"tool, comes within {1e3 * near_m:.0f} mm of the keep-out box '{box.name}' (clearance "
                f"{1e3 * cell.clearance_m:.0f} mm); move round it"
            )


def _check_rates(made: Plan, cell: Cell) -> None:
    left = _too_fast(made, cell)
    if np.all(left <= OVER):
        return
    i = int(np.argmax(left))
    here = np.flatnonzero(_of_segment(made, i))
    what, share = max(_shares(made, cell), key=lambda named: float(np.max(named[1][here])))
    k = int(here[np.argmax(share[here])])
    raise RefusedMotionError(
        f"{made.name_of(i)} at {made.t_s[k]:.2f} s: {what} is {share[k]:.1f} times its limit, even with the segment "
        f"{made.segments[i].slower:.1f} times slower than asked (at most {SLOWEST:.0f}); a singular posture is near: "
        "go there by joints, or move the target"
    )
