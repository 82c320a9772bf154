"""A person at a pseudo-terminal: types what was agreed when a text comes up on the screen."""

import os
import pty
import select
import threading
import time

PATIENCE_S = 30.0


class Typist:
    """`terminal`: the file descriptor at which the program asks. Closed by `close`."""

    def __init__(self) -> None:
        self._ours, self.terminal = pty.openpty()
        self._script: list[tuple[str, str]] = []
        self._read, self._over = "", threading.Event()
        self._thread = threading.Thread(target=self._sit, daemon=True)
        self._thread.start()

    def ahead(self, text: str) -> None:
        """Types whole lines now; returns when they can be read by whoever reads next."""
        os.write(self._ours, text.encode())
        assert select.select([self.terminal], [], [], PATIENCE_S)[0]

    def answers(self, cue: str, *texts: str) -> None:
        """Types one text each time when the cue has come up."""
        self._script += [(cue, text) for text in texts]

    @property
    def screen(self) -> str:
        return self._read

    @property
    def asked(self) -> int:
        """How many answers are still to be given."""
        return len(self._script)

    def shows(self, text: str) -> bool:
        """Whether it comes up on the screen."""
        until_s = time.monotonic() + PATIENCE_S
        while text not in self._read and time.monotonic() < until_s:
            self._over.wait(0.01)
        return text in self._read

    def leave(self) -> None:
        """The terminal is closed at the person's end."""
        self._over.set()
        self._thread.join()
        if self._ours >= 0:
            os.close(self._ours)
        self._ours = -1

    def close(self) -> None:
        self.leave()
        os.close(self.terminal)

    def _sit(self) -> None:
        seen = 0
        while not self._over.is_set():
            if select.select([self._ours], [], [], 0.02)[0]:
                self._read += os.read(self._ours, 4096).decode(errors="replace")
            while self._script and (at := self._read.find(self._script[0][0], seen)) >= 0:
                cue, text = self._script.pop(0)
                seen = at + len(cue)
                os.write(self._ours, text.encode())
