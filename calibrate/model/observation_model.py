"""An arm and an instrument together: joint readings to expected observations, of one pose a row or of several."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from calibrate.model.kinematic_model import KinematicModel
from calibrate.model.parameters import Parameter
from calibrate.model.sensor_model import About, Used

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ObservationModel(ABC):
    """Parameters are those of the arm, then those of the sensor; any arm meets any sensor by one chain rule.

    Readings of a row are those of its poses side by side, (row, pose joint).
    """

    model: KinematicModel
    sensor: Used  # how the instrument was used at the rows

    poses: ClassVar[int]  # of a row

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self._parameters

    @cached_property
    def _parameters(self) -> tuple[Parameter, ...]:
        return self.model.parameters + self.sensor.parameters

    @abstractmethod
    def at_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        """(row, k) observations for the sensor's own values and the flange (row, 4, 4) of each pose of a row."""

    @abstractmethod
    def by_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> tuple[Floats, ...]:
        """(row, k, 6) derivative by a base-frame twist [v; w] of the flange, of each pose of a row."""

    @abstractmethod
    def by_own(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        """(row, k, own) derivative by the sensor's own parameters."""

    def expect(self, theta: Floats, q_rad: Floats) -> Floats:
        """(row, k) observations for readings (row, reading)."""
        of_model, own = self._split(theta)
        return self.at_flanges(own, self._flanges(of_model, q_rad))

    def jacobian(self, theta: Floats, q_rad: Floats) -> Floats:
        """(row, k, param) derivative by every parameter, free or not."""
        of_model, own = self._split(theta)
        flanges = self._flanges(of_model, q_rad)
        each = zip(self.by_flanges(own, flanges), self._each(q_rad), strict=True)
        first, *others = [by @ self.model.twists(of_model, q) for by, q in each]
        return np.concatenate([sum(others, start=first), self.by_own(own, flanges)], axis=-1)

    def by_joint(self, theta: Floats, q_rad: Floats) -> Floats:
        """(row, k, reading) derivative by the readings."""
        of_model, own = self._split(theta)
        each = zip(self.by_flanges(own, self._flanges(of_model, q_rad)), self._each(q_rad), strict=True)
        return np.concatenate([by @ self.model.joint_twists(of_model, q) for by, q in each], axis=-1)

    def readings_for(
        self, theta: Floats, q_rad: Floats, wanted: Floats, singular: float, steps: int, step_rad: float = np.inf
    ) -> Floats:
        """(row, reading) near `q_rad`, at which what is expected is `wanted` (row, k): Newton's steps of least length.

        Directions slower than `singular` of the quickest are not used; no reading turns further than `step_rad` a step.
        """
        for _ in range(steps):
            with np.errstate(all="ignore"):  # a beam along a face: its row stays where it is
                left = np.nan_to_num(wanted - self.expect(theta, q_rad), posinf=0.0, neginf=0.0)
                J = np.nan_to_num(self.by_joint(theta, q_rad), posinf=0.0, neginf=0.0)
            step = np.einsum("nji,ni->nj", np.linalg.pinv(J, rcond=singular), left)
            longest = np.max(np.abs(step), axis=1, keepdims=True)
            q_rad = q_rad + step * np.minimum(1.0, step_rad / np.maximum(longest, 1e-12))
        return q_rad

    def select(self, rows: NDArray[np.intp]) -> Self:
        """The same at some of the rows."""
        return replace(self, sensor=self.sensor.select(rows))

    def placed(self, about: About) -> Self:
        """The same with frames and points where a model's corrections start from."""
        return replace(self, sensor=self.sensor.placed(about))

    def facing(self, expected: Floats) -> Self:
        """The same where what was observed is what is expected (row, k)."""
        return replace(self, sensor=self.sensor.facing(expected))

    def _split(self, theta: Floats) -> tuple[Floats, Floats]:
        n = len(self.model.parameters)
        return theta[:n], theta[n:]

    def _each(self, q_rad: Floats) -> list[Floats]:
        return np.split(q_rad, self.poses, axis=1)

    def _flanges(self, of_model: Floats, q_rad: Floats) -> tuple[Floats, ...]:
        return tuple(self.model.flange(of_model, q) for q in self._each(q_rad))
