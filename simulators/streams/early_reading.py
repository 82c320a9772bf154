"""Samples taken before the arm stands: the outputs creep to their goal, and the program does not wait for it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.streams.course import Course

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class EarlyReading:
    """Arm that has `left` of each move still to go at its stop, with one time constant; read `after_s`."""

    left: float
    time_constant_s: float
    after_s: float
    joints: int

    KIND: ClassVar[str] = "stream-early-reading"
    PHYSICS: ClassVar[str] = "not-settled"

    @property
    def port(self) -> str:
        return "time"

    @property
    def drivers(self) -> tuple[str, ...]:
        return tuple(f"last_move{joint}" for joint in range(1, self.joints + 1))

    @property
    def figures(self) -> Mapping[str, float]:
        return {"tau_s": self.time_constant_s}

    @property
    def size(self) -> float:
        return self.left * float(np.exp(-self.after_s / self.time_constant_s)) * 0.5 / 2e-6  # of half a metre

    @classmethod
    def draw(cls, rng: np.random.Generator, n_joints: int) -> Self:
        return cls(
            float(np.exp(rng.uniform(np.log(2e-5), np.log(4e-4)))),
            float(rng.uniform(0.06, 0.15)),
            float(rng.uniform(0.02, 0.1)),
            n_joints,
        )

    def left_rad(self, course: Course) -> Floats:
        last, since_s = course.since_stop()
        stops = np.searchsorted(course.time_s, course.stops_s)
        goal_rad = course.command_rad[np.minimum(stops, len(course.command_rad) - 1)]
        moved_rad = np.diff(goal_rad, axis=0, prepend=goal_rad[:1])
        standing = np.all(np.abs(course.command_rad - goal_rad[last]) < 1e-9, axis=1)
        fading = self.left * np.exp(-since_s / self.time_constant_s)
        # on the way the outputs are as far behind as at the next stop: that a move is one motion needs no more
        next_move = moved_rad[np.minimum(last + 1, len(moved_rad) - 1)]
        return np.where(standing[:, np.newaxis], fading[:, np.newaxis] * moved_rad[last], self.left * next_move)

    def wait_s(self) -> float:
        return self.after_s
