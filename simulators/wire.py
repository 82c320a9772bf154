"""The seams between a world, its instruments and the process that carries their bytes.

An instrument is advanced by emulated time and never reads a clock of the host; a device's clock is the world's while
the device is healthy. A wire is one client's connection to an instrument: bytes in, bytes out, no I/O. The host loop
(simulators/host) owns sockets and pseudo-terminals.

Each tick of TICK_S emulated seconds runs in this order:
    instrument.before_step(t)      the controller sets its next set-point, ...
    world.advance(t + TICK_S)      physics
    instrument.after_step(t)       devices sample the new state
    wire.due()                     what each open connection has to send now
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol


class DeviceClock:
    """What a device puts into its time stamps. Emulated time goes in, and is not touched itself.

    Several disturbances add up; each is mended by itself.
    """

    def __init__(self) -> None:
        self._wrong: dict[Hashable, tuple[float, float, float]] = {}  # whose -> step (s), drift, since when (s)

    def tells(self, t_s: float) -> float:
        """The stamp of something that happens at `t_s`, in seconds."""
        return t_s + sum(step_s + drift * (t_s - since_s) for step_s, drift, since_s in self._wrong.values())

    def disturb(self, whose: Hashable, step_s: float, drift: float, t_s: float) -> None:
        """From `t_s` on it is `step_s` farther ahead and gains `drift` more, seconds in a second."""
        self._wrong[whose] = step_s, drift, t_s

    def mend(self, whose: Hashable) -> None:
        """As if that one had not been."""
        self._wrong.pop(whose, None)


TICK_S = 0.002  # one cycle of an e-Series controller, 500 Hz (reference: RTDE guide)


class Wire(Protocol):
    """One connection's protocol. Its docstring states what it does NOT imitate.

    A wire may have an attribute `closing`. Once it is true and all bytes are sent, the host closes a TCP connection
    (dashboard `quit`, a controller that drops its clients); a serial port is unplugged for as long as it is true.
    A wire that raises loses its connection. For fault injection it may have `damaged` and `refusal`: see
    simulators/faults/injector.py.
    """

    def handle(self, data: bytes) -> bytes:
        """Bytes from the client, in any split; returns the answer that is ready at once."""
        ...

    def due(self) -> bytes:
        """Bytes to send that became due since the last call; the line's speed is modelled here."""
        ...


class Instrument(Protocol):
    """A device over the world."""

    name: str

    def before_step(self, t_s: float) -> None: ...

    def after_step(self, t_s: float) -> None: ...


@dataclass(frozen=True)
class SerialPort:
    """A pseudo-terminal; `link` is a symbolic link that the host makes to it, so that a rig file can name it."""

    name: str
    wire: Wire
    link: str | None = None


@dataclass(frozen=True)
class TcpPort:
    """A listening socket; every client gets a wire of its own. `close` is called when a client has gone."""

    name: str
    host: str
    port: int
    accept: Callable[[], Wire]
    closed: Callable[[Wire], None] = lambda wire: None


@dataclass(frozen=True)
class UdpPort:
    """Datagrams to one address, whoever listens there or not: all that became due in a tick is one datagram."""

    name: str
    host: str
    port: int
    wire: Wire


@dataclass(frozen=True)
class Bench:
    """Everything that the host loop serves: instruments, where clients reach them, and side-channel verbs.

    `verbs` are called by the loopback side channel with JSON arguments, for example "fixture.place" with {"id": 2}.
    What `emulate --json` prints is put together in simulators/serve.py from where the ports were opened.
    `clock` gives the device's time stamps, if it sends any; fault injection disturbs it.
    """

    instruments: Sequence[Instrument]
    ports: Sequence[SerialPort | TcpPort | UdpPort]
    verbs: Mapping[str, Callable[..., Any]] = field(default_factory=dict[str, Callable[..., Any]])
    clock: DeviceClock | None = None
