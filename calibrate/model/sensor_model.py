"""The seam of instruments: flange poses to what the instrument would read, with analytic derivatives."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.model.parameters import Parameter

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
About = Mapping[str, tuple[float, ...]]  # frames and points that corrections are about; names as in model.json


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
