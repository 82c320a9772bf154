"""Every emulated line fed with mutated requests: no exception, nothing that grows, and the next request is answered.

Good requests are written out as bytes, or built here by the protocol's own document.
"""

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from acquisition.recording.rig import plain_rig, rig_text
from simulators.devices import build_devices
from simulators.host.side_channel import SideChannelWire
from simulators.wire import TICK_S, SerialPort
from tests.mutated import mutated

RIGS = Path(__file__).parents[2] / "rigs"
MOST_KEPT = 1 << 21  # bytes of a line: an uploaded program of 1 MiB is the longest that any protocol here has
NODES = 6


class World:
    """Stands still wherever it is told to be."""

    n_joints = NODES
    psd_temperature_degC = 24.5

    def __init__(self) -> None:
        self.time_s = 0.0

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def psd_rate(self, rate_hz: float) -> None:
        """No noise here."""

    def photocurrents_a(self, times_s: Sequence[float]) -> np.ndarray:
        return np.full((len(times_s), 8), 2e-5)

    def target_position_m(self) -> np.ndarray:
        return np.array([2.0, -0.3, 0.8])

    def link_encoders_rad(self) -> np.ndarray:
        return np.linspace(0.0, 1.0, NODES)

    def command(self, q_rad: np.ndarray) -> None:
        assert np.isfinite(q_rad).all()

    def joints(self) -> Any:
        return SimpleNamespace(
            q_rad=np.zeros(NODES), qd_rad_s=np.zeros(NODES), torque_nm=np.zeros(NODES), temperature_degC=np.ones(NODES)
        )


def rtde(kind: str, payload: bytes = b"") -> bytes:
    return struct.pack(">HB", 3 + len(payload), ord(kind)) + payload


