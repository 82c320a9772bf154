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
from acquisition.motion.states import MotionState
from calibeam.asking import Asking, at_terminal
from calibeam.interrupts import INTERRUPTS
from drivers.errors import DeviceError

WORDS = "r resume, s stop, a abort, h halt, then ENTER"


class Keys:
    """What was pressed, told to the gate."""

    def __init__(self, gate: Gate, asking: Asking | None, out: TextIO) -> None:
        self._gate, self._asking, self._out = gate, asking, out
        self._thread: threading.Thread | None = None

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
        print(f"\n{told}", file=self._out, flush=True)
        self._ask()

    def ended(self) -> None:
        """The process shall end."""
        self._gate.abort()

    def word(self, text: str) -> None:
        """One line of the keyboard."""
        word = text.strip().lower()
        ends = {"s": self._gate.stop, "a": self._gate.abort, "h": self._gate.halt}
        act = self._gate.resume if word in ("r", "resume") else ends.get(word[:1])
        if act is None:
            return  # asked again, with the words that there are
        try:
            act()
        except DeviceError as error:
            print(f"{error}", file=self._out, flush=True)

    def _held(self) -> bool:
        return self._gate.state is MotionState.HELD

    def _ask(self) -> None:
        if self._asking is not None and (self._thread is None or not self._thread.is_alive()):
            self._thread = threading.Thread(target=self._listen, args=(self._asking,), name="keys", daemon=True)
            self._thread.start()

    def _listen(self, asking: Asking) -> None:
        """Until the motion goes on or ends; the end of input means nothing, for Ctrl-C is still heard."""

        def over() -> bool:
            return self._gate.state not in (MotionState.HELD, MotionState.PAUSING)

        while not over():
            line = asking.ask(WORDS, "> ", over)
            if line is not None:
                self.word(line)
            elif not over():
                return


@contextmanager
def keys_of(gate: Gate) -> Generator[Keys]:
    """Inside, Ctrl-C and SIGTERM speak to the gate instead of ending the program."""
    keys = Keys(gate, at_terminal(), sys.stderr)

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
