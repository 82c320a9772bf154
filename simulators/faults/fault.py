"""One injected fault: of which kind, how often it strikes, and for how long it lasts."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from simulators.faults.device_clock import DeviceClock
from simulators.faults.light import DisturbedLight

MOST_JUNK_BYTES = 65536


class FaultError(Exception):
    """A fault that cannot be injected; the message says what there is instead."""


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

    @property
    def data(self) -> bytes:
        return b"".join(part for _, part in self.parts)

    def replace(self, data: bytes) -> None:
        """The whole output becomes `data`, held back as its first part was."""
        self.parts = [(self.parts[0][0] if self.parts else 0, data)]
