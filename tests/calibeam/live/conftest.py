"""A clock that jumps, blocks with chosen contents, and a rig that lives in this process."""

import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from benchmarks.live_feed import LivingRig
from calibeam.live.health import Latest
from calibeam.live.page import PageAddress
from drivers.device import Block


@dataclass
class JumpingClock:
    time_s: float = 100.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_s(self, seconds: float) -> None:
        self.time_s += seconds


@pytest.fixture
def clock() -> JumpingClock:
    return JumpingClock()


@pytest.fixture
def own_address() -> PageAddress:
    """Any port of a loopback address that no other process uses: one that was freed can be had again."""
    high, low = divmod(os.getpid() % 0x10000, 0x100)
    return PageAddress(f"127.77.{high}.{low}", 0)


@pytest.fixture
def latest(clock) -> Latest:
    return Latest(clock)


@pytest.fixture
def living(rig, latest, clock) -> LivingRig:
    """The shipped rig, its light on both faces of place 1; `send` makes it tell one block of each device."""
    return LivingRig(rig, latest, clock)


@pytest.fixture
def block(clock) -> Callable[..., Block]:
    """Of these sequence numbers, at 100 Hz of the device's clock."""

    def made(*numbers: int) -> Block:
        sequence = np.array(numbers)
        return Block(np.full(len(numbers), clock.now_s()), sequence / 100.0, sequence, {})

    return made
