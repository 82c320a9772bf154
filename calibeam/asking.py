"""The one place where a person at the terminal is asked.

An answer counts only if it was typed after the question was on the screen. The question is written to the terminal
that it is answered at; once the terminal has taken it, and a person could have begun to read, all that was typed until
then is discarded. Only then the cue is written and a line is read, from the terminal itself: nothing of it is ever in
a buffer of Python's, and nothing else of the program reads standard input as lines. A pasted text of several lines
answers one question only, because the next one discards the rest. What was typed while this program did not run
(stopped, or the machine hung) is discarded, too, and the question is asked again.
"""

import errno
import fcntl
import math
import os
import select
import sys
import termios
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field

from acquisition.errors import AcquisitionError
from acquisition.wires.streams import FROZEN_S
from calibeam.console import Console
from drivers.clock import Clock, SystemClock

GO, REFUSALS = "go", ("n", "no", "q")
CELL = "THE ARM WILL MOVE. Is the cell clear?"
YES = "give --yes when the cell is clear"
REACTION_S = 0.2  # a person takes longer (about 0.25 s); what kernel or network still carry arrives sooner
LISTEN_S = 0.2  # between two looks whether this program was frozen, or nobody waits for the answer any more
END_OF_INPUT = b"\x04"  # what Ctrl-D sends where another program left the terminal without line editing


class NotAgreedError(AcquisitionError):
    """Nobody could be asked, or who was asked did not agree; nothing was moved."""


class _FrozenError(Exception):
    """The program did not run for a while; the message is shown to a person."""


