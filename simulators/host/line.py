"""Bytes that a client has not taken yet, bounded, so that a slow client never holds up the others.

Streamed output is dropped whole when too much is waiting, as a UR controller skips RTDE packages for a client that does
not read and never sends them later (RTDE guide, "Key features"); sequence numbers or time stamps make the loss seen.
Answers are kept up to a limit that only a client which never reads can reach.

Faults of wires go to a log, once for each place, so that a client that sends rubbish at full speed fills no disk.

The symbolic link by which a rig file names a pseudo-terminal, whose own name changes with every start.
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path

from simulators.errors import HostError

Log = Callable[[str], None]


def log_to_stderr(line: str) -> None:
    """The standard log: one line on stderr, never on stdout, which belongs to the announcement."""
    print(line, file=sys.stderr, flush=True)


class Report:
    """Logs the first fault of every place and of every kind; counts them all."""

    def __init__(self, log: Log) -> None:
        self._log = log
        self._reported: set[tuple[str, str]] = set()
        self.count = 0

    def fault(self, place: str, fault: Exception) -> None:
        self.count += 1
        kind = (place, type(fault).__name__)
        if kind not in self._reported:
            self._reported.add(kind)
            self._log(f"{place}: {type(fault).__name__}: {fault} (further ones of this kind are not logged)")


def check_link(port_name: str, link: Path) -> None:
    """HostError when something stands at `link` that must not be replaced; call before any pseudo-terminal is opened.

    A left-over link of an emulator that was killed points to a terminal that is no more and may go. One whose target
    exists may be a real device or belong to an emulator that still runs.
    """
    if link.is_symlink():
        if link.exists():
            raise HostError(
                f"{port_name}: {link} already leads to {os.readlink(link)}; stop the emulator that uses it, "
                "or delete the link, or emulate without links"
            )
    elif link.exists():
        raise HostError(
            f"{port_name}: {link} exists and is no link of an emulator; name another port in the rig file, "
            "or emulate without links"
        )


def make_link(port_name: str, link: Path, target: str) -> None:
    """Makes `link` point to the terminal `target`, with its folder. HostError when the file system refuses."""
    try:
        link.parent.mkdir(parents=True, exist_ok=True)
        link.unlink(missing_ok=True)
        link.symlink_to(target)
    except OSError as error:
        raise HostError(
            f"{port_name}: cannot make the link {link}: {error.strerror}; name another port in the rig file, "
            "or emulate without links"
        ) from error


def remove_link(link: Path, target: str) -> None:
    """Removes `link` if it is still ours; a later emulator may have put its own there."""
    try:
        if os.readlink(link) == target:
            link.unlink()
    except OSError:
        return  # somebody else has removed or replaced it: nothing of ours is left


STREAM_LIMIT_BYTES = 64 * 1024  # 0.1 s of RTDE with every field, beyond what the kernel's own buffers hold
ANSWER_LIMIT_BYTES = 1024 * 1024  # feels right: thousands of answers that nobody has read


class Outbox:
    """`write` takes bytes and returns how many it took; BlockingIOError means none now.

    `pace`: emulated seconds in one of the host's. A client stands still for a time of the host, in which so much more
    comes.
    """

    def __init__(self, write: Callable[[bytearray], int], pace: float = 1.0) -> None:
        self._write, self._limit_bytes = write, int(STREAM_LIMIT_BYTES * max(pace, 1.0))
        self._waiting = bytearray()
        self.dropped = 0  # outputs lost because the client did not read

    @property
    def empty(self) -> bool:
        return not self._waiting

    def takes_stream(self) -> bool:
        """False, and counted, while too much waits: what would be streamed now need not even be made."""
        if len(self._waiting) <= self._limit_bytes:
            return True
        self.flush()
        if len(self._waiting) <= self._limit_bytes:
            return True
        self.dropped += 1
        return False

    def gather(self, data: bytes) -> None:
        """Streamed output for the next `flush`, where `takes_stream` is true."""
        self._waiting += data

    def stream(self, data: bytes) -> None:
        """Output that may be lost. Raises what `write` raises, except for "not now"."""
        self._offer(data, self._limit_bytes)

    def answer(self, data: bytes) -> bool:
        """Output that belongs to a request; False when the client has left so much unread that it was dropped."""
        return self._offer(data, ANSWER_LIMIT_BYTES)

    def flush(self) -> None:
        """Hands over as much as goes without waiting."""
        while self._waiting:
            try:
                taken = self._write(self._waiting)
            except BlockingIOError:
                return
            del self._waiting[:taken]

    def clear(self) -> None:
        """Forgets what is waiting: the client has gone."""
        self._waiting.clear()

    def _offer(self, data: bytes, limit_bytes: int) -> bool:
        if self._waiting:
            self.flush()
        if len(self._waiting) > limit_bytes:
            self.dropped += 1
            return False
        if data:
            self._waiting += data
            self.flush()
        return True
