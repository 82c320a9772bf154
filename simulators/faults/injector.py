"""The faults of one device: requested over the side channel, applied to its lines and its cycles.

Order on a line is kept: nothing overtakes what is held back. A wire may offer what only its protocol knows, by two
methods that are optional:

    damaged(output) -> bytes        the same output with a wrong checksum or length (otherwise: one bit turned)
    refusal(request) -> bytes|None  the error reply to these bytes; None: they are no request that could be refused

What it does not imitate: faults on the way to the device; requests always arrive, whole and at once.
"""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from simulators.faults.device_faults import (
    LINE_FAULTS,
    STATE_FAULTS,
    DisturbedLight,
    Fault,
    FaultError,
    Output,
    Setting,
    Target,
)
from simulators.wire import TICK_S, Bench, SerialPort, TcpPort, UdpPort, Wire

LINE_KINDS = {kind.name: kind for kind in LINE_FAULTS}
STATE_KINDS = {kind.name: kind for kind in STATE_FAULTS}
ERROR = "error"  # the device refuses, in the words of its protocol, and does not do what it was asked for
KINDS = (*LINE_KINDS, ERROR, *STATE_KINDS)


class Injector:
    """The faults of a device; an `Instrument` of simulators.wire, so that those with a duration see time pass."""

    def __init__(self, device: str, target: Target) -> None:
        self.name = f"faults of {device}"
        self.device = device
        self._target = target
        self._faults: list[Fault] = []
        self._now_s = 0.0

    @property
    def quiet(self) -> bool:
        """No fault is active."""
        return not self._faults

    # --- side channel

    def inject(self, kind: str, count: int | None, every: int, port: str | None, settings: Mapping[str, Any]) -> None:
        """FaultError for a kind or setting that there is not, and for a device that cannot have this fault."""
        if kind not in KINDS:
            raise FaultError(f"no fault {kind!r}; there are {', '.join(KINDS)}")
        if (count is not None and count < 1) or every < 1:
            raise FaultError(f"{kind}: count {count}, every {every}; give whole numbers from 1 on, or no count")
        known = {**LINE_KINDS, **STATE_KINDS}[kind].settings if kind != ERROR else {}
        fault = Fault(kind, _checked(kind, settings, known), count, every, port)
        if kind in STATE_KINDS:
            STATE_KINDS[kind].begin(self._target, fault, self._now_s)
        self._faults.append(fault)

    def clear(self) -> None:
        """Everything is well again."""
        for fault in self._faults:
            self._end(fault)
        self._faults.clear()

    def listed(self) -> list[dict[str, Any]]:
        return [
            {"device": self.device, "kind": fault.kind, "struck": fault.struck, "left": fault.left}
            for fault in self._faults
        ]

    # --- what is disturbed

    def refuse(self, request: bytes, refusal: Callable[[bytes], bytes | None], port: str) -> bytes | None:
        """The error reply to a request that must not reach the device; None when it shall."""
        for fault in self._faults:
            if fault.kind != ERROR or fault.port not in (None, port) or fault.spent:
                continue
            reply = refusal(request)
            if reply is not None and fault.turn():
                fault.strike()
                self._faults = [fault for fault in self._faults if not fault.spent]
                return reply
        return None

    def disturb(self, output: Output, port: str) -> None:
        """Lets every fault that is due have the output, in the order in which they were injected."""
        for fault in self._faults:
            kind = LINE_KINDS.get(fault.kind)
            if kind is None or fault.port not in (None, port) or not output.parts or not fault.turn():
                continue
            if kind.strike(output, fault, self._target):
                fault.strike()
        self._faults = [fault for fault in self._faults if not fault.spent]

    def before_step(self, t_s: float) -> None:
        """Faults that last: one cycle less."""
        self._now_s = t_s
        if not self._faults:
            return
        for fault in self._faults:
            if fault.kind in STATE_KINDS:
                fault.strike()
                if fault.spent:
                    self._end(fault)
        self._faults = [fault for fault in self._faults if not fault.spent]

    def after_step(self, t_s: float) -> None:
        """Nothing to do."""

    def _end(self, fault: Fault) -> None:
        if fault.kind in STATE_KINDS:
            STATE_KINDS[fault.kind].end(self._target, fault)


