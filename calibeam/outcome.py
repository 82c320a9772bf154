"""How a command ends when it is neither done nor lost: done in part, a failed check, an interruption.

Ctrl-C, SIGTERM and a closed terminal end a command once, in one sentence, however often they come. The first one raises
KeyboardInterrupt in the main thread. Those that follow while the command cleans up are not heard: a recording has to be
closed, and a traceback on the way out helps nobody. While the arm of a session moves, its keys hear them instead
(calibeam/sessions/keys.py).
"""

import os
import shutil
import signal
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import FrameType


class PartialResult(Exception):  # noqa: N818 - it is a result
    """The job ended early, and what it had is kept; the message states where and how to go on. Exit code 3."""


class CheckFailed(Exception):  # noqa: N818 - a result of the check, not an error of it
    """Something that was checked is not as it should be; what, has been printed."""


@contextmanager
def taken_back(*outs: Path) -> Generator[None]:
    """Where Ctrl-C or SIGTERM ends the block, what it began at these places is removed; what stood there before stays.

    For what is made of other files: made again, it is whole. What was measured is kept (`PartialResult`).
    """
    before = {out: sorted(out.iterdir()) if out.is_dir() else [] for out in outs if out.exists()}
    try:
        yield
    except KeyboardInterrupt:
        for out in outs:
            begun = {out} if out not in before else {*out.iterdir()} - {*before[out]} if out.is_dir() else set()
            for path in begun:
                shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
        raise


def interruption(why: KeyboardInterrupt) -> str:
    """What the user or the system did: Ctrl-C, or the signal that calibeam.cli turns into the same exception."""
    return str(why.args[0]) if why.args else "Ctrl-C"


ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
AGAIN_S = 2.0  # a clean-up is shorter; an arm that still moves after it has to be stopped by the next one


class Interrupts:
    """Of this process. Only the console command listens; a program that imports calibeam keeps its own handlers."""

    def __init__(self) -> None:
        self._closing = False
        self._raised_s = float("-inf")
        self._terminals: tuple[int, ...] = ()

    def load(self) -> None:
        """While libraries are loaded Ctrl-C ends the process at once: nothing has begun that needs a clean-up.

        KeyboardInterrupt would not do: extension modules turn it into import errors, or print it themselves.
        """
        signal.signal(signal.SIGINT, _leave)

    def listen(self) -> None:
        """From now on. To be called before anything begins; SIGTERM and SIGHUP before it have the system's effect."""
        self._terminals = tuple(fd for fd in (0, 1, 2) if _is_terminal(fd))
        for number in ENDING:
            if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:  # `nohup` outlives a terminal
                signal.signal(number, self.came)
        # A program that was frozen may find itself in the background; discarding what was typed would stop it again.
        signal.signal(signal.SIGTTOU, signal.SIG_IGN)

    def came(self, number: int, frame: FrameType | None) -> None:
        """The handler. KeyboardInterrupt, with the signal's name where it is not Ctrl-C."""
        if number == signal.SIGHUP:
            self.leave_terminal()
        now_s = time.monotonic()
        if self._closing or now_s - self._raised_s < AGAIN_S:
            return
        self._raised_s = now_s
        raise KeyboardInterrupt(*([] if number == signal.SIGINT else [signal.Signals(number).name]))

    def close(self) -> None:
        """The command ends: nothing is heard any more, until `heed`."""
        self._closing = True

    def heed(self) -> None:
        """A person is asked: Ctrl-C is an answer."""
        self._closing, self._raised_s = False, float("-inf")

    def leave_terminal(self) -> None:
        """The terminal was closed: what is still printed goes nowhere, and fails in no clean-up."""
        nowhere = os.open(os.devnull, os.O_RDWR)
        for fd in self._terminals:
            os.dup2(nowhere, fd)
        os.close(nowhere)

    def end(self) -> None:
        """The exit code is decided: no signal changes it while the interpreter ends."""
        for number in ENDING:
            signal.signal(number, signal.SIG_IGN)


Handler = Callable[[int, FrameType | None], None]


@contextmanager
def heard_by(handlers: Mapping[int, Handler]) -> Generator[None]:
    """Inside, these signals go to these handlers; then to whoever had them before. Of the main thread only."""
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _leave(number: int, frame: FrameType | None) -> None:
    os.write(2, b"stopped by Ctrl-C\n")
    os._exit(1)


def _is_terminal(fd: int) -> bool:
    try:
        return os.isatty(fd)
    except OSError:
        return False


INTERRUPTS = Interrupts()
