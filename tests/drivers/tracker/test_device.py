"""The tracker's driver against its emulator on real lines: TCP, UDP, serial; by stream, start and trigger."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest

from acquisition.recording.rig.devices import TrackerDevice
from calibeam.devices.instruments import tracker_driver
from drivers.clock import SystemClock
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale, WireError
from drivers.tracker.codec import LineRefusedError
from drivers.tracker.device import LineTracker
from drivers.transports.transport import UdpReceiver
from simulators.faults.injector import Injector, with_faults
from simulators.host.loop import Host
from simulators.tracker.emulator import build
from simulators.wire import TcpPort, UdpPort

HERE_M = np.array([2.1045, -0.31, 0.8127])
ASCII = {
    "driver": "ascii-lines",
    "length_unit": "mm",
    "columns": ["time", "x", "y", "z", "status"],
    "separator": ";",
    "good": ["0"],
    "host": "127.0.0.1",
    "port": 0,
    "rate_hz": 100.0,
}
JSON = {
    **{key: ASCII[key] for key in ("host", "port", "rate_hz")},
    "driver": "json-lines",
    "length_unit": "m",
    "time_unit": "ms",
    "members": {"x": "p.x", "y": "p.y", "z": "p.z", "time": "t", "status": "ok", "temperature": "air"},
    "good": ["true"],
}


class StandingWorld:
    """A target that stands."""

    time_s = 0.0
    truth = SimpleNamespace(seed=3)

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def target_position_m(self) -> np.ndarray:
        return HERE_M


class Site:
    """An emulated instrument, and a driver for it."""

    def __init__(self, tracker: LineTracker, verbs: Any, injector: Injector) -> None:
        self.tracker, self.verbs, self.injector = tracker, verbs, injector


@contextmanager
def running(device: dict[str, Any], read_by: dict[str, Any] | None = None) -> Iterator[Site]:
    """`read_by`: keys by which the driver differs from the instrument."""
    world = StandingWorld()
    bench = build(world, {"devices": {"tracker": device}, "emulation": {"position_noise_m": 15e-6}})
    faulty, injector = with_faults("tracker", bench)
    line, (port,) = None, faulty.ports
    if isinstance(port, UdpPort):  # whoever receives has the port first
        line = UdpReceiver("127.0.0.1", 0)
        faulty = replace(faulty, ports=[replace(port, port=line.port)])
    host = Host(faulty, world)
    stop = threading.Event()
    thread = threading.Thread(target=host.run, args=(stop.is_set,))
    thread.start()
    try:
        if isinstance(port, TcpPort):
            found = dict(zip(("host", "port"), host.tcp_address("tracker"), strict=True))
        else:
            found = {} if line is not None else {"serial_port": host.serial_address("tracker")}
        tracker = tracker_driver(msgspec.convert({**device, **(read_by or {}), **found}, TrackerDevice), SystemClock())
        if line is not None:
            tracker._open_line = lambda: line
        try:
            yield Site(tracker, bench.verbs, injector)
        finally:
            tracker.close()
    finally:
        stop.set()
        thread.join()
        host.close()


def read_on(tracker: LineTracker, timeout_s: float = 0.1) -> None:
    """Until it raises."""
    while True:
        tracker.read(timeout_s)


def some(tracker: LineTracker, least: int = 5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, device times and numbers of at least so many lines."""
    blocks = [tracker.read(2.0)]
    while sum(len(block.host_s) for block in blocks) < least:
        blocks.append(tracker.read(2.0))
    return (
        np.concatenate([block.values["position_m"] for block in blocks]),
        np.concatenate([block.device_s for block in blocks]),
        np.concatenate([block.sequence for block in blocks]),
    )


SERIAL = {**{key: value for key, value in ASCII.items() if key not in ("host", "port")}, "serial_port": None}


@pytest.mark.parametrize(
    "device",
    [
        ASCII,
        JSON,
        {**ASCII, "decimal": ",", "columns": ["x", "y", "z", "time", "-", "status"], "time_unit": "us"},
        {**ASCII, "start": "GO\r\n", "stop": "HALT\r\n"},
        {**ASCII, "trigger": "M\n"},
        {**JSON, "transport": "udp"},
        {**SERIAL, "separator": " ", "length_unit": "in"},
    ],
    ids=["ascii", "json", "comma", "start", "trigger", "udp", "serial"],
)
def test_positions_in_si_whatever_the_line_looks_like(device) -> None:
    with running(device) as site:
        site.tracker.connect()
        position_m, device_s, number = some(site.tracker)
        assert np.abs(position_m - HERE_M).max() < 1e-4  # 15 um of noise
        assert np.all(np.diff(number) == 1)
        period_s = np.diff(device_s)
        assert np.all(period_s > 0.0)
        assert np.median(period_s) == pytest.approx(0.01, rel=0.5)
        assert [channel.name for channel in site.tracker.describe()][:2] == ["position_m", "good"]


