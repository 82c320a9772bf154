"""Injected faults: of which kind, how often one strikes, for how long it lasts, and what it does.

Faults of a line change one output each and report whether they did; an output is what a device sends in one go: at
least one frame, reply or line of its protocol. `error` is in injector.py. Faults of a device last for a number of
cycles instead of striking outputs. Faults of the light make it too strong or take it away; everything else is the
world's.

What it does not imitate: a spot that leaves the face slowly, or one face alone.
"""

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from simulators.wire import TICK_S, DeviceClock

Floats = NDArray[np.float64]
BLINDING_GAIN = 1e4  # a lit face gives tens of microamperes, the converters of such boxes end below a milliampere


class LitWorld(Protocol):
    """What is wrapped."""

    def photocurrents_a(self, times_s: Sequence[float] | Floats) -> Floats: ...


class DisturbedLight:
    """A world as the PSD electronics see it. Several disturbances multiply; each is mended by itself."""

    def __init__(self, world: LitWorld) -> None:
        self._world = world
        self._gains: dict[Hashable, float] = {}  # whose -> of the laser's power

    def disturb(self, whose: Hashable, gain: float) -> None:
        """`gain` of the laser's power; 0 is a spot that has left both faces."""
        self._gains[whose] = gain

    def mend(self, whose: Hashable) -> None:
        """As if that one had not been."""
        self._gains.pop(whose, None)

    def photocurrents_a(self, times_s: Sequence[float] | Floats) -> Floats:
        """(sample, 8) A, as the world's `photocurrents_a`."""
        current_a = self._world.photocurrents_a(times_s)
        return math.prod(self._gains.values()) * current_a if self._gains else current_a

    def __getattr__(self, name: str) -> Any:
        return getattr(self._world, name)


MOST_JUNK_BYTES = 65536


class FaultError(Exception):
    """A fault that cannot be injected; the message states what there is instead."""


@dataclass(frozen=True)
class Setting:
    """A number that a kind of fault takes: its value when none is given, and the range that makes sense."""

    otherwise: float
    least: float
    most: float


@dataclass(eq=False)  # two of the same kind are two
class Fault:
    """An active fault. `left`: strikes until it clears itself, None for ever."""

    kind: str
    settings: Mapping[str, float]
    left: int | None = None
    every: int = 1
    port: str | None = None  # only this port of the device; None: all
    struck: int = 0
    seen: int = 0  # outputs that it could have struck

    @property
    def spent(self) -> bool:
        return self.left is not None and self.left <= 0

    def turn(self) -> bool:
        """Whether it strikes now; counts."""
        self.seen += 1
        return not self.spent and self.seen % self.every == 0

    def strike(self) -> None:
        self.struck += 1
        if self.left is not None:
            self.left -= 1


@dataclass(frozen=True)
class Target:
    """What trouble can be made for in a device beside its lines."""

    clock: DeviceClock | None = None
    light: DisturbedLight | None = None
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(1))


@dataclass
class Output:
    """What a device is about to send in one go, in the hands of the faults.

    `parts`: bytes with the ticks by which each is held back.
    """

    parts: list[tuple[int, bytes]]
    before: bytes  # what was sent the time before on this line
    damaged: Callable[[bytes], bytes]
    hang_up: bool = False
    tick: int = 0  # of the line, now

    @property
    def data(self) -> bytes:
        return b"".join(part for _, part in self.parts)

    def replace(self, data: bytes) -> None:
        """The whole output becomes `data`, held back as its first part was."""
        self.parts = [(self.parts[0][0] if self.parts else 0, data)]


@dataclass(frozen=True)
class StateFault:
    """A kind: how it begins and ends. FaultError from `begin` when the device has nothing that it could disturb."""

    name: str
    begin: Callable[[Target, Fault, float], None]
    end: Callable[[Target, Fault], None]
    settings: Mapping[str, Setting] = field(default_factory=dict[str, Setting])


def _clock_of(target: Target) -> DeviceClock:
    if target.clock is None:
        raise FaultError("clock: this device puts no time stamps into what it sends; choose another kind")
    return target.clock


