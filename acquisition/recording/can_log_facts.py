"""What python-can's readers leave out of a CAN log, or take for granted: lines of frames, and zones of start times.

Sources: can/io/asc.py and can/io/blf.py of python-can 4.6; its issues 1992 and 2010: CANoe writes local times into BLF.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

# "application" in a BLF header (Vector, binlog_objects.h): CANalyzer, CANoe, CANlog, CANcaseXL log; python-can writes 5
VECTOR_TOOLS = (1, 2, 4, 6)
BLF_APPLICATION = 8  # byte of the header
ASC_HEAD = 400  # bytes with the line "// version" of Vector's tools, which python-can does not write
EVENT = re.compile(r"\s*[\d.]+\s")  # begins with a time: no line of the header
FRAME = re.compile(
    r"\s*[\d.]+\s+(\d+\s+([0-9a-f]+x?\s+(tx|rx)\s+[dr]\b|errorframe)|canfd\s+\d+\s+(tx|rx)\b)", re.IGNORECASE
)
RELATIVE = re.compile(r"^\s*base\s+\w+\s+timestamps\s+relative", re.IGNORECASE | re.MULTILINE)


class AscLines:
    """A text file for python-can's ASC reader, which drops the line that ends the header: an empty one here."""

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self._lines = self._with_end_of_header()

    def __iter__(self) -> Iterator[str]:
        return self._lines  # one: the reader takes up behind the header where it stopped

    def _with_end_of_header(self) -> Iterator[str]:
        in_header = True
        for line in self._file:
            if in_header and EVENT.match(line):
                in_header = False
                yield "\n"
            yield line

    def close(self) -> None:
        self._file.close()


def remarks_of(path: Path, frames: int | None) -> Iterator[str]:
    """What must be known of the times of a log, and of lines that were not read.

    `frames`: how many were read of the whole file; None where it could not be read to its end. OSError.
    """
    suffix = path.suffix.lower()
    if suffix == ".blf":
        yield _blf_zone(path)
    if suffix != ".asc":
        return
    with path.open("rb") as file:
        head = file.read(ASC_HEAD).decode("latin-1")
    yield (
        "the start time of an ASC log has no time zone; it is taken for the time zone of this computer: correct it "
        "where the log was recorded in another one"
    )
    if RELATIVE.search(head):
        yield (
            "its times count from line to line, and are taken as if they counted from the start; export it with "
            '"timestamps absolute"'
        )
    if frames is not None:
        yield from _unread(path, frames)


def by_vector(path: Path) -> bool:
    """Whether one of Vector's tools wrote a BLF or ASC log. OSError."""
    with path.open("rb") as file:
        head = file.read(ASC_HEAD)
    if path.suffix.lower() == ".blf":
        return len(head) > BLF_APPLICATION and head[BLF_APPLICATION] in VECTOR_TOOLS
    return path.suffix.lower() == ".asc" and b"// version" in head


def _blf_zone(path: Path) -> str:
    if by_vector(path):
        return (
            "the start time of this BLF log is the local time of the computer that recorded it, and is taken for UTC: "
            "its date may be hours off; differences of times are not"
        )
    return "the start time of a BLF log states no zone, and is taken for UTC, as python-can writes it"


def _unread(path: Path, frames: int) -> Iterator[str]:
    """Lines of frames beside the frames that were read; the first that python-can's pattern does not take is named."""
    lines, first = 0, 0
    with path.open(encoding="latin-1") as file:
        for number, line in enumerate(file, start=1):
            if FRAME.match(line):
                lines += 1
                if not first and not re.match(r"\s*\d+\.\d+\s", line):
                    first = number
    if lines > frames:
        where = f", the first in line {first}" if first else ""
        was = "was" if lines - frames == 1 else "were"
        yield f"{lines - frames} of {lines} lines of frames {was} not read{where}; export the log as BLF"
