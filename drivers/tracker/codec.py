"""Bytes of a line-based instrument to readings; no input or output. Line ends may be LF, CR or both."""

from dataclasses import dataclass

from drivers.tracker.layout import LineRefusedError, Parse, TargetReading

LONGEST = 2048  # bytes of a line: nothing that a stranger sends may grow without end
SHOWN = 48  # bytes of a refused line that are kept


@dataclass(frozen=True)
class BadLine:
    """A line that is none of the declared layout."""

    offset: int  # of its first byte, since the connection began
    reason: str
    first: bytes


class LineCodec:
    """Cuts lines out of any split of bytes. `midway`: it may have joined in the middle of a line, which is dropped.

    The rest of a line can read as a good one (of 1523.2 may be left 23.2), so that it must not be used.
    """

    def __init__(self, parse: Parse, *, midway: bool = False) -> None:
        self._parse = parse
        self._begun = b""
        self._dropping = midway
        self._offset = 0  # of the first byte of `_begun`

    def feed(self, data: bytes) -> list[TargetReading | BadLine]:
        """The lines that ended in these bytes; empty ones are left out."""
        *ended, rest = (self._begun + data).replace(b"\r", b"\n").split(b"\n")
        found: list[TargetReading | BadLine] = []
        for line in ended:
            if self._dropping:
                self._dropping = False
            elif line.strip():
                found.append(self._read(line))
            self._offset += len(line) + 1
        if len(rest) > LONGEST or self._dropping:
            if not self._dropping:
                found.append(BadLine(self._offset, f"no line end within {LONGEST} bytes", rest[:SHOWN]))
            self._offset += len(rest)
            self._dropping, rest = True, b""
        self._begun = rest
        return found

    def _read(self, line: bytes) -> TargetReading | BadLine:
        if len(line) > LONGEST:
            return BadLine(self._offset, f"a line of {len(line)} bytes", line[:SHOWN])
        try:
            return self._parse(line.decode("ascii"))
        except UnicodeDecodeError:
            return BadLine(self._offset, "not text", line[:SHOWN])
        except LineRefusedError as why:
            return BadLine(self._offset, str(why), line[:SHOWN])
