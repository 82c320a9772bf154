"""The verbs and records that every instrument has.

A driver is three things in three files: codec (bytes to values, no I/O), transport (bytes in and out),
device (verbs and SI units). Everything above the wire sees only what stands here.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Channel:
    """One declared quantity of a device."""

    name: str  # "actual_q_rad": the unit is the suffix
    unit: str  # "rad"
    shape: tuple[int, ...] = ()  # () scalar, (6,) six joints
    full_scale: float = math.inf  # |value| beyond this is saturated
    resolution: float = 0.0  # one count, in `unit`


@dataclass(frozen=True)
class Block:
    """Consecutive samples of one device, in the order measured.

    A step of `sequence` by more than one is a gap: samples were lost on the way, and it stays visible.
    """

    host_s: Floats  # (sample,) host clock when the bytes arrived
    device_s: Floats  # (sample,) the device's own clock
    sequence: NDArray[np.int64]  # (sample,) counts up by one
    values: Mapping[str, NDArray[Any]]  # channel name -> (sample, *shape), SI


class Device(Protocol):
    """An instrument that streams. Raises DeviceLost, DeviceStale, DeviceRefused, WireError; nothing waits for ever."""

    name: str

    def connect(self) -> None: ...

    def describe(self) -> tuple[Channel, ...]: ...

    def read(self, timeout_s: float) -> Block:
        """All samples since the last read, at least one; DeviceStale when none came within `timeout_s` of host time."""
        ...

    def close(self) -> None:
        """Release the port; safe in every state and more than once."""
        ...


class Movable(Protocol):
    """An arm that can be told where to go; `stop` and `hold` work in every state, also from another thread."""

    name: str

    def connect(self) -> None: ...

    def move_joints(self, q_rad: Floats, speed_rad_s: float, acceleration_rad_s2: float) -> None:
        """Blocks until the controller says the motion has ended. DeviceRefused on a stop, DeviceLost, DeviceStale."""
        ...

    def stop(self, deceleration_rad_s2: float = ...) -> None:
        """Brakes; a move that was sent before the stop, even if it has not begun yet, ends with DeviceRefused.

        A controller whose program knows only one way to brake takes that, whatever deceleration is asked for.
        """
        ...

    def hold(self) -> None:
        """As `stop`, and every later motion is refused until `connect`: for who stops without owning the motion."""
        ...

    def close(self) -> None: ...
