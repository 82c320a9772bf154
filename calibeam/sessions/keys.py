"""Keys and Ctrl-C while the arm moves, heard by a thread of their own, so that a stop waits for nobody.

SPACE or p pause, r resume, s stop (finish here), a abort, h halt. Ctrl-C pauses, again within 10 s at once, and a third
time, or once paused, it aborts. Where there is no terminal only Ctrl-C is heard, and SIGCONT resumes. SIGTERM and a
closed terminal abort. Ctrl-Z pauses: a stopped process would read no device. After a freeze of this program what was
typed in it is dropped, and SIGCONT resumes nothing.

What a terminal sends for arrows, function keys and the mouse, letters behind an ESC, is taken out first: letter by
letter an arrow up (ESC [ A) would abort, and F3 (ESC O R) would set a paused arm going.
Source of the forms: ECMA-48, 5.4 (control sequences); xterm, "Control Sequences" (ESC O, mouse of X10); Linux
console_codes(4) (F1 to F5 as ESC [ [ A and so on). A SPACE never belongs to one, so that it always pauses.
"""

import os
import queue
import re
import select
import signal
import termios
import threading
import tty
from collections.abc import Generator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from types import FrameType
from typing import Self

from acquisition.errors import StoppedError
from acquisition.session.control import BROKEN, OVER, RunControl, RunState
from acquisition.wires.streams import FROZEN_S
from calibeam.asking import in_foreground
from calibeam.outcome import INTERRUPTS, heard_by
from drivers.clock import Clock, SystemClock

ESC = "\x1b"
WHOLE = re.compile(r"\x1b(?:\[M.{3}|\[\[?[0-?]*[@-Z\\^-~$]|O[0-9;]*[@-~])", re.DOTALL)
BEGUN = re.compile(r"\x1b(?:\[\[?[0-?]*|O[0-9;]*)?\Z")  # its end may come with the next read


class KeyStream:
    """Keeps the beginning of a sequence that was not read to its end."""

    def __init__(self) -> None:
        self._begun = ""

    def keys(self, typed: str) -> str:
        """The keys among what was read now. A lone ESC is none, and takes no key behind it along."""
        text = WHOLE.sub("", self._begun + typed)
        begun = BEGUN.search(text)
        self._begun = "" if begun is None else begun[0]
        return text.removesuffix(self._begun).replace(ESC, "")


LISTEN_S = 0.2  # between two times at which a stop that was not heard is sent again
END = 0  # beside the numbers of signals
ENDED_BY = {signal.SIGTERM: "SIGTERM", signal.SIGHUP: "the terminal was closed"}
ENTER = "\n"


@dataclass(frozen=True)
class _Question:
    """Answers go to the question that they were given to: what is pressed too often answers no later one."""

    allowed: str
    answers: queue.SimpleQueue[str] = field(default_factory=queue.SimpleQueue[str])


