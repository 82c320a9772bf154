"""The process loop: one thread carries the bytes of a bench and advances its world, tick by tick.

Each turn waits for bytes until the next tick is due, serves them, and runs it, in the order that simulators/wire.py
gives. When the machine is late it runs up to CATCH_UP_TICKS and sends what became due in all of them at once: half of
a tick's cost is the system's, for waking every client. So it does with time scales at which ticks follow faster than
TURN_S. A client that is slow, gone or talks rubbish holds up nobody.

When the next tick is due: emulated time runs at a fixed rate of wall time, and never jumps.

A little lateness is caught up. A stall of more than STALL_S (the machine slept, or is too slow for the rate) is not:
emulated time lags from then on, so that no client sees a burst of time. Pure arithmetic: the caller reads the clock.
"""

import selectors
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Protocol

from simulators.host.line import Log, Report, check_link, log_to_stderr
from simulators.host.serial_line import SerialLine
from simulators.host.tcp import Connection, Listener, UdpSender
from simulators.wire import TICK_S, Bench, SerialPort, TcpPort, UdpPort

STALL_S = 0.050  # wall time; longer than any scheduling delay of a working machine, shorter than a client's time-outs


class Pace:
    """Deadlines of ticks, in the wall time of whoever asks."""

    def __init__(self, tick_wall_s: float, now_s: float) -> None:
        self._tick_wall_s = tick_wall_s
        self.next_s = now_s
        self.stalls = 0
        self.lost_s = 0.0  # wall time that emulated time has not followed

    def take(self, now_s: float) -> bool:
        """True when a tick is due now; counts it as run."""
        late_s = now_s - self.next_s
        if late_s < 0.0:
            return False
        if late_s > STALL_S:
            self.stalls += 1
            self.lost_s += late_s
            self.next_s = now_s
        self.next_s += self._tick_wall_s
        return True


CATCH_UP_TICKS = 4  # 8 ms, less than the 10 ms that devices gather in a frame
TURN_S = 0.5e-3  # ticks that a high time scale makes due within it run in one turn, if no more than CATCH_UP_TICKS
STOP_LATENCY_S = 0.1  # a turn never waits longer, so that a stop is noticed whatever the time scale


class Physics(Protocol):
    """What the loop wants of a world."""

    @property
    def time_s(self) -> float: ...

    def advance(self, until_s: float) -> None: ...


