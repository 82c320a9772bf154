"""What is wrong with a motion or with the streams that tell of it. One mechanism a file, one line in `faults.FAULTS`.

A fault is a frozen record; it takes hold by having one or more of the methods below.
"""

from collections.abc import Mapping
from typing import ClassVar, Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from simulators.streams.course import Course

Floats = NDArray[np.float64]


class Fault(Protocol):
    """One hidden fault."""

    KIND: ClassVar[str]
    PHYSICS: ClassVar[str]  # as in docs/formats.md, findings in streams

    @property
    def port(self) -> str:
        """Where it sits, as there."""
        ...

    @property
    def drivers(self) -> tuple[str, ...]: ...

    @property
    def figures(self) -> Mapping[str, float]:
        """Its size in the words of a diagnosis."""
        ...

    @property
    def size(self) -> float:
        """Over the noise of one reading of the stream that shows it."""
        ...

    @classmethod
    def draw(cls, rng: np.random.Generator, n_joints: int) -> Self: ...


@runtime_checkable
class StampsLate(Protocol):
    """Between reading and stamp of a device."""

    def late_s(self, device: str) -> float: ...


@runtime_checkable
class ReadsEncoders(Protocol):
    """Between shafts and the second set of encoders."""

    def read_rad(self, course: Course, q_rad: Floats) -> Floats:
        """(step, n) as they are read, of what (step, n) they turn."""
        ...


@runtime_checkable
class MovesOutput(Protocol):
    """Between shafts and what the joints carry."""

    def left_rad(self, course: Course) -> Floats:
        """(step, n) that the outputs are behind the shafts."""
        ...


@runtime_checkable
class SwaysBase(Protocol):
    """Under the arm."""

    def sway_rad(self, course: Course) -> Floats:
        """(step, 3) rotation vector of the foot."""
        ...


@runtime_checkable
class HurriesReading(Protocol):
    """When the samples are taken."""

    def wait_s(self) -> float:
        """From a stop to the first reading."""
        ...