def test_a_hidden_target_is_no_position_and_comes_back() -> None:
    with running(ASCII) as site:
        site.tracker.connect()
        site.verbs["tracker.target"](on=False)
        while site.tracker.read(2.0).values["good"].all():
            pass
        block = site.tracker.read(2.0)
        assert np.isnan(block.values["position_m"]).all()
        site.verbs["tracker.target"](on=True)
        while not (block := site.tracker.read(2.0)).values["good"].all():
            pass
        assert np.isfinite(block.values["position_m"]).all()


def test_silence_is_stale_and_it_goes_on_afterwards() -> None:
    with running(ASCII) as site:
        site.tracker.connect()
        site.verbs["tracker.silence"]()
        with pytest.raises(DeviceStale, match=r"tracker: no line within 0.1 s at 127.0.0.1:\d+; check power"):
            read_on(site.tracker, 0.1)
        site.verbs["tracker.silence"](on=False)
        assert len(site.tracker.read(2.0).host_s) >= 1


def test_a_damaged_line_is_a_gap_and_damage_alone_an_error() -> None:
    with running(ASCII) as site:
        site.tracker.connect()
        site.injector.inject("junk", 2, 1, None, {"bytes": 64})
        _, _, number = some(site.tracker, 40)
        assert site.tracker.bad_lines >= 1
        assert np.diff(number).max() >= 2
    with running(ASCII) as site:
        site.tracker.connect()
        site.tracker._codec._parse = refuse
        with pytest.raises(WireError, match=r"lines that cannot be read.*4 columns.*compare \[devices.tracker\]"):
            read_on(site.tracker, 0.1)


def refuse(line: str) -> Any:
    raise LineRefusedError("4 columns, 9 are declared")


def test_another_instrument_or_another_unit_is_refused_at_once() -> None:
    others = {"columns": ["x", "y", "z"], "good": []}
    says = "does not print the declared lines: 5 columns, 3 are declared"
    with running(ASCII, others) as site, pytest.raises(DeviceRefused, match=says):
        site.tracker.connect()
    says = "beyond 200 m: is length_unit right"
    with running(ASCII, {"length_unit": "m"}) as site, pytest.raises(DeviceRefused, match=says):
        site.tracker.connect()


def test_a_dropped_connection_is_lost_and_connect_finds_it_again() -> None:
    with running(ASCII) as site:
        site.tracker.connect()
        site.injector.inject("disconnect", 1, 1, None, {})
        with pytest.raises(DeviceLost, match="the instrument closed the connection"):
            read_on(site.tracker, 1.0)
        site.tracker.connect()
        assert len(some(site.tracker)[0]) >= 5
        site.tracker.close()
        with pytest.raises(DeviceLost, match="not connected"):
            site.tracker.read(0.1)


def test_nobody_there_is_reported_with_the_address() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    nobody = msgspec.convert({**ASCII, "port": port}, TrackerDevice)
    with pytest.raises(DeviceLost, match=rf"tracker: 127.0.0.1:{port}: no connection .*output is switched on"):
        tracker_driver(nobody, SystemClock()).connect()


def test_rates_that_count_as_silence_are_refused() -> None:
    slow = msgspec.convert({**ASCII, "rate_hz": 1.0}, TrackerDevice)
    with pytest.raises(DeviceRefused, match="counts as silent"):
        tracker_driver(slow, SystemClock())


def test_datagrams_are_of_their_first_sender() -> None:
    receiver = UdpReceiver("127.0.0.1", 0)
    first, other = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
    with first, other:
        for sender, line in ((first, b"1\n"), (other, b"2\n"), (first, b"3\n")):
            sender.sendto(line, ("127.0.0.1", receiver.port))
        assert [receiver.read(100, 2.0) for _ in range(3)] == [b"1\n", b"", b"3\n"]
    receiver.close()


def test_datagrams_are_awaited_on_this_machine_alone_where_no_address_is_stated() -> None:
    device = {**ASCII, "transport": "udp", "host": None, "port": 0}
    line = tracker_driver(msgspec.convert(device, TrackerDevice), SystemClock())._open_line()
    assert isinstance(line, UdpReceiver)
    assert line._socket.getsockname()[0] == "127.0.0.1"
    line.close()
