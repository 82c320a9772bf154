"""Set-points of a path: solved a period ahead where a belt may move, or all beforehand where none does.

At t_k the belt is read and the solution for t_k + 2/f begun; it is ready at t_k + 1/f, and interpolated to from there.
So a belt that stops dead is overshot by 2 Vc / f, and between solutions y apart the joints leave a straight track at
distance R by y^2 / (8 R). Source: R. Paul, Robot Manipulators, 1981, ch. 5 (rates); lecture chapter 8, "Rates".
Last, how far off its planned way an arm was by what its controller reported, and the rates it was streamed to.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from acquisition.motion.paths.path import STANDING, BeltState, Path
from acquisition.motion.plan import Plan

Floats = NDArray[np.float64]


class SolvedPath:
    """The solutions of a path at every period; between them, as in a hold, it is interpolated."""

    def __init__(self, path: Path, period_s: float) -> None:
        """RefusedMotionError where the path cannot be solved."""
        self._period_s = period_s
        solved: list[Floats] = []
        while len(solved) * period_s < path.ends_s + period_s:
            solved.append(path.at(len(solved) * period_s))
        self._q_rad = np.array(solved)
        self.ends_s, self.rests = path.ends_s, path.rests

    def at(self, t_s: float, belt: BeltState = STANDING) -> Floats:
        """Joint readings (joint,) at time t; at the end it stays."""
        place = min(t_s / self._period_s, len(self._q_rad) - 1.0)
        before = min(int(place + 1e-9), len(self._q_rad) - 2)
        share = place - before
        out: Floats = self._q_rad[before] + (self._q_rad[before + 1] - self._q_rad[before]) * share
        return out


BeltNow = Callable[[], BeltState]


class Followable(Protocol):
    """A path, solved while it is followed or beforehand."""

    @property
    def ends_s(self) -> float: ...
    @property
    def rests(self) -> list[tuple[float, str]]: ...
    def at(self, t_s: float, belt: BeltState) -> Floats: ...


@dataclass(frozen=True)
class OnPath:
    """Where on its path a set-point is: path time, and how fast that runs (1: as planned)."""

    t_s: float
    rate: float


PER_STRUCTURAL = 10.0  # solutions per period of the lowest structural resonance: steps then excite none
SERVO_PER_STRUCTURAL = 15.0  # of the joint servos, at which set-points are sent


def solve_rate_hz(structural_hz: float, stream_hz: float) -> float:
    """f_solve = 10 f_structural, never more than one solution for each set-point of the stream."""
    return min(PER_STRUCTURAL * structural_hz, stream_hz)


class LookAhead:
    """The one owner of how far a path has been solved; `reached_s`: path time that the set-points have passed.

    Path time runs by `scale`, which the caller may change.
    """

    def __init__(self, path: Followable, solve_hz: float, belt: BeltNow, start_rad: Floats, lag_s: float = 0.0) -> None:
        """`lag_s`: by which the arm follows its set-points; a belt is led by what it goes meanwhile."""
        self.path = path
        self.scale = 1.0
        self._path_s = 0.0  # path time of the solution after these
        self._period_s, self._belt, self._lag_s = 1.0 / solve_hz, belt, lag_s
        self._behind_rad = self._ahead_rad = self._next_rad = start_rad
        self.reached_s = self._ahead_s = self._next_s = 0.0  # path times of the three
        self._interval = -1

    def at(self, t_s: float) -> Floats:
        """The set-point (joint,) at stream time t, not before an earlier one. RefusedMotionError."""
        interval = int(t_s / self._period_s + 1e-9)
        while self._interval < interval:
            self._interval += 1
            self._behind_rad, self._ahead_rad = self._ahead_rad, self._next_rad
            self.reached_s, self._ahead_s, self._next_s = self._ahead_s, self._next_s, self._path_s
            self._next_rad = self._solved()
        share = t_s / self._period_s - self._interval
        return self._behind_rad + (self._ahead_rad - self._behind_rad) * share

    def on_path(self, t_s: float) -> OnPath:
        """Of the set-point of stream time t, the last one that was asked for."""
        way_s = self._ahead_s - self.reached_s
        return OnPath(self.reached_s + way_s * self._share(t_s), way_s / self._period_s)

    def restart(self, t_s: float) -> None:
        """The arm has come to rest on the set-point of stream time t: the path goes on from there, from standing."""
        here_rad = self._behind_rad + (self._ahead_rad - self._behind_rad) * self._share(t_s)
        here_s = self.on_path(t_s).t_s
        self._behind_rad = self._ahead_rad = self._next_rad = here_rad
        self.reached_s = self._ahead_s = self._next_s = self._path_s = here_s
        self.scale = 0.0

    def _share(self, t_s: float) -> float:
        """Of the way from the solution behind to the one ahead, at the end of which a set-point may already be."""
        return min(1.0, t_s / self._period_s - self._interval)

    def _solved(self) -> Floats:
        """Two periods ahead of the belt that is read now, and the arm's own lag."""
        belt = self._belt()
        ahead = BeltState(belt.s_m + belt.rate_m_s * (2.0 * self._period_s + self._lag_s), belt.rate_m_s)
        q_rad = self.path.at(self._path_s, ahead)
        self._path_s += self.scale * self._period_s
        return q_rad


