"""The dashboard server of a UR controller, a second, independent way to ask for states, to stop, and to unlock; and
its digital outputs.

One short connection for each conversation, so that a controller that was restarted in between is no trouble.
Source: Universal Robots, "Dashboard Server e-Series": port 29999, one ASCII line in, one line out, a banner first.
PolyScope X has no dashboard server. The outputs go through the I/O interface of ur_rtde, which leaves a running program
alone: outputs = UrOutputs("192.168.0.10"); outputs.connect(); outputs.switch(3, True); outputs.close(). Numbers are the
bits of `actual_digital_output_bits` (RTDE guide): 0 to 7 standard, 8 to 15 configurable, 16 and 17 of the tool. Whether
an output has switched is in the stream of the controller, not here.
"""

import importlib
import socket
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from drivers.clock import Clock, SystemClock
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale, WireError

DASHBOARD_PORT = 29999
TIMEOUT_S = 1.0  # for a whole conversation; replies come within tenths
STOP_TIMEOUT_S = 0.5  # who stops wants to know soon that this way is closed
BANNER = "Connected: Universal Robots Dashboard Server"
MAX_LINE_BYTES = 4096


@dataclass(frozen=True)
class ArmState:
    """What the dashboard reports, for example ("RUNNING", "NORMAL", True)."""

    robot_mode: str
    safety_status: str
    remote_control: bool

    @property
    def ready(self) -> bool:
        return self.robot_mode == "RUNNING" and self.safety_status == "NORMAL"


@dataclass(frozen=True)
class ControllerIdentity:
    """Model and serial number, for example ("UR5", "20195000001"): an e-Series arm calls itself by its size only."""

    model: str
    serial_number: str


class UrDashboard:
    """Verbs of the dashboard. Each raises DeviceLost, DeviceStale, or DeviceRefused with the controller's own words."""

    def __init__(
        self, host: str, *, port: int = DASHBOARD_PORT, timeout_s: float = TIMEOUT_S, clock: Clock | None = None
    ) -> None:
        self._host, self._port, self._timeout_s = host, port, timeout_s
        self._clock: Clock = clock or SystemClock()

    def state(self) -> ArmState:
        """Mode, safety and whether it obeys from outside; CB3 controllers know no remote control: always True there."""
        mode, safety, remote = self._converse(["robotmode", "safetystatus", "is in remote control"])
        return ArmState(_after_colon(mode), _after_colon(safety), "false" not in remote.lower())

    def identity(self) -> ControllerIdentity:
        return ControllerIdentity(*self._converse(["get robot model", "get serial number"]))

    def stop(self) -> None:
        """Ends the running program; the arm brakes."""
        self._command("stop", "Stopped", min(STOP_TIMEOUT_S, self._timeout_s))

    def unlock_protective_stop(self) -> None:
        """Refused for the first 5 s. Find the cause before: the arm may move again afterwards."""
        self._converse(["close safety popup"])
        self._command("unlock protective stop", "Protective stop releasing")

    def power_on(self) -> None:
        self._command("power on", "Powering on")

    def brake_release(self) -> None:
        self._command("brake release", "Brake releasing")

    @property
    def _place(self) -> str:
        return f"dashboard at {self._host}:{self._port}"

    def _command(self, line: str, expected: str, timeout_s: float | None = None) -> None:
        (reply,) = self._converse([line], timeout_s, at_once=True)
        if reply != expected:
            raise DeviceRefused(f'{self._place}: "{line}" is refused: {reply}; check the pendant')

    def _converse(self, lines: list[str], timeout_s: float | None = None, *, at_once: bool = False) -> list[str]:
        """`at_once`: the one line is sent before the banner has come, so that a controller which hangs finds it first
        when it goes on.
        """
        limit_s = self._timeout_s if timeout_s is None else timeout_s
        deadline_s = self._clock.now_s() + limit_s
        try:
            with socket.create_connection((self._host, self._port), limit_s) as line:
                replies = _Lines(line, self._clock, deadline_s)
                if at_once:
                    replies.send(lines[0])
                banner = replies.next()
                if not banner.startswith(BANNER):
                    raise WireError(f"{self._place}: no dashboard server: it sent {banner[:32]!r}; check the address")
                return [replies.next()] if at_once else [replies.ask(text) for text in lines]
        except TimeoutError as error:
            raise DeviceStale(
                f"{self._place}: no reply to {lines} within {limit_s:.3g} s; is the controller hung?"
            ) from error
        except ConnectionError as error:
            raise DeviceLost(
                f"{self._place}: {error.strerror or error}; check power, address and cable of the controller"
            ) from error
        except OSError as error:
            raise DeviceLost(f"{self._place}: {error.strerror or error}; check the address and the network") from error


