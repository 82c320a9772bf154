"""What servo and session see of the devices, whether wires or a world in this process lie below: move, look, stop."""

from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Spot:
    """Light on one face, averaged over a dwell. Positions are NaN when the face is dark."""

    x_m: float
    y_m: float
    sum_v: float
    sigma_x_m: float  # of the mean
    sigma_y_m: float
    lit: bool
    saturated: bool = False


@dataclass(frozen=True)
class ArmReading:
    """One settled reading of everything beside the instrument, averaged over the same dwell."""

    host_s: float
    t_s: float  # since the start of the session, by the instrument's clock
    q_rad: Floats  # (joint,) as the controller reports
    qd_rad_s: Floats  # (joint,)
    cmd_rad: Floats  # (joint,) as commanded
    encoder_rad: Floats | None  # (joint,) link-side encoders
    temperatures_degC: dict[str, float]
    settled: bool


@dataclass(frozen=True)
class Look(ArmReading):
    """A reading of the beam on two faces."""

    psd1: Spot
    psd2: Spot
    window_s: tuple[float, float] | None = None  # first and last PSD sample in it, by the box's clock
    settle_s: float | None = None  # from the moment of looking until the readings had settled; None: not known

    def spots_m(self) -> Floats:
        """psd1 x, y, psd2 x, y (4,), NaN where dark."""
        return np.array([self.psd1.x_m, self.psd1.y_m, self.psd2.x_m, self.psd2.y_m])

    def lit(self, first: int) -> tuple[bool, bool]:
        """Whether the first and the second face have light, in the order in which the beam strikes them."""
        pair = (self.psd1.lit, self.psd2.lit)
        return pair if first == 1 else (pair[1], pair[0])


Read = TypeVar("Read", bound=ArmReading, covariant=True)


class ReadingBench(Protocol[Read]):
    """The devices, as few verbs. Raises DeviceError; every call ends."""

    def move(self, q_rad: Floats) -> None:
        """Go there and stand still."""
        ...

    def look(self, dwell_s: float) -> Read:
        """Wait until the readings have settled, then average `dwell_s` of device time."""
        ...

    def stop(self) -> None:
        """Stop the arm, from any thread and in any state."""
        ...


class Bench(ReadingBench[Look], Protocol):
    """The devices of a beam on two faces."""

    def place_fixture(self, placement: int) -> None:
        """Have the fixture stand at this place: asks the operator, or the emulated world."""
        ...