STEP_S = 0.002  # of the planned way: half a millimetre at reduced speed, so that its chords count for nothing
ROWS = 50_000  # whose frames are held at a time: 40 MB


@dataclass(frozen=True)
class Deviation:
    """Distances of the tool from its planned way, of all samples."""

    largest_m: float
    rms_m: float


def deviation(sweeps: list[tuple[Plan, Floats]]) -> Deviation | None:
    """Of plans and the readings (sample, joint) while each was followed: from the way, whatever the lag along it.

    None: nothing can be compared. A way with a belt is left out, for it was planned before the belt was read.
    """
    off_m = [_off_m(made, q_rad) for made, q_rad in sweeps if not made.carried and len(q_rad)]
    if not off_m:
        return None
    every_m = np.concatenate(off_m)
    return Deviation(float(every_m.max()), float(np.sqrt(np.mean(every_m**2))))


def _off_m(made: Plan, q_rad: Floats) -> Floats:
    tool, path = np.append(made.segments[-1].place.tool[:3, 3], 1.0), made.path()

    def tips_m(joints_rad: Floats) -> Floats:
        parts = np.array_split(joints_rad, 1 + len(joints_rad) // ROWS)
        return np.concatenate([(made.solver.arm.frames(part)[:, -1] @ tool)[:, :3] for part in parts])

    way_m = tips_m(np.array([path.at(t_s, STANDING) for t_s in np.arange(0.0, made.t_s[-1] + STEP_S, STEP_S)]))
    seen_m = tips_m(q_rad)
    nearest = np.asarray(KDTree(way_m).query(seen_m)[1])
    distances_m = [_from_chord_m(seen_m, way_m[np.maximum(nearest - 1, 0)], way_m[nearest]),
              _from_chord_m(seen_m, way_m[nearest], way_m[np.minimum(nearest + 1, len(way_m) - 1)])]  # fmt: skip
    out: Floats = np.min(distances_m, axis=0)
    return out


def _from_chord_m(seen_m: Floats, begin_m: Floats, end_m: Floats) -> Floats:
    along_m = end_m - begin_m
    share = np.sum((seen_m - begin_m) * along_m, axis=1) / np.maximum(np.sum(along_m**2, axis=1), 1e-30)
    out: Floats = np.linalg.norm(seen_m - begin_m - np.clip(share, 0.0, 1.0)[:, None] * along_m, axis=1)
    return out


def rates_text(structural_hz: float, stream_hz: float) -> str:
    """Which rates are taken, and whether the controller's cycle is fast enough for the structure."""
    solved_hz, servo_hz = solve_rate_hz(structural_hz, stream_hz), SERVO_PER_STRUCTURAL * structural_hz
    capped = "" if solved_hz == PER_STRUCTURAL * structural_hz else ", all that the stream takes"
    enough = "enough" if stream_hz >= servo_hz else "TOO SLOW: go slower, or measure structural_hz"
    return (
        f"solved at {solved_hz:g} Hz ({PER_STRUCTURAL:g} x structural_hz {structural_hz:g} Hz of the rig file"
        f"{capped}), "
        f"sent at {stream_hz:g} Hz ({SERVO_PER_STRUCTURAL:g} x: {servo_hz:g} Hz, {enough})"
    )
