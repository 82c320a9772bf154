"""The verbs and records that every instrument has.

A driver is three things in three files: codec (bytes to values, no I/O), transport (bytes in and out),
device (verbs and SI units). Everything above the wire sees only what stands here.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, Literal, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, SystemClock
from drivers.errors import DeviceLost

Floats = NDArray[np.float64]
LineT = TypeVar("LineT")
Stamps = Literal["sampled", "sent", "arrived", "hardware", "unknown"]  # what device_s is the time of


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
    device_s: Floats  # (sample,) the device's own clock, or what `stamps` of the device states
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


def stamps_of(device: object) -> Stamps:
    """What the device's stamps are; a driver that does not state it leaves them unknown."""
    return getattr(device, "stamps", "unknown")


class StreamDevice(ABC, Generic[LineT]):
    """What every `Device` with a line of its own does alike: open, set up or close again, know whether it is open.

    One thread uses it at a time, except `close`, which any thread may call. A device adds `describe` and `read`.
    """

    stamps: Stamps = "unknown"  # a driver states it: its reading, its sending, its arrival here, or at an adapter

    def __init__(self, name: str, clock: Clock | None) -> None:
        self.name = name
        self._clock: Clock = SystemClock() if clock is None else clock
        self._line: LineT | None = None

    @property
    def place(self) -> str:
        """The device and where it is, for messages."""
        return self.name

    @abstractmethod
    def _open(self) -> LineT:
        """The line, opened. DeviceLost when there is none."""

    @abstractmethod
    def _set_up(self, line: LineT) -> None:
        """From an open line to a stream: who is there, how it is to send. Whatever it raises closes the line."""

    @abstractmethod
    def _release(self, line: LineT) -> None:
        """End the stream as far as the line still carries it, and free the line. Raises nothing for a dead line."""

    def connect(self) -> None:
        """Open the line and begin the stream, again if it was open. DeviceLost, DeviceStale, DeviceRefused."""
        self.close()
        line = self._line = self._open()
        try:
            self._set_up(line)
        except BaseException:
            self.close()
            raise
        if self._line is not line:  # another thread closed it meanwhile; what was opened since must not stay open
            self._release(line)
            raise DeviceLost(f"{self.place}: closed while it was being connected; call connect() again")

    def close(self) -> None:
        """Release the line; safe in every state and more than once."""
        line, self._line = self._line, None
        if line is not None:
            self._release(line)

    def _opened(self) -> LineT:
        line = self._line
        if line is None:
            raise DeviceLost(f"{self.place}: not connected; call connect() first")
        return line

    def _left_s(self, deadline_s: float) -> float:
        """Host time until a deadline; not above 0 once it has passed."""
        return deadline_s - self._clock.now_s()


class Movable(Protocol):
    """An arm that can be sent somewhere; `stop` and `hold` work in every state, also from another thread."""

    name: str

    def connect(self) -> None: ...

    def move_joints(self, q_rad: Floats, speed_rad_s: float, acceleration_rad_s2: float) -> None:
        """Blocks until the controller reports its end. DeviceRefused on a stop, DeviceLost, DeviceStale."""
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
