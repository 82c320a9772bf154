"""What a worker is asked to do, and what is answered when it cannot: small, frozen, made of file names."""

import signal
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import msgspec

from calibeam.fleet.found import Found, content_sha256
from calibeam.fleet.row import Outcome, Row
from calibeam.software import SOFTWARE

CHILD = (sys.executable, "-P", "-m", "calibeam.fleet.worker")


class Task(msgspec.Struct, frozen=True):
    """One recording, as it goes to the process that reads it."""

    path: str
    name: str
    size_bytes: int
    modified_ns: int
    diagnose: bool
    date: str = ""  # stands for the recording's own start

    @classmethod
    def of(cls, found: Found, *, diagnose: bool) -> "Task":
        return cls(str(found.path), found.name, found.size_bytes, found.modified_ns, diagnose, found.date)

    def row(self, outcome: Outcome, **fields: object) -> Row:
        """A row of this recording."""
        known = {name: getattr(self, name) for name in ("path", "name", "size_bytes", "modified_ns")}
        return msgspec.convert(
            {"sha256": "", "software": SOFTWARE, "diagnosed": self.diagnose, **known, "outcome": outcome, **fields}, Row
        )

    def lost(self, why: str, seconds: float = 0.0) -> Row:
        """What stands in the table where no process brought it to an end."""
        sha256 = ""
        with suppress(OSError):
            sha256 = content_sha256(Path(self.path))
        return self.row(Outcome.LOST, sha256=sha256, error=why, seconds=seconds)


@dataclass(frozen=True)
class Order:
    """A task with its limits."""

    task: Task
    timeout_s: float | None
    command: tuple[str, ...] = CHILD


def death(returncode: int) -> str:
    """How a process ended, for a person."""
    if returncode >= 0:
        return f"its process ended by itself with code {returncode}"
    name = signal.Signals(-returncode).name if -returncode in set(signal.Signals) else str(-returncode)
    often = "; most often memory was short: give fewer --jobs" if -returncode == signal.SIGKILL else ""
    return f"its process was ended by {name}{often}"
