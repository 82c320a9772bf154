"""The places where a mechanism may take hold of the chain, in order of the signal. It does so by having the method."""

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from simulators.defects.scene import Light, Load, Scene

Floats = NDArray[np.float64]


@runtime_checkable
class ReadsAngle(Protocol):
    """Between the turning shaft and the number that its encoder gives."""

    def reading_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        """Reading less true angle, (row, n), for shafts that truly stand at `shaft_rad` (row, n)."""
        ...


@runtime_checkable
class TurnsJoint(Protocol):
    """Between the shaft that is read and the joint's output."""

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        """Output less shaft, (row, n)."""
        ...


@runtime_checkable
class MovesLink(Protocol):
    """Between a joint's output and the start of the next joint."""

    @property
    def links(self) -> tuple[int, ...]:
        """Links that move; link i follows joint i, link 0 stands before joint 1."""
        ...

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        """Motion (row, 4, 4) in the frame that turns with joint `link`, applied to the link's end at `end_m` (3,)."""
        ...


@runtime_checkable
class MovesBase(Protocol):
    """Under the arm."""

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        """Motion (row, 4, 4) of the arm's foot in the base frame."""
        ...


@runtime_checkable
class MovesTool(Protocol):
    """Between flange and laser or target."""

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        """Motion (row, 4, 4) of the tool in the flange frame."""
        ...


@runtime_checkable
class MovesFixture(Protocol):
    """Under the dual-PSD fixture."""

    def fixture_motion(self, scene: Scene) -> Floats:
        """Motion (row, 4, 4) of the fixture in its own frame."""
        ...


@runtime_checkable
class MovesDevice(Protocol):
    """Under the tracker or the wire drum."""

    def device_motion(self, scene: Scene) -> Floats:
        """Motion (row, 4, 4) of the device in its own frame."""
        ...


@runtime_checkable
class MovesSeat(Protocol):
    """Under a cone."""

    def seat_shift_m(self, scene: Scene) -> Floats:
        """(row, 3) in the base frame."""
        ...


@runtime_checkable
class DistortsSpots(Protocol):
    """Between light and what a PSD says."""

    def seen_spots_m(self, spot_m: Floats, light: Light, scene: Scene) -> Floats:
        """Spots (row, 2, 2) as given when they are truly at `spot_m`."""
        ...


@runtime_checkable
class ChangesSums(Protocol):
    """Light beside the laser's."""

    def seen_sum_v(self, sum_v: Floats, scene: Scene) -> Floats:
        """Sum signals (row, 2) as given."""
        ...


@runtime_checkable
class DistortsPosition(Protocol):
    """Between a target and what a tracker says."""

    def seen_position_m(self, position_m: Floats, scene: Scene) -> Floats:
        """(row, 3) in the device's frame."""
        ...


@runtime_checkable
class DistortsLength(Protocol):
    """Between a wire and what its drum says."""

    def seen_length_m(self, length_m: Floats, scene: Scene) -> Floats:
        """(row,)."""
        ...