class Host:
    """Owns every socket and pseudo-terminal of a bench, from construction to `close`.

    Raises PortBusy or HostError when a port cannot be opened; nothing stays open then.
    """

    def __init__(
        self,
        bench: Bench,
        world: Physics,
        *,
        time_scale: float = 1.0,
        now_s: Callable[[], float] = time.monotonic,
        log: Log = log_to_stderr,
    ) -> None:
        self._bench, self._world, self._now_s = bench, world, now_s
        self.faults = Report(log)
        # select() and not epoll: Python rounds epoll's time-out up to whole milliseconds, half a tick
        self._selector = selectors.SelectSelector()
        self._lines: list[SerialLine] = []
        self._watched: set[int] = set()
        self._senders: list[UdpSender] = []
        self._listeners: dict[str, Listener] = {}
        self._connections: dict[Connection, Listener] = {}
        try:
            self._open(bench, time_scale)
        except BaseException:
            self.close()
            raise
        self._first_tick = round(world.time_s / TICK_S)
        self.ticks = 0
        tick_wall_s = TICK_S / time_scale
        self._patience_s = (min(CATCH_UP_TICKS, max(1, int(TURN_S / tick_wall_s + 1e-9))) - 1) * tick_wall_s
        self.pace = Pace(tick_wall_s, now_s())

    def serial_address(self, name: str) -> str:
        """The path where clients reach a serial port: its link, or the pseudo-terminal itself."""
        return next(line.address for line in self._lines if line.name == name)

    def tcp_address(self, name: str) -> tuple[str, int]:
        """Host and port number of a listening socket."""
        return self._listeners[name].address

    def watch(self, fd: int, readable: Callable[[], None]) -> None:
        """Calls `readable` whenever there is something to read at a file descriptor of somebody else's."""
        self._selector.register(fd, selectors.EVENT_READ, readable)

    def run(self, stopped: Callable[[], bool]) -> None:
        """Turns until `stopped()`."""
        while not stopped():
            self.turn(STOP_LATENCY_S)

    def turn(self, wait_limit_s: float) -> None:
        """Serves the bytes that have come, waiting for them until the next tick at most; then runs what is due."""
        wait_s = min(wait_limit_s, max(0.0, self.pace.next_s + self._patience_s - self._now_s()))
        for key, _ in self._selector.select(wait_s):
            key.data()
        now_s, ran = self._now_s(), 0
        if now_s < self.pace.next_s + self._patience_s:
            return
        while ran < CATCH_UP_TICKS and self.pace.take(now_s):
            self._tick()
            ran += 1
        if ran:
            self._send()

    def close(self) -> None:
        """Drops all clients, closes all ports, removes links; safe more than once."""
        for connection in list(self._connections):
            self._drop(connection)
        for line in self._lines:
            line.close()
        for listener in self._listeners.values():
            listener.close()
        for sender in self._senders:
            sender.close()
        self._lines, self._senders, self._listeners = [], [], {}
        self._selector.close()

    def _open(self, bench: Bench, pace: float) -> None:
        names = [port.name for port in bench.ports]
        if len(set(names)) != len(names):
            raise ValueError(f"bench: port names {names} are not unique")
        for port in bench.ports:
            if isinstance(port, SerialPort) and port.link is not None:
                check_link(port.name, Path(port.link))
        for port in bench.ports:
            if isinstance(port, TcpPort):
                self._open_listener(port, pace)
            elif isinstance(port, UdpPort):
                self._senders.append(UdpSender(port, self.faults))
            else:
                self._lines.append(SerialLine(port, self.faults, pace))

    def _open_listener(self, port: TcpPort, pace: float) -> None:
        listener = Listener(port, self.faults, pace)
        self._listeners[port.name] = listener
        self._selector.register(listener.socket, selectors.EVENT_READ, lambda: self._accept(listener))

    def _accept(self, listener: Listener) -> None:
        connection = listener.accept()
        if connection is not None:
            self._connections[connection] = listener
            self._selector.register(connection.client, selectors.EVENT_READ, lambda: self._receive(connection))

    def _receive(self, connection: Connection) -> None:
        if connection in self._connections:  # it may have been dropped earlier in this very turn
            connection.receive()
            self._drop_dead(connection)

    def _tick(self) -> None:
        t_s = (self._first_tick + self.ticks) * TICK_S
        for instrument in self._bench.instruments:
            instrument.before_step(t_s)
        self._world.advance(t_s + TICK_S)
        for instrument in self._bench.instruments:
            instrument.after_step(t_s)
        self.ticks += 1
        for line in self._lines:
            if line.to_unplug:
                self._ignore(line)
                line.unplug()
            line.plug_when_due()
            line.send_due()
            self._follow(line)
        for sender in self._senders:
            sender.send_due()
        for connection in self._connections:
            connection.gather_due()

    def _send(self) -> None:
        for connection in list(self._connections):
            connection.send()
            self._drop_dead(connection)

    def _follow(self, line: SerialLine) -> None:
        """Listens to a serial line while a client is there: a terminal without one is always "readable"."""
        if line.attached and line.fd not in self._watched:
            self._watched.add(line.fd)
            self._selector.register(line.fd, selectors.EVENT_READ, lambda: self._receive_serial(line))
        elif not line.attached:
            self._ignore(line)

    def _ignore(self, line: SerialLine) -> None:
        if line.fd in self._watched:
            self._watched.discard(line.fd)
            self._selector.unregister(line.fd)

    def _receive_serial(self, line: SerialLine) -> None:
        line.receive()
        self._follow(line)

    def _drop_dead(self, connection: Connection) -> None:
        if not connection.alive:
            self._drop(connection)

    def _drop(self, connection: Connection) -> None:
        listener = self._connections.pop(connection)
        with suppress(KeyError):
            self._selector.unregister(connection.client)
        listener.bid_farewell(connection)
