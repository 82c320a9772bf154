"""The log beside a recording, session.log: one line a happening, with its time; nothing that was said is lost."""

from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from calibeam.session.status import Shown

NAME = "session.log"


def utc_now() -> datetime:
    return datetime.now(UTC)


class LogFile:
    """Implements status.Listener. A disk that takes no line ends no session: the recording reports it."""

    def __init__(self, path: Path, now: Callable[[], datetime] = utc_now) -> None:
        self.path, self._now = path, now

    def said(self, text: str, loud: bool) -> None:
        stamp = self._now().isoformat(timespec="milliseconds").replace("+00:00", "Z")
        lines = "".join(f"{stamp} {line}\n" for line in text.splitlines())
        with suppress(OSError), self.path.open("a", encoding="utf-8") as file:
            file.write(lines)

    def shows(self, shown: Shown) -> None:
        """A log holds what was said."""
