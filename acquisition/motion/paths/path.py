"""A path as a function of time and of the belt: legs between corners, a blend about every corner, joints come out.

Corners lie at times t_k. Leg k leads from corner k to corner k + 1; it is made when the blend before it begins, tacc
before its corner, with the belt as it is then. The blend takes the arm over from what it did until then, whatever that
was, re-expressed in the coordinates of the new leg: 2POS1 = COORD2(s)^-1 COORD1(s) 1POS1 TOOL1^-1 TOOL2.
Source: R. Paul, Robot Manipulators, 1981, ch. 5.6 to 5.9.
"""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import RefusedMotionError, UnreachableError
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.kinematics import apart
from acquisition.motion.paths.legs import CurveLeg, JointLeg, Leg, LineLeg, drive_between
from acquisition.motion.paths.segments import Blend, By, Pace, Place, Segment, blend, state_of

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BeltState:
    """How far the belt has gone, and how fast it is now."""

    s_m: float = 0.0
    rate_m_s: float = 0.0


STANDING = BeltState()
WAY_POINTS = 5  # from the beginning of a transition to its corner; tacc is tenths of a second


class Path:
    """Evaluated forwards in time; the owner of where it is. The arm stands at `start_rad` (joint,) at t = 0."""

    def __init__(
        self,
        solver: Solver,
        start_rad: Floats,
        segments: Sequence[Segment],
        pace: Pace,
        expected_rad: Sequence[Floats | None] = (),
    ) -> None:
        """`expected_rad`: where segments by joints ended when the path was planned; it need not be searched again."""
        if not segments:
            raise RefusedMotionError("a path needs at least one segment")
        self._solver, self._pace, self._tacc_s = solver, pace, pace.tacc_s
        last = segments[-1]
        self._segments = (*segments, Segment(f"stand at {last.name}", By.STAND, last.place))
        self._leg: Leg = JointLeg(start_rad, start_rad, 1.0, np.zeros_like(start_rad))
        self._leg_corner_s = 0.0
        self._corner_s = self._tacc_s  # where the leg under way ends
        self._begun = 0
        self._blend: Blend | None = None
        self._q_rad = start_rad
        self.corners_s: list[float] = []  # of every leg begun so far
        self.rests: list[tuple[float, str]] = []  # when the arm has come to rest on its way, and for which action
        self.ends_rad: list[Floats | None] = []  # of every leg begun by joints
        self._expected_rad = expected_rad

    @property
    def tacc_s(self) -> float:
        return self._tacc_s

    @property
    def ends_s(self) -> float:
        """When the arm rests at the end; infinite until the last corner is known."""
        return self._corner_s if self._begun == len(self._segments) else np.inf

    @property
    def segment(self) -> str:
        """The name of what is under way, for messages."""
        index = max(0, min(self._begun, len(self._segments) - 1) - 1)  # the stand at the end belongs to the last
        return f"segment {index + 1} '{self._segments[index].name}' ({self._segments[index].by.value})"

    @property
    def index(self) -> int:
        """Of the segment under way; the last is the stand at the end."""
        return max(0, self._begun - 1)

    def blending(self, t_s: float) -> bool:
        return self._blend is not None and t_s < self._blend.end_s

    def at(self, t_s: float, belt: BeltState = STANDING) -> Floats:
        """Joint readings (joint,) at time t, not before an earlier one. RefusedMotionError names the segment."""
        try:
            while self._begun < len(self._segments) and t_s >= self._corner_s - self._tacc_s:
                late_s = t_s - (self._corner_s - self._tacc_s)
                self._begin(BeltState(belt.s_m - belt.rate_m_s * late_s, belt.rate_m_s))
            if self.blending(t_s) and self._blend is not None:
                point = self._leg.unflat(self._blend.at(t_s))
            else:
                point = self._leg.point(t_s - self._leg_corner_s)
            self._q_rad = self._leg.joints(point, belt.s_m, self._q_rad)
        except UnreachableError as error:
            raise RefusedMotionError(f"{self.segment}: {error}") from error
        return self._q_rad

    def _begin(self, belt: BeltState) -> None:
        """The next leg, and the blend into it; the belt as it is when the blend begins."""
        segment, before, before_corner_s = self._segments[self._begun], self._leg, self._leg_corner_s
        self._begun += 1
        corner_s, begin_s = self._corner_s, self._corner_s - self._tacc_s
        at_begin_rad = before.joints(before.point(begin_s - before_corner_s), belt.s_m, self._q_rad)
        corner_rad = at_begin_rad
        for ahead_s in np.linspace(0.0, self._tacc_s, WAY_POINTS + 1)[1:]:  # in steps, so that the branch is kept
            point = before.point(begin_s + ahead_s - before_corner_s)
            corner_rad = before.joints(point, belt.s_m + belt.rate_m_s * ahead_s, corner_rad)
        at_corner = BeltState(belt.s_m + belt.rate_m_s * self._tacc_s, belt.rate_m_s)
        leg = self._leg_to(segment, corner_rad, at_corner)

        def as_before(t_s: float) -> Floats:
            s_m = belt.s_m + belt.rate_m_s * (t_s - begin_s)
            q_rad = before.joints(before.point(t_s - before_corner_s), s_m, at_begin_rad)
            return leg.flat(leg.from_joints(q_rad, s_m))

        def as_after(t_s: float) -> Floats:
            return leg.flat(leg.point(t_s - corner_s))

        end_s = corner_s + self._tacc_s
        self._blend = blend(begin_s, state_of(as_before, begin_s), end_s, state_of(as_after, end_s))
        self._leg, self._leg_corner_s, self._corner_s = leg, corner_s, corner_s + leg.duration_s
        self.corners_s.append(corner_s)
        self.ends_rad.append(leg.end_rad if isinstance(leg, JointLeg) else None)
        if segment.by is By.STAND and self._begun < len(self._segments):
            self.rests.append((end_s, segment.action))

    def _leg_to(self, segment: Segment, from_rad: Floats, belt: BeltState) -> Leg:
        """From the corner, where the arm would stand at `from_rad`, with the belt as it is there."""
        place = segment.place
        if segment.curve is not None:
            return CurveLeg(segment.curve, self._tacc_s, segment.slower)
        if segment.by is By.LINE or (segment.by is By.STAND and (place.coord is not None or self._on_line)):
            return self._line(segment, from_rad, belt)
        if segment.by is By.STAND:
            return JointLeg(from_rad, from_rad, self._stand_s(segment), np.zeros_like(from_rad))
        end_rad = segment.posture_rad
        if end_rad is None:
            end_rad = self._end(place.flange_at(belt.s_m), from_rad)
        duration_s = self._joint_time_s(segment, end_rad - from_rad)
        if place.coord is None or belt.rate_m_s == 0.0:
            return JointLeg(from_rad, end_rad, duration_s, np.zeros_like(end_rad))
        return self._chasing(segment, place, from_rad, end_rad, belt)

    def _end(self, T_base_flange: Floats, from_rad: Floats) -> Floats:
        """The posture at the end of a leg by joints: near the expected one, else the nearest of all."""
        expected = self._expected_rad[self._begun - 1] if self._begun <= len(self._expected_rad) else None
        if expected is None:
            return self._solver.nearest(T_base_flange, from_rad)
        return self._near(T_base_flange, expected)

    def _chasing(self, segment: Segment, place: Place, from_rad: Floats, end_rad: Floats, belt: BeltState) -> JointLeg:
        """To a place on a belt that runs: the end is solved for the start of the leg and for its end."""
        end2_rad, duration_s = end_rad, self._joint_time_s(segment, end_rad - from_rad)
        for _ in range(3):  # the end moves on while the arm comes: settles by the ratio of their speeds
            s2_m = belt.s_m + belt.rate_m_s * duration_s
            end2_rad = self._near(place.flange_at(s2_m), end2_rad)
            duration_s = self._joint_time_s(segment, end2_rad - from_rad)
        s2_m = belt.s_m + belt.rate_m_s * duration_s
        end2_rad = self._near(place.flange_at(s2_m), end2_rad)
        return JointLeg(from_rad, end_rad, duration_s, (end2_rad - end_rad) / (s2_m - belt.s_m), belt.s_m)

    def _near(self, T_base_flange: Floats, near_rad: Floats) -> Floats:
        """The same branch where it reaches that far, else the nearest."""
        with suppress(UnreachableError):
            return self._solver.kept(T_base_flange, near_rad)
        return self._solver.nearest(T_base_flange, near_rad)

    def _line(self, segment: Segment, from_rad: Floats, belt: BeltState) -> LineLeg:
        place = segment.place
        leg = LineLeg(self._solver, place, np.eye(4), drive_between(np.eye(4), np.eye(4)), 1.0)
        start = leg.from_joints(from_rad, belt.s_m)  # 2POS1
        if segment.by is By.STAND:
            still = drive_between(place.pos, place.pos)
            return LineLeg(self._solver, place, place.pos, still, self._stand_s(segment))
        drive = drive_between(start, place.pos)
        way_m, _ = apart(start, place.pos)
        time_s = max(
            way_m / self._pace.line_speed_m_s,
            math.hypot(drive.theta_rad, drive.phi_rad) / self._pace.line_turn_rad_s,
            segment.time_s,
        )
        return LineLeg(self._solver, place, start, drive, max(segment.slower * time_s, 2.0 * self._tacc_s))

    def _joint_time_s(self, segment: Segment, way_rad: Floats) -> float:
        """T = max(|dC_i| / v_i, 2 tacc)."""
        time_s = max(float(np.max(np.abs(way_rad) / self._pace.speed_rad_s)), segment.time_s)
        return max(segment.slower * time_s, 2.0 * self._tacc_s)

    def _stand_s(self, segment: Segment) -> float:
        """A whole transition to rest, the time asked for, and a whole one away from it; at the end only the first."""
        last = self._begun == len(self._segments)
        return self._tacc_s if last else 2.0 * self._tacc_s + segment.time_s

    @property
    def _on_line(self) -> bool:
        return isinstance(self._leg, LineLeg)
