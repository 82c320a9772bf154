"""Script ports 30001, 30002, 30003: take URScript text and hand it to the controller, and stream its state."""

from collections.abc import Callable

MAX_TEXT_BYTES = 1 << 20  # a control script has 42 kB; what grows beyond this is no script


class ScriptWire:
    """One client's connection. A program is complete with a line `end` at column 0, a bare call with its line."""

    def __init__(self, run: Callable[[str], None], stream: Callable[[], bytes] = bytes) -> None:
        """`run` gets each complete program or line; it never raises. `stream`: what is to be sent this cycle."""
        self._run, self._stream = run, stream
        self.closing = False
        self._line = bytearray()
        self._program: list[str] = []
        self._size = 0

    def handle(self, data: bytes) -> bytes:
        *lines, rest = (bytes(self._line) + data).split(b"\n")
        self._line = bytearray(rest)
        self._size += len(data)
        for line in lines:
            self._take(line.decode("utf-8", errors="replace").rstrip("\r"))
        if self._size > MAX_TEXT_BYTES:
            self._forget()
        return b""

    def due(self) -> bytes:
        return self._stream()

    def _take(self, line: str) -> None:
        if self._program:
            self._program.append(line)
            if line == "end":
                self._run("\n".join(self._program))
                self._forget()
        elif line.startswith("def "):
            self._program = [line]
        elif line.strip():
            self._run(line.strip())
            self._size = len(self._line)

    def _forget(self) -> None:
        self._program.clear()
        if self._size > MAX_TEXT_BYTES:
            self._line.clear()
        self._size = len(self._line)