def _light_of(target: Target) -> DisturbedLight:
    if target.light is None:
        raise FaultError("this device sees no light; inject it into psd")
    return target.light


def _disturb_clock(target: Target, fault: Fault, t_s: float) -> None:
    _clock_of(target).disturb(fault, fault.settings["step_s"], fault.settings["drift"], t_s)


def _mend_clock(target: Target, fault: Fault) -> None:
    _clock_of(target).mend(fault)


def _blind(target: Target, fault: Fault, t_s: float) -> None:
    _light_of(target).disturb(fault, BLINDING_GAIN)


def _spot_off(target: Target, fault: Fault, t_s: float) -> None:
    _light_of(target).disturb(fault, 0.0)


def _mend_light(target: Target, fault: Fault) -> None:
    _light_of(target).mend(fault)


STATE_FAULTS = (
    StateFault(
        "clock",
        _disturb_clock,
        _mend_clock,
        {"step_s": Setting(0.5, -1e6, 1e6), "drift": Setting(0.0, -0.5, 0.5)},
    ),
    StateFault("saturation", _blind, _mend_light),
    StateFault("spot-off", _spot_off, _mend_light),
)


Strike = Callable[[Output, Fault, Target], bool]


@dataclass(frozen=True)
class LineFault:
    """A kind. `strike` returns False when the output is none that it can spoil, and leaves it alone."""

    name: str
    strike: Strike
    settings: Mapping[str, Setting] = field(default_factory=dict[str, Setting])


def _delay(output: Output, fault: Fault, target: Target) -> bool:
    ticks = max(1, round(fault.settings["seconds"] / TICK_S))
    output.parts = [(held + ticks, part) for held, part in output.parts]
    return True


def _in_bursts(output: Output, fault: Fault, target: Target) -> bool:
    """Everything waits for the next whole multiple of the pause."""
    pause = max(1, round(fault.settings["seconds"] / TICK_S))
    output.parts = [(-output.tick % pause + held, part) for held, part in output.parts]
    return True


def _split(output: Output, fault: Fault, target: Target) -> bool:
    """The second part comes a while later."""
    data = output.data
    if len(data) < 2:
        return False
    held, at = output.parts[0][0], 1 + int(target.rng.integers(len(data) - 1))
    ticks = max(1, round(fault.settings["seconds"] / TICK_S))
    output.parts = [(held, data[:at]), (held + ticks, data[at:])]
    return True


def _junk(output: Output, fault: Fault, target: Target) -> bool:
    """Random bytes before the output."""
    output.replace(target.rng.bytes(int(fault.settings["bytes"])) + output.data)
    return True


def _checksum(output: Output, fault: Fault, target: Target) -> bool:
    output.replace(output.damaged(output.data))
    return True


def _nth_only(output: Output, fault: Fault, target: Target) -> bool:
    """Only every n-th output comes."""
    if fault.seen % int(fault.settings["n"]) != 0:
        output.parts = []
    return True


def _silence(output: Output, fault: Fault, target: Target) -> bool:
    output.parts = []
    return True


def _disconnect(output: Output, fault: Fault, target: Target) -> bool:
    output.parts, output.hang_up = [], True
    return True


def _stale(output: Output, fault: Fault, target: Target) -> bool:
    """What was sent before, once more, instead of something new."""
    if not output.before:
        return False
    output.replace(output.before)
    return True


def _duplicate(output: Output, fault: Fault, target: Target) -> bool:
    output.replace(2 * output.data)
    return True


LINE_FAULTS = (
    LineFault("delay", _delay, {"seconds": Setting(0.1, TICK_S, 60.0)}),
    LineFault("bursts", _in_bursts, {"seconds": Setting(0.3, TICK_S, 60.0)}),
    LineFault("split", _split, {"seconds": Setting(0.01, TICK_S, 60.0)}),
    LineFault("junk", _junk, {"bytes": Setting(16, 1, MOST_JUNK_BYTES)}),
    LineFault("checksum", _checksum),
    LineFault("nth-only", _nth_only, {"n": Setting(3, 2, 1e6)}),
    LineFault("silence", _silence),
    LineFault("disconnect", _disconnect),
    LineFault("stale", _stale),
    LineFault("duplicate", _duplicate),
)