@dataclass(frozen=True)
class Asking:
    """A person at a terminal. `fd`: file descriptor that the answers are read from."""

    fd: int
    clock: Clock = field(default_factory=SystemClock)

    def may_move(self) -> None:
        """Returns once the word is typed. NotAgreedError on a refusal or the end of input; anything else asks again."""
        self._bell()
        cue = f"Type {GO} to move, no to leave it: "
        answer = self.ask(CELL, cue)
        while (word := None if answer is None else answer.lower()) != GO:
            if word is None:
                raise NotAgreedError("nothing was moved: the input ended without an answer")
            if word in REFUSALS:
                raise NotAgreedError(f"nothing was moved: the answer was '{word}'")
            answer = self.ask(f"{short(word)} is no answer. {CELL}", cue)

    def choice(self, question: str, choices: Mapping[str, str], default: str) -> str | None:
        """One of the letters; `default` for ENTER alone, None at the end of input. Anything else asks again."""
        shown = "\n".join(f"   {letter}  {meaning}" for letter, meaning in choices.items())
        cue = f"{question} [{'/'.join(choices)}, ENTER: {default}] "
        answer = self.ask(shown, cue)
        while answer is not None:
            word = answer.lower() or default
            if word in choices:
                return word
            answer = self.ask(f"{short(word)} is none of them", cue)
        return None

    def numbers(self, question: str, count: int) -> tuple[float, ...] | None:
        """So many numbers on one line, None at the end of input. Anything else asks again."""
        answer = self.ask(question, "> ")
        while answer is not None:
            values = _numbers(answer)
            if len(values) == count:
                return values
            answer = self.ask(f"{count} numbers, please, with spaces between", "> ")
        return None

    def enter(self, question: str) -> bool:
        """Whether ENTER was pressed; not so on a refusal or at the end of input. Anything else asks again."""
        cue = "ENTER to go on, q to end: "
        answer = self.ask(question, cue)
        while answer:
            if answer.lower() in REFUSALS:
                return False
            answer = self.ask(f"{short(answer)} is no answer", cue)
        return answer is not None

    def ask(self, question: str, cue: str, over: Callable[[], bool] = lambda: False) -> str | None:
        """One line, without spaces around it, typed after `question` was on the screen.

        None at the end of input, or when `over`: nobody waits for the answer any more.
        """
        shown = question
        while self.show(shown):
            begin_s = self.clock.now_s()
            self.forget()
            self._write(cue, end="")
            try:
                line = self._line(begin_s, over)
            except _FrozenError as freeze:
                self._write("")
                if over():
                    return None
                shown = f"{freeze}. {question}"
                continue
            if line is None:
                self._write("")
            return line
        return None

    def show(self, text: str) -> bool:
        """Returns when it can have been seen; False where the terminal cannot be written to."""
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()  # what was printed before comes first
        if not self._write(text, bold=True):
            return False
        self.wait_until_seen()
        return True

    def wait_until_seen(self) -> None:
        """Returns when what was printed can have been seen."""
        while True:
            try:
                termios.tcdrain(self.fd)
            except termios.error as error:
                if error.args[0] == errno.EINTR:
                    continue
            break
        time.sleep(REACTION_S)

    def forget(self) -> None:
        """Discards what was typed until now."""
        with suppress(termios.error):
            termios.tcflush(self.fd, termios.TCIFLUSH)

    def _line(self, begin_s: float, over: Callable[[], bool]) -> str | None:
        """None where the input, or the terminal, ended first, or it is over. _FrozenError: nothing counts."""
        typed, turned_s = b"", begin_s
        while not typed.endswith((b"\n", b"\r")):
            if over():
                return None
            try:
                ready = select.select([self.fd] if in_foreground(self.fd) else [], [], [], LISTEN_S)[0]
                now_s = self.clock.now_s()
                gap_s, turned_s = now_s - turned_s, now_s
                if gap_s > FROZEN_S + LISTEN_S:
                    raise _FrozenError(f"This program did not run for {gap_s:.1f} s; what was typed does not count")
                if not ready:
                    continue
                piece = os.read(self.fd, 4096)
            except OSError:
                return None
            if not piece or piece == END_OF_INPUT:
                return None
            typed += piece
        return typed.decode(errors="replace").strip()

    def _bell(self) -> None:
        self._write("\a", end="")

    def _write(self, text: str, *, end: str = "\n", bold: bool = False) -> bool:
        try:
            with os.fdopen(self._screen(), "w", encoding="utf-8", errors="replace") as screen:
                style = "bold" if bold else None
                Console(file=screen).print(text, end=end, style=style, markup=False, highlight=False, soft_wrap=True)
        except OSError:  # the terminal is gone, or is another user's
            return False
        return True

    def _screen(self) -> int:
        """A descriptor of the same terminal to write to, also where standard output is a file."""
        if fcntl.fcntl(self.fd, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDWR:
            return os.dup(self.fd)
        return os.open(os.ttyname(self.fd), os.O_WRONLY | os.O_NOCTTY)


def at_terminal() -> Asking | None:
    """Standard input, where it is a terminal that this process may read."""
    if sys.stdin is None:  # it was closed before the program began
        return None
    try:
        fd = sys.stdin.fileno()
        return Asking(fd) if os.isatty(fd) and os.tcgetpgrp(fd) == os.getpgrp() else None
    except (OSError, ValueError):
        return None


def in_foreground(fd: int) -> bool:
    """Whether this process may read the terminal now: in the background a read would stop it."""
    try:
        return os.tcgetpgrp(fd) == os.getpgrp()
    except OSError:
        return True  # the terminal is gone, which reading reports


def someone(asking: Asking | None, whether: str, remedy: str) -> Asking:
    """Who can be asked. NotAgreedError where nobody can: an answer from a file or pipe was written before the question.

    `whether`: what is asked, `remedy`: the option that goes without.
    """
    if asking is None:
        raise NotAgreedError(
            f"nobody can be asked {whether}: standard input is not a terminal, or the program runs in the background; "
            f"run it in the foreground of a terminal, or {remedy}"
        )
    return asking


def short(text: str) -> str:
    """What was typed, in quotes, for a message."""
    return repr(text if len(text) <= 20 else f"{text[:20]}…")


def _numbers(answer: str) -> tuple[float, ...]:
    try:
        values = tuple(float(word) for word in answer.replace(",", " ").split())
    except ValueError:
        return ()
    return values if all(map(math.isfinite, values)) else ()