class _Lines:
    """Lines of one connection, all of them before one deadline."""

    def __init__(self, line: socket.socket, clock: Clock, deadline_s: float) -> None:
        self._line, self._clock, self._deadline_s = line, clock, deadline_s
        self._pending = b""

    def ask(self, text: str) -> str:
        self.send(text)
        return self.next()

    def send(self, text: str) -> None:
        with _hanging_up_said():
            self._line.sendall(f"{text}\n".encode())

    def next(self) -> str:
        """TimeoutError, ConnectionError; a line without an end counts as silence."""
        while b"\n" not in self._pending and len(self._pending) < MAX_LINE_BYTES:
            self._line.settimeout(max(1e-3, self._deadline_s - self._clock.now_s()))
            with _hanging_up_said():
                data = self._line.recv(MAX_LINE_BYTES)
                if not data:
                    raise ConnectionResetError
            if self._clock.now_s() > self._deadline_s:
                raise TimeoutError
            self._pending += data
        first, _, self._pending = self._pending.partition(b"\n")
        return first.decode("ascii", errors="replace").strip()


@contextmanager
def _hanging_up_said() -> Generator[None]:
    """A peer that hangs up is seen as an end, a reset or a broken pipe, by a hair: one sentence for all."""
    try:
        yield
    except ConnectionError as error:
        raise ConnectionResetError("the controller closed the connection") from error


def _after_colon(reply: str) -> str:
    return reply.rpartition(":")[2].strip()


# First bit of each kind, and what ur_rtde calls it.
KINDS = ((16, "setToolDigitalOut"), (8, "setConfigurableDigitalOut"), (0, "setStandardDigitalOut"))
LAST = 17


class UrOutputs:
    """One thread switches."""

    def __init__(self, host: str, *, name: str = "robot") -> None:
        self.name = name
        self._host = host
        self._io: Any = None  # rtde_io.RTDEIOInterface has no type information

    @property
    def place(self) -> str:
        return f"{self.name} at {self._host}"

    def connect(self) -> None:
        """DeviceLost: no controller there, or another client holds its registers."""
        self.close()
        try:
            self._io = importlib.import_module("rtde_io").RTDEIOInterface(self._host)
        except (RuntimeError, ImportError) as error:  # ur_rtde raises the first for everything
            why = f"{self.place}: its outputs cannot be reached: {error}"
            raise DeviceLost(f"{why}; check power and cable, and that ur_rtde is installed") from error

    def switch(self, bit: int, level: bool) -> None:
        """ValueError for a bit that no output has. DeviceRefused, DeviceLost."""
        if not 0 <= bit <= LAST:
            raise ValueError(f"digital output {bit}: the controller has bits 0 to {LAST}")
        if self._io is None:
            raise DeviceLost(f"{self.place}: its outputs are not connected; call connect() first")
        first, verb = next(kind for kind in KINDS if bit >= kind[0])
        try:
            taken = getattr(self._io, verb)(bit - first, level)
        except RuntimeError as error:
            raise DeviceLost(f"{self.place}: output {bit} was not switched: {error}; connect again") from error
        if not taken:
            raise DeviceRefused(f"{self.place}: the controller did not take output {bit}; check its pendant")

    def close(self) -> None:
        """Safe in every state, and more than once."""
        io, self._io = self._io, None
        if io is not None:
            io.disconnect()
