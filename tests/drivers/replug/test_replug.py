"""Plugs pulled at random byte positions and put back under another name: found again by serial number, gap recorded.

Five times each on every day; a hundred times each, and within a second, by `make endure`.
"""

import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from acquisition.wires.attaching import Reopening
from drivers.cia406.device import Cia406Encoders
from drivers.clock import SystemClock
from drivers.device import Device
from drivers.psd_daq.device import BAUD, PsdDaq
from drivers.psd_faces import FaceKind
from drivers.psd_kpa101.pair import BAUD as KPA101_BAUD
from drivers.psd_kpa101.pair import Head, Kpa101Pair
from drivers.transports.can_bus import bus_opener
from drivers.transports.serial_port import SerialAddress, open_serial
from simulators.encoders.emulator import build as build_encoders
from simulators.kpa101.emulator import build as build_kpa101
from simulators.psd_daq.emulator import build as build_daq

READ_S = 2.0
BACK_S = 1.0


class World:
    """Light and shafts that stand still."""

    psd_temperature_degC = 24.5

    def __init__(self) -> None:
        self.time_s = 0.0

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def psd_rate(self, rate_hz: float) -> None:
        """No noise here."""

    def photocurrents_a(self, times_s: np.ndarray) -> np.ndarray:
        return np.tile(np.full(8, 2e-5), (len(times_s), 1))

    def link_encoders_rad(self) -> np.ndarray:
        return np.linspace(0.0, 3.0, 6)


@dataclass
class Case:
    device: Callable[[Any], Device]
    build: Callable[[World], object]
    serial_numbers: tuple[str, ...]
    most_bytes: int  # until the next cut


def daq(bench) -> Device:
    return PsdDaq(lambda: open_serial(SerialAddress(serial_number="CB-0001"), BAUD, bench.ports), 1000.0)


def pair(bench) -> Device:
    one, two = (
        lambda number=number: open_serial(SerialAddress(serial_number=number), KPA101_BAUD, bench.ports)
        for number in ("69250001", "69250002")
    )
    head = Head(FaceKind.PIN_CUSHION, 0.01)
    return Kpa101Pair((one, two), (head, head), 100.0)


def encoders(bench) -> Device:
    open_bus = bus_opener("slcan", "", 1_000_000, serial_number="CAN1", ports=bench.ports)
    return Cia406Encoders(open_bus, [1, 2, 3, 4, 5, 6], 100.0)


RIG = {
    "fixture": {"half_size_m": 0.01},
    "devices": {"psd": {}, "encoders": {"nodes": [1, 2, 3, 4, 5, 6], "bitrate": 1_000_000}},
}
CASES = {
    "psd-daq": Case(daq, lambda world: build_daq(world, RIG), ("CB-0001",), 4000),
    "kpa101": Case(pair, lambda world: build_kpa101(world, RIG), ("69250001", "69250002"), 600),
    "can": Case(encoders, lambda world: build_encoders(world, RIG), ("CAN1",), 3000),
}


@pytest.fixture(params=CASES)
def case(request) -> Case:
    return CASES[request.param]


@pytest.fixture
def bench(case, on_plugs):
    world = World()
    return on_plugs(world, case.build(world), case.serial_numbers)


def terminals() -> int:
    """How many ends of terminals this process holds open; other tests' files may be closed at any moment."""
    count = 0
    for name in os.listdir("/proc/self/fd"):
        with suppress(OSError):  # the descriptor of this listing itself
            count += os.readlink(f"/proc/self/fd/{name}").startswith(("/dev/pts/", "/dev/ptmx"))
    return count


def pull_plugs(case: Case, bench, cycles: int, seed: int) -> list[float]:
    """Seconds from each plug being in again to the first sample behind the gap."""
    rng = np.random.default_rng(seed)
    lost: list[str] = []
    gaps: list[tuple[float, float]] = []
    device = Reopening(
        case.device(bench),
        SystemClock(),
        lambda why, host_s: lost.append(str(why)),
        lambda from_s, to_s: gaps.append((from_s, to_s)),
    )
    threads, before = set(threading.enumerate()), terminals()
    device.connect()
    last = device.read(READ_S)
    back_s: list[float] = []
    for cycle in range(cycles):
        plug = bench.plugs[int(rng.integers(len(bench.plugs)))]
        cuts, outages = plug.cuts, len(gaps)
        plug.cut_after = int(rng.integers(1, case.most_bytes))
        until_s = time.monotonic() + 30.0
        seen = False  # lost samples show in the numbers; rows of before the loss may come first
        while not (seen and len(gaps) > outages) and time.monotonic() < until_s:
            block = device.read(READ_S)
            steps = np.diff(np.concatenate([last.sequence[-1:], block.sequence]))
            assert (steps >= 1).all()
            seen = seen or (plug.cuts > cuts and bool((steps > 1).any()))
            last = block
        assert seen, cycle
        assert len(gaps) > outages, cycle
        back_s.append(time.monotonic() - plug.plugged_s)
    device.close()
    assert set(threading.enumerate()) <= threads
    assert terminals() == before
    assert len(lost) == len(gaps) >= cycles
    assert all(to_s > from_s for from_s, to_s in gaps)
    return back_s


def test_a_plug_that_is_pulled_is_found_again_by_its_number(case, bench):
    assert len(pull_plugs(case, bench, cycles=5, seed=1)) == 5


@pytest.mark.endure
def test_a_hundred_times(case, bench):
    back_s = pull_plugs(case, bench, cycles=100, seed=2)
    print(f"{case.serial_numbers}: back after {np.median(back_s):.3f} s median, {max(back_s):.3f} s at most")
    assert max(back_s) < BACK_S
