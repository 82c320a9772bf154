"""What happens on site, by Python's `logging`: a file beside the recording that rotates, one line a happening.

`@logged` in front of a command gives it --log-level and hears every logger of this program from its first step.
`SITE_LOG.begin` states where the lines go, once there is a place; those that waited are written first. A command that
does not come so far leaves no log. Whoever logs, also a thread that moves the arm, only leaves the line in a queue;
one thread owns the file. No session is ended by a line that cannot be written.
"""

import functools
import inspect
import logging
import platform
import re
import shlex
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from logging.handlers import QueueHandler, QueueListener, RotatingFileHandler
from pathlib import Path
from queue import SimpleQueue
from typing import Annotated, Any, Literal, ParamSpec, TypeVar

from cyclopts import Parameter

from acquisition.recording.files import cleaned
from calibeam.outcome import PartialResult, interruption
from calibeam.overwriting import with_option
from calibeam.software import SOFTWARE

P = ParamSpec("P")
R = TypeVar("R")
OWN = ("acquisition", "calibeam", "calibrate", "drivers", "simulators")
SESSION_LOG = "session.log"
SIZE_BYTES, EARLIER = 1_000_000, 5  # of one file; how many before it are kept, session.log.1 the newest of them
SECRET = re.compile(r"(--live-token[= ])\S+")
BEGINS = re.compile(rb"\d{4}-\d\d-\d\dT")  # as every log of this program does
LogLevel = Literal["debug", "info", "warning", "error", "off"]
log = logging.getLogger(__name__)


class _Lines(logging.Formatter):
    def formatTime(self, record: logging.LogRecord, datefmt: str | None = None) -> str:
        return datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")

    def format(self, record: logging.LogRecord) -> str:
        """What follows the first line of a message is indented: only a happening begins with a time."""
        return cleaned(super().format(record)).replace("\n", "\n    ")


class SiteLogFile(RotatingFileHandler):
    """A line that cannot be written is dropped; the first one is reported on standard error."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, maxBytes=SIZE_BYTES, backupCount=EARLIER, encoding="utf-8", delay=True)
        self.setFormatter(_Lines("%(asctime)s %(levelname)s %(name)s: %(message)s"))
        self._reported = False

    def handleError(self, record: logging.LogRecord) -> None:
        if not self._reported:
            self._reported = True
            _warn(f"{self.baseFilename}: the log cannot be written ({sys.exc_info()[1]}); the job goes on")

    def close(self) -> None:
        with suppress(OSError):  # a disk that is full has been reported
            super().close()


class SiteLog:
    """Of this process, which runs one command at a time."""

    def __init__(self) -> None:
        self._waiting: SimpleQueue[Any] | None = None
        self._listener: QueueListener | None = None

    @contextmanager
    def heard(self, level: LogLevel) -> Generator[None]:
        """Inside, lines of this level and above are kept, of other libraries from WARNING on; also how it ends."""
        if level == "off":
            yield
            return
        self._waiting = SimpleQueue()
        handler, root = QueueHandler(self._waiting), logging.getLogger()
        handler.setLevel(level.upper())
        _set_levels(level.upper())
        root.addHandler(handler)
        command = SECRET.sub(r"\1...", shlex.join(sys.argv))
        log.info("%s, Python %s, %s: %s", SOFTWARE, platform.python_version(), platform.platform(), command)
        try:
            with _ending():
                yield
        finally:
            root.removeHandler(handler)
            _set_levels(logging.NOTSET)
            self._close()

    def begin(self, path: Path) -> None:
        """Lines stand at the end of this file from now on, those that waited first; later calls change nothing.

        What is there and is no log is left as it is, and reported on standard error.
        """
        if self._waiting is None or self._listener is not None:
            return
        is_log = _may_be_log(path)
        self._listener = QueueListener(self._waiting, *([SiteLogFile(path)] if is_log else []))
        self._listener.start()
        if not is_log:
            _warn(f"{path}: is there, and is no log of this program; no log is written")

    def _close(self) -> None:
        listener, self._listener, self._waiting = self._listener, None, None
        if listener is not None:
            listener.stop()  # after the lines that wait
            for file in listener.handlers:
                file.close()


SITE_LOG = SiteLog()


def logged(command: Callable[P, R]) -> Callable[P, R]:
    """Gives a command that records on site the option --log-level; what it does is heard by SITE_LOG."""

    @functools.wraps(command)
    def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
        level: Any = kwargs.pop("log_level", "info")
        with SITE_LOG.heard(level):
            return command(*args, **kwargs)

    return with_option(guarded, command, LEVEL)


_ASKED = Annotated[LogLevel, Parameter(help="Of the log beside the recording: lines of this level and above.")]
LEVEL = inspect.Parameter("log_level", inspect.Parameter.KEYWORD_ONLY, default="info", annotation=_ASKED)


def site_log_of(recording: Path) -> Path:
    """Where the log of a single recording stands: r.log beside r.mcap."""
    path = recording.with_suffix(".log")
    return path if path != recording else recording.with_name(f"{recording.name}.log")


@contextmanager
def _ending() -> Generator[None]:
    """Logs how the command ended; with a traceback where nobody foresaw it."""
    try:
        yield
    except KeyboardInterrupt as why:
        log.warning("stopped by %s", interruption(why))
        raise
    except Exception as why:
        foreseen = type(why).__module__.partition(".")[0] in OWN or isinstance(why, OSError)
        level = logging.WARNING if isinstance(why, PartialResult) else logging.ERROR
        log.log(level, "%s: %s", type(why).__name__, why, exc_info=not foreseen)
        raise
    log.info("the command is done")


def _set_levels(level: int | str) -> None:
    for name in OWN:
        logging.getLogger(name).setLevel(level)


def _may_be_log(path: Path) -> bool:
    try:
        if not path.exists():
            return True
        with path.open("rb") as file:
            first = file.read(16) if path.is_file() else b"-"
    except OSError:
        return False
    return not first or BEGINS.match(first) is not None


def _warn(text: str) -> None:
    with suppress(OSError, ValueError):  # standard error is closed
        print(f"warning: {text}", file=sys.stderr)
