"""Puts the faults on the lines of a bench, and gives the side channel its verbs for them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from simulators.faults.fault import FaultError, Target
from simulators.faults.faulty_wire import FaultyWire
from simulators.faults.injector import Injector
from simulators.faults.light import DisturbedLight
from simulators.wire import Bench, SerialPort, TcpPort, Wire


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


def _faulty(port: SerialPort | TcpPort, injector: Injector) -> SerialPort | TcpPort:
    if isinstance(port, SerialPort):
        return replace(port, wire=FaultyWire(port.wire, injector, port.name))

    def accept() -> Wire:
        return FaultyWire(port.accept(), injector, port.name)

    def closed(wire: Wire) -> None:
        port.closed(wire.inner if isinstance(wire, FaultyWire) else wire)

    return replace(port, accept=accept, closed=closed)