def _checked(kind: str, given: Mapping[str, Any], known: Mapping[str, Setting]) -> dict[str, float]:
    values = {name: setting.otherwise for name, setting in known.items()}
    for name, value in given.items():
        setting = known.get(name)
        if setting is None:
            raise FaultError(f"{kind}: no setting {name!r}; there are {', '.join(known) or 'none'}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not setting.least <= value <= setting.most:
            raise FaultError(f"{kind}: {name} = {value!r}; give a number from {setting.least:g} to {setting.most:g}")
        values[name] = float(value)
    return values


UNPLUGGED_S = 0.1  # for how long a disconnected serial device is away; a TCP client may come back at once


class FaultyWire:
    """Wraps one wire of a device; without faults it passes everything on as it is."""

    def __init__(self, wire: Wire, injector: Injector, port: str) -> None:
        self.inner = wire
        self._injector, self._port = injector, port
        self._tick = 0
        self._held: deque[tuple[int, bytes]] = deque()  # tick of its release, bytes
        self._before = b""
        self._away_until = -1  # tick; while it is not reached the line is cut

    @property
    def closing(self) -> bool:
        """The host drops the client, or pulls the serial plug, while this is true."""
        return self._tick < self._away_until or bool(getattr(self.inner, "closing", False))

    def handle(self, data: bytes) -> bytes:
        refused = self._injector.refuse(data, getattr(self.inner, "refusal", _no_reply), self._port)
        self._send(self.inner.handle(data) if refused is None else refused)
        return self._released()

    def due(self) -> bytes:
        self._tick += 1
        data = self.inner.due()
        if self._injector.quiet and not self._held:  # every tick of every line of a healthy device comes through here
            self._before = data or self._before
            return data
        self._send(data)
        return self._released()

    def _send(self, data: bytes) -> None:
        output = Output([(0, data)] if data else [], self._before, self._damaged, tick=self._tick)
        self._injector.disturb(output, self._port)
        self._before = output.data or self._before
        if output.hang_up:
            self._away_until = self._tick + round(UNPLUGGED_S / TICK_S)
            self._held.clear()
        earliest = self._held[-1][0] if self._held else 0
        for held, part in output.parts:
            earliest = max(earliest, self._tick + held)
            self._held.append((earliest, part))

    def _released(self) -> bytes:
        out = bytearray()
        while self._held and self._held[0][0] <= self._tick:
            out += self._held.popleft()[1]
        return bytes(out)

    def _damaged(self, data: bytes) -> bytes:
        known = getattr(self.inner, "damaged", None)
        return turn_a_bit(data) if known is None else known(data)


def turn_a_bit(data: bytes) -> bytes:
    """One bit of the byte in the middle turned, without making a zero, which some protocols delimit frames with."""
    at = len(data) // 2
    return data[:at] + bytes((data[at] ^ 0x10 or data[at] ^ 0x20,)) + data[at + 1 :]


def _no_reply(request: bytes) -> bytes | None:
    return None


def with_faults(device: str, bench: Bench, light: DisturbedLight | None = None) -> tuple[Bench, Injector]:
    """The same bench with every line under an injector of its own, which must run with the bench's instruments."""
    injector = Injector(device, Target(clock=bench.clock, light=light))
    ports = [_faulty(port, injector) for port in bench.ports]
    return replace(bench, instruments=[injector, *bench.instruments], ports=ports), injector


def fault_verbs(injectors: Mapping[str, Injector]) -> dict[str, Callable[..., Any]]:
    """Verbs "fault.inject", "fault.clear" and "fault.list", for devices by the names of the announcement."""

    def named(device: str) -> Injector:
        if device not in injectors:
            raise FaultError(f"no device {device!r}; there are {', '.join(injectors)}")
        return injectors[device]

    def inject(
        device: str, kind: str, count: int | None = None, every: int = 1, port: str | None = None, **settings: Any
    ) -> None:
        named(device).inject(kind, count, every, port, settings)

    def clear(device: str | None = None) -> None:
        for injector in [named(device)] if device is not None else injectors.values():
            injector.clear()

    def listed() -> list[dict[str, Any]]:
        return [fault for injector in injectors.values() for fault in injector.listed()]

    return {"fault.inject": inject, "fault.clear": clear, "fault.list": listed}


def _faulty(port: SerialPort | TcpPort | UdpPort, injector: Injector) -> SerialPort | TcpPort | UdpPort:
    if isinstance(port, SerialPort | UdpPort):
        return replace(port, wire=FaultyWire(port.wire, injector, port.name))

    def accept() -> Wire:
        return FaultyWire(port.accept(), injector, port.name)

    def closed(wire: Wire) -> None:
        port.closed(wire.inner if isinstance(wire, FaultyWire) else wire)

    return replace(port, accept=accept, closed=closed)
