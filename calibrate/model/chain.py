"""From joint readings to expected observations, with derivatives: any arm and any instrument by one chain rule.

An arm (`KinematicModel`) gives flange poses; an instrument (`Sensor`) gives what it would read at them; an
`ObservationModel` joins both, with one pose a row (`SensorChain`) or several.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Protocol, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.model.parameters import Parameter

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
About = Mapping[str, tuple[float, ...]]  # frames and points that corrections are about; names as in model.json


class KinematicModel(Protocol):
    """A new model is one file and one line in arms/catalogue.py; tests/model/arms checks all of them by law."""

    @property
    def n_joints(self) -> int: ...

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    def flange(self, theta: Floats, q_rad: Floats) -> Floats:
        """T_base_flange, (pose, 4, 4), for q_rad (pose, joint) and parameter values theta (param,)."""
        ...

    def twists(self, theta: Floats, q_rad: Floats) -> Floats:
        """Derivative of the flange by each parameter as a base-frame twist [v; w], (pose, 6, param)."""
        ...

    def joint_twists(self, theta: Floats, q_rad: Floats) -> Floats:
        """Derivative by each joint angle as a base-frame twist, (pose, 6, joint)."""
        ...


@dataclass(frozen=True, eq=False)
class Standing:
    """How the instrument stood at each of its rows, for causes that depend on it; None: it has no such thing."""

    incidence_rad: Floats | None = None  # (row, 2) of the beam on PSD 1, 2
    lean: Floats | None = None  # (row, 2, 2) x, y that the arriving beam travels along face 1, 2 per depth
    first_psd: Ints | None = None  # (row,)
    place: Ints | None = None  # (row,) placement or seat


class Usage:
    """What may be asked of any sensor beyond its readings; a sensor overrides what applies to it."""

    def about(self) -> About:
        """Frames and points that its corrections start from."""
        return {}

    def placed(self, about: About) -> Self:
        """The same with its frames and points where a model's corrections start from."""
        return self

    def standing(self, phi: Floats, T_base_flange: Floats) -> Standing:
        """For parameter values phi (param,) and flange poses (row, 4, 4)."""
        return Standing()

    def spot(self) -> Ints | None:
        """(row,) rows with one number were taken at one place, in the same way; None: nothing has to be met."""
        return None

    def aims(self, k: int, rng: Generator) -> Floats:
        """(row, k) readings to bring new poses like its rows to, where something has to be met."""
        return np.zeros((0 if (at := self.spot()) is None else len(at), k))

    def met(self, phi: Floats, T_base_flange: Floats) -> NDArray[np.bool_]:
        """(row,) whether these poses can be read."""
        return np.ones(len(T_base_flange), dtype=bool)

    def facing(self, expected: Floats) -> Self:
        """The same where what was observed is what is expected (row, k): for poses that nobody has measured."""
        return self

    def own_columns(self) -> tuple[str, ...]:
        """Columns of the samples with its observations, where they depend on the arm; (): those of its kind."""
        return ()

    def joints_compared(self) -> tuple[int, ...]:
        """Joints, from 1, of which it reads two encoders against each other, one reading each."""
        return ()

    def beam(self, phi: Floats, T_base_flange: Floats) -> tuple[Floats, Floats] | None:
        """Origin (row, 3) m and direction (row, 3) of its laser in the base; None without a laser on the flange."""
        return None


class Used(Protocol):
    """`Usage` as a protocol: how a sensor was used at the rows of a data set. Values are observed in `unit`."""

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    @property
    def unit(self) -> str: ...

    def select(self, rows: NDArray[np.intp]) -> Self:
        """The same instrument at some of the rows."""
        ...

    def about(self) -> About: ...
    def placed(self, about: About) -> Self: ...
    def standing(self, phi: Floats, T_base_flange: Floats) -> Standing: ...
    def spot(self) -> Ints | None: ...
    def aims(self, k: int, rng: Generator) -> Floats: ...
    def met(self, phi: Floats, T_base_flange: Floats) -> NDArray[np.bool_]: ...
    def facing(self, expected: Floats) -> Self: ...
    def own_columns(self) -> tuple[str, ...]: ...
    def joints_compared(self) -> tuple[int, ...]: ...
    def beam(self, phi: Floats, T_base_flange: Floats) -> tuple[Floats, Floats] | None: ...


class Sensor(Used, Protocol):
    """An instrument together with how it was used at each pose of a data set (place, order, seat, ...).

    A new instrument is one file with its entry (kind.py), and one line in catalogue.py. k values at a pose.
    """

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        """(pose, k) readings for flange poses (pose, 4, 4) and parameter values phi (param,)."""
        ...

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        """(pose, k, 6) derivative by a base-frame twist [v; w] of the flange."""
        ...

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        """(pose, k, param) derivative by the sensor's own parameters."""
        ...


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


@dataclass(frozen=True)
class SensorChain(ObservationModel):
    """ObservationModel of single poses."""

    sensor: Sensor

    poses = 1

    def at_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        return self.sensor.expect(own, *flanges)

    def by_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> tuple[Floats, ...]:
        return (self.sensor.by_twist(own, *flanges),)

    def by_own(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        return self.sensor.by_parameter(own, *flanges)