class Keys:
    """What was pressed, handed to the run control; or to who asks, while somebody does."""

    def __init__(self, control: RunControl, terminal: int | None, clock: Clock | None = None) -> None:
        """`terminal`: file descriptor that keys are read from."""
        self._control, self._terminal = control, terminal
        self._clock: Clock = clock or SystemClock()
        self._turned_s = self._clock.now_s()
        self._ended_by = ""  # a signal that ends the session, whatever it is doing
        self._question: _Question | None = None
        self._typed = KeyStream()
        self._reading = threading.Lock()  # what is read is handed on before a question begins, or not at all
        self._opened = ExitStack()
        self._woken = self._wake = -1  # a pipe, while it is listened to

    @property
    def heard(self) -> bool:
        """Whether there is a keyboard."""
        return self._terminal is not None

    def pressed(self, key: str) -> None:
        """One key."""
        key, question = ENTER if key == "\r" else key.lower(), self._question
        if key == "a":
            self._control.abort()
        elif key == "h":
            self._control.halt()
        elif question is not None:
            if key in question.allowed:
                question.answers.put(key)
        elif key in " p":
            self._control.pause()
        elif key == "r":
            self._control.resume()
        elif key == "s":
            self._control.stop()

    def signalled(self, number: int) -> None:
        """A signal, as if the system had delivered it now."""
        os.write(self._wake, bytes([number]))

    def wait(self, allowed: str) -> str:
        """One of these keys, pressed from now on. StoppedError when given up (a, Ctrl-C); what a device failed with."""
        question = _Question(allowed)
        with self._reading:
            self._forget()
            self._question = question
        try:
            while True:
                self._control.check_devices()
                if self._control.state in BROKEN or self._control.state in OVER:
                    raise StoppedError("the session was given up while a person was asked")
                with suppress(queue.Empty):
                    return question.answers.get(timeout=LISTEN_S)
        finally:
            self._question = None

    def __enter__(self) -> Self:
        """From now on keys and signals go to the run control; at the end terminal and signals are as they were."""
        with ExitStack() as opened:
            self._woken, self._wake = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
            self._turned_s = self._clock.now_s()
            opened.callback(self._close)
            opened.enter_context(_written_to(self._wake, continued=not self.heard))
            opened.enter_context(_one_by_one(self._terminal))
            thread = threading.Thread(target=self._listen, name="keys", daemon=True)
            thread.start()
            opened.callback(thread.join)
            opened.callback(self.signalled, END)
            self._opened = opened.pop_all()
        return self

    def __exit__(self, *error: object) -> None:
        """KeyboardInterrupt where a signal that ends the session came when nothing was under way any more."""
        self._opened.close()
        if self._ended_by and error[0] is None and self._control.state in (RunState.IDLE, RunState.DONE):
            raise KeyboardInterrupt(self._ended_by)

    def _close(self) -> None:
        os.close(self._woken)
        os.close(self._wake)
        self._woken = self._wake = -1

    def _listen(self) -> None:
        sources = [self._woken] + ([] if self._terminal is None else [self._terminal])
        while True:
            heard = [fd for fd in sources if fd != self._terminal or in_foreground(fd)]
            ready = select.select(heard, [], [], LISTEN_S)[0]
            frozen = self._was_frozen()
            if self._woken in ready:
                for number in os.read(self._woken, 64):
                    if number == END:
                        return
                    if not (frozen and number == signal.SIGCONT):
                        self._on_signal(number)
            # What was typed during a freeze is discarded; the terminal that was ready is empty then.
            if self._terminal in ready and not frozen and not self._read(self._terminal):
                sources.remove(self._terminal)
            self.insist()

    def insist(self) -> None:
        """What the session has not taken note of is repeated; to be called a few times a second."""
        if self._ended_by:
            self._control.abort(self._ended_by)  # it may have come before the session began
        self._control.insist()

    def _was_frozen(self) -> bool:
        """Whether this program did nothing since the last turn; what the terminal holds then is discarded."""
        now_s = self._clock.now_s()
        gap_s, self._turned_s = now_s - self._turned_s, now_s
        if gap_s <= FROZEN_S + LISTEN_S:
            return False
        with self._reading:
            self._forget()
        return True

    def _read(self, terminal: int) -> bool:
        """Hands on what was typed; whether there may be more."""
        with self._reading:
            if not select.select([terminal], [], [], 0.0)[0]:
                return True  # it was discarded in this moment
            typed = _read(terminal)
            for key in self._typed.keys(typed):
                self.pressed(key)
            return bool(typed)

    def _forget(self) -> None:
        """What was typed before a question was asked answers none."""
        self._typed = KeyStream()
        if self._terminal is not None:
            with suppress(termios.error):
                termios.tcflush(self._terminal, termios.TCIFLUSH)

    def _on_signal(self, number: int) -> None:
        if number in ENDED_BY:
            if number == signal.SIGHUP:
                INTERRUPTS.leave_terminal()
            self._ended_by = self._ended_by or ENDED_BY[signal.Signals(number)]
            self._control.abort(self._ended_by)
        elif number == signal.SIGCONT:
            self._control.resume()
        elif self._question is not None:
            self._control.abort()
        elif number == signal.SIGTSTP:
            self._control.pause()
        elif number == signal.SIGINT:
            self._control.interrupt()


def _read(fd: int) -> str:
    try:
        return os.read(fd, 64).decode(errors="replace")
    except OSError:
        return ""


@contextmanager
def _one_by_one(fd: int | None) -> Generator[None]:
    """Keys arrive without Enter, and are not shown; Ctrl-C stays a signal."""
    if fd is None:
        yield
        return
    before = termios.tcgetattr(fd)
    try:
        tty.setcbreak(fd, termios.TCSANOW)
        yield
    finally:
        with suppress(termios.error):  # it was closed meanwhile
            termios.tcsetattr(fd, termios.TCSADRAIN, before)


@contextmanager
def _written_to(wake: int, *, continued: bool) -> Generator[None]:
    """The number of each signal goes to this descriptor as it is delivered, not when the main thread has time for it.

    Python's own handlers run between two instructions of the main thread, once for all that came during one of them.
    `continued`: SIGCONT, too. In a terminal it comes with every `fg`, and must not set an arm going.
    """
    numbers = [signal.SIGINT, signal.SIGTSTP, signal.SIGTERM, signal.SIGHUP]
    numbers += [signal.SIGCONT] if continued else []
    earlier = signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    try:
        with heard_by(dict.fromkeys(numbers, _nothing_more)):
            yield
    finally:
        signal.set_wakeup_fd(earlier)


def _nothing_more(number: int, frame: FrameType | None) -> None:
    """Of Python: the listening thread has heard it."""
