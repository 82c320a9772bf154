"""The messages between the parent and its child: one JSON object a line, over a socket pair.

There are two lines: `calls` for one call at a time and its answer, `stops` for a stop in the middle of a call and for
the beats by which the parent shows that it runs.
"""

import select
import socket
from enum import StrEnum
from pathlib import Path

import msgspec

BEAT_S = 0.1
LEASE_S = 1.0  # ten beats: a busy machine may delay one by tenths. A process that is stopped is noticed at once


class MoveJoints(msgspec.Struct, frozen=True, tag=True):
    """Answered by Ended when the motion has ended, with Alive in between."""

    q_rad: list[float]
    speed_rad_s: float
    acceleration_rad_s2: float


class ServoJoints(msgspec.Struct, frozen=True, tag=True):
    """Answered by Ended at once; the arm keeps following until ServoStop."""

    q_rad: list[float]
    period_s: float
    lookahead_s: float
    gain: float


class ServoStop(msgspec.Struct, frozen=True, tag=True):
    """Answered by Ended when the arm stands."""

    deceleration_rad_s2: float


class Freedrive(msgspec.Struct, frozen=True, tag=True):
    """Answered by Ended at once; on: a person may guide the arm until it is switched off, or the program ends."""

    on: bool


class Call(msgspec.Struct, frozen=True, tag=True):
    """One request on the line of calls; numbers count up from 1."""

    number: int
    request: MoveJoints | ServoJoints | ServoStop | Freedrive


class Stop(msgspec.Struct, frozen=True, tag=True):
    """On the stop line only. Answered by Alive at once, then by Ended when the arm stands.

    Calls up to this number that have not begun yet never will: the two lines do not keep order between each other.
    """

    deceleration_rad_s2: float
    up_to: int = 0


class Beat(msgspec.Struct, frozen=True, tag=True):
    """On the stop line, every BEAT_S as long as the parent runs. Not answered."""


class Close(msgspec.Struct, frozen=True, tag=True):
    """The child ends the control program and itself."""


class Outcome(StrEnum):
    """How a call ended."""

    DONE = "done"
    STOPPED = "stopped"  # by a Stop in the middle, or before it began
    NOT_RUNNING = "not running"  # the control program has ended: safety stop, pendant, dashboard, watchdog
    DISCONNECTED = "disconnected"  # the controller's line is gone
    SILENT = "silent"  # the line is there, but nothing new comes over it
    EXPIRED = "expired"  # parent or child did not run: the arm was braked, and no later call is begun
    REFUSED = "refused"  # an argument that ur_rtde or the controller does not take, or no control at all


class Ready(msgspec.Struct, frozen=True, tag=True):
    """First message of a child that has control."""


class Alive(msgspec.Struct, frozen=True, tag=True):
    """The child works on it."""


class Ended(msgspec.Struct, frozen=True, tag=True):
    """Last answer to a call."""

    outcome: Outcome
    text: str = ""


Motion = MoveJoints | ServoJoints | ServoStop | Freedrive
Request = Call | Stop | Beat | Close
Answer = Ready | Alive | Ended
_requests = msgspec.json.Decoder[Request](Request)
_answers = msgspec.json.Decoder[Answer](Answer)


def is_stopped(pid: int) -> bool:
    """Whether a signal or a debugger has stopped the process: Linux proc(5), state T. False where that is unknown."""
    try:
        status = Path(f"/proc/{pid}/stat").read_bytes()
    except OSError:
        return False
    return status.rpartition(b")")[2].split()[:1] in ([b"T"], [b"t"])


class Link:
    """One end of a line. ConnectionError (also BrokenPipeError) when the other end has gone."""

    def __init__(self, line: socket.socket) -> None:
        self.line = line
        self._pending = b""

    def send(self, message: Request | Answer) -> None:
        self.line.sendall(msgspec.json.encode(message) + b"\n")  # a few hundred bytes: the socket buffer takes them

    def send_now(self, message: Request | Answer) -> None:
        """BlockingIOError where the other end has not read for so long that nothing more fits into the line."""
        self.line.send(msgspec.json.encode(message) + b"\n", socket.MSG_DONTWAIT)

    def next_request(self, timeout_s: float) -> Request | None:
        """None when none came in time."""
        line = self._next_line(timeout_s)
        return None if line is None else _requests.decode(line)

    def next_answer(self, timeout_s: float) -> Answer | None:
        """None when none came in time."""
        line = self._next_line(timeout_s)
        return None if line is None else _answers.decode(line)

    def close(self) -> None:
        self.line.close()

    def _next_line(self, timeout_s: float) -> bytes | None:
        """One wait only: half a line, which a local socket hardly ever brings, counts as none yet."""
        if b"\n" not in self._pending:
            waiter = select.poll()
            waiter.register(self.line, select.POLLIN)
            if not waiter.poll(max(0.0, 1e3 * timeout_s)):
                return None
            data = self.line.recv(65536)
            if not data:
                raise ConnectionResetError("the other process has gone")
            self._pending += data
            if b"\n" not in self._pending:
                return None
        line, _, self._pending = self._pending.partition(b"\n")
        return line