def crc16(data: bytes) -> bytes:
    """Modbus over Serial Line V1.02, section 6.2.2."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return struct.pack("<H", crc)


READ, WRITE = bytes.fromhex("03 0000 000c"), bytes.fromhex("10 00c8 0002 04 3f80 0000")
JSON = [{"do": "echo", "with": {"text": "x"}}, {"do": "fault.list"}]


@dataclass(frozen=True)
class Case:
    """A port of a rig and what clients say there; the last of `requests` is always answered."""

    rig: str
    port: str
    requests: tuple[bytes, ...]
    devices: dict[str, dict[str, Any]] | None = None  # keys put in the place of the rig's own


CASES = {
    "psd-daq": Case(
        "ur5e-dual-psd.toml",
        "psd",
        tuple(map(bytes.fromhex, ("070102e8036c3500", "0501035d1e00", "050104ba6e00", "0501011f3e00"))),
    ),
    "kpa101": Case(
        "ur5e-dual-kpa101.toml",
        "psd1",
        tuple(map(bytes.fromhex, ("110000005001", "70080400d0010700 0100", "710803005001", "050000005001"))),
    ),
    "slcan": Case(
        "ur5e-dual-psd.toml",
        "can",
        (b"C\rS8\rO\r", b"t60184004600000000000\r", b"t0800\r", b"T1ABCDEF081122334455667788\r", b"r2810\r", b"V\r"),
    ),
    "rtde": Case(
        "ur5e-dual-psd.toml",
        "rtde",
        (
            rtde("V", b"\0\2"),
            rtde("O", struct.pack(">d", 125.0) + b"timestamp,actual_q,"),
            rtde("I", b"input_int_register_24,speed_slider_mask"),
            rtde("S"),
            rtde("U", b"\1" + bytes(8)),
            rtde("v"),
        ),
    ),
    "dashboard": Case("ur5e-dual-psd.toml", "dashboard", (b"power on\n", b"popup hello\n", b"robotmode\n")),
    "script": Case(
        "ur5e-dual-psd.toml",
        "script-30003",
        (
            b"movej([0,-1,1,-1,-1,0], a=1.0, v=0.5)\n",
            b"def p():\n  movel(p[0.3,0.1,0.4,0,3,0], 1.2, 0.25)\nend\n",
            b"stopj(2.0)\n",
        ),
    ),
    "modbus-tcp": Case(
        "irb120-modbus.toml",
        "modbus",
        tuple(struct.pack(">HHHB", 7, 0, len(pdu) + 1, 1) + pdu for pdu in (WRITE, b"\x2b\x0e\x01\x00", READ)),
    ),
    "modbus-rtu": Case(
        "irb120-modbus.toml",
        "modbus",
        tuple(frame + crc16(frame) for frame in (b"\x01" + WRITE, b"\x01\x06\x00\xc8\x00\x01", b"\x01" + READ)),
        {"robot": {"host": None, "port": None, "serial_port": "out/emulated/robot"}},
    ),
    "tracker": Case(
        "ur5e-tracker.toml",
        "tracker",
        (b"START\r\n", b"HALT\r", b"MEASURE\n"),
        {"tracker": {"start": "START", "stop": "HALT", "trigger": "MEASURE"}},
    ),
    "side-channel": Case("ur5e-dual-psd.toml", "control", tuple(json.dumps(each).encode() + b"\n" for each in JSON)),
}
PATIENCE = 12  # requests of 6 bytes that a KPA101 may take for the 64 data bytes of a damaged header
SILENT = ("script",)  # a script port answers nothing, only its state


class Line:
    """One port of an emulated device, in emulated time; a client that was dropped comes again."""

    def __init__(self, case: Case) -> None:
        rig = plain_rig(rig_text(RIGS / case.rig), case.rig)
        for device, keys in (case.devices or {}).items():
            merged = {**rig["devices"][device], **keys}
            rig["devices"][device] = {key: value for key, value in merged.items() if value is not None}
        self.world = World()
        devices = build_devices(self.world, rig, "127.0.0.2")
        self.instruments = [instrument for bench in devices.benches for instrument in bench.instruments]
        ports = {port.name: port for bench in devices.benches for port in bench.ports}
        self._verbs = {"echo": lambda text: text, "fault.list": list}
        self._port = ports.get(case.port)
        self.wire = self._accepted()

    def say(self, data: bytes) -> bytes:
        """What comes back within two ticks."""
        if getattr(self.wire, "closing", False):
            self.come_again()
        out = self.wire.handle(data) if data else b""
        for _ in range(2):
            t_s = self.world.time_s
            for instrument in self.instruments:
                instrument.before_step(t_s)
            self.world.advance(t_s + TICK_S)
            for instrument in self.instruments:
                instrument.after_step(t_s)
            out += self.wire.due()
        return out

    def come_again(self) -> None:
        """A new client of a socket; on a serial line, a pause longer than any half request waits for its rest."""
        if isinstance(self._port, SerialPort):
            for _ in range(20):
                self.say(b"")
            return
        getattr(self._port, "closed", lambda wire: None)(self.wire)
        self.wire = self._accepted()

    @property
    def kept(self) -> int:
        """Bytes that the wire, and what it reads with, hold of the stream."""
        held, seen = 0, [getattr(self.wire, "inner", self.wire)]
        for part in seen:
            for value in vars(part).values():
                if isinstance(value, bytes | bytearray | str):
                    held += len(value)
                elif type(value).__name__.endswith("Reader"):
                    seen.append(value)
        return held

    def _accepted(self) -> Any:
        if self._port is None:
            return SideChannelWire(self._verbs)
        return self._port.wire if isinstance(self._port, SerialPort) else self._port.accept()


def under_fire(name: str, count: int, seed: int) -> None:
    case, rng = CASES[name], np.random.default_rng(seed)
    line = Line(case)
    for number in range(count):
        data = mutated(rng, case.requests)
        cut = int(rng.integers(0, len(data) + 1))
        line.say(data[:cut])
        line.say(data[cut:])
        assert line.kept <= MOST_KEPT, data.hex()
        if number % 100 == 99:
            line.come_again()
            assert name in SILENT or any(line.say(case.requests[-1]) for _ in range(PATIENCE)), data.hex()


@pytest.mark.parametrize("name", CASES)
def test_mutated_requests_raise_nothing_and_fill_no_memory(name: str) -> None:
    under_fire(name, 200, seed=21)


@pytest.mark.endure
@pytest.mark.parametrize("name", CASES)
def test_twenty_thousand_mutated_requests(name: str) -> None:
    under_fire(name, 20_000, seed=22)
