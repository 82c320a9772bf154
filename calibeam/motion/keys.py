"""Ctrl-C and words at the keyboard while the arm moves: pause, hold, abort; resume, stop, halt.

First Ctrl-C: rest at the next place, or brake along the path where that is further than a second. Again: brake, where
it does not brake yet, then give up. SIGTERM and a closed terminal give up at once. While the motion is held a line is
read: r resume, s stop, a abort, h halt.
"""

import signal
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType
from typing import TextIO

from acquisition.motion.gate import Gate
from acquisition.motion.states import State
from calibeam.interrupts import INTERRUPTS
from drivers.errors import DeviceError

WORDS = "held: r resume, s stop, a abort, h halt; then Enter"


class Keys:
    """What was pressed, told to the gate."""

    def __init__(self, gate: Gate, words: TextIO, out: TextIO) -> None:
        self._gate, self._words, self._out = gate, words, out
        self._asking: threading.Thread | None = None

    def interrupted(self) -> None:
        """Ctrl-C."""
        if self._held():
            self._gate.abort()
            return
        self._gate.pause()
        if self._held():
            told = (
                f"braking along the path, at rest within {self._gate.brake_s:.1f} s; Ctrl-C again gives the motion up"
            )
        else:
            told = f"resting at the next place within {self._gate.rests_in_s():.1f} s; Ctrl-C again brakes now"
        print(f"\n{told}. {WORDS}", file=self._out, flush=True)
        self._ask()

    def ended(self) -> None:
        """The process shall end."""
        self._gate.abort()

    def word(self, text: str) -> None:
        """One line of the keyboard."""
        said = {"r": self._gate.resume, "s": self._gate.stop, "a": self._gate.abort, "h": self._gate.halt}
        act = said.get(text.strip().lower()[:1])
        if act is None:
            print(WORDS, file=self._out, flush=True)
            return
        try:
            act()
        except DeviceError as error:
            print(f"{error}", file=self._out, flush=True)

    def _held(self) -> bool:
        return self._gate.state is State.HELD

    def _ask(self) -> None:
        if self._asking is None or not self._asking.is_alive():
            self._asking = threading.Thread(target=self._listen, name="keys", daemon=True)
            self._asking.start()

    def _listen(self) -> None:
        """Until the motion goes on or ends; end of input says nothing, Ctrl-C still does."""
        while self._gate.state in (State.HELD, State.PAUSING):
            line = self._words.readline()
            if not line:
                return
            self.word(line)


@contextmanager
def keys_of(gate: Gate) -> Generator[Keys]:
    """Inside, Ctrl-C and SIGTERM speak to the gate instead of ending the program."""
    keys = Keys(gate, sys.stdin, sys.stderr)

    def interrupt(number: int, frame: FrameType | None) -> None:
        keys.interrupted()

    def end(number: int, frame: FrameType | None) -> None:
        if number == signal.SIGHUP:
            INTERRUPTS.leave_terminal()
        keys.ended()

    before = {
        signal.SIGINT: signal.signal(signal.SIGINT, interrupt),
        signal.SIGTERM: signal.signal(signal.SIGTERM, end),
        signal.SIGHUP: signal.signal(signal.SIGHUP, end),
    }
    try:
        yield keys
    except BaseException:
        INTERRUPTS.close()  # the arm stands, or was told to stop; what is left is to release it
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
