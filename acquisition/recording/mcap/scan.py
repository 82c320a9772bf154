"""Every readable record of an MCAP file, in file order, however the file ends.

Reads from the front, because the index at the end is missing when a session was killed. Layout of the records:
https://mcap.dev/spec. A batch whose checksum is wrong is left out and told; the batches after it are still
read, also where the length of a record is damaged and the next batch must be searched for, or the disk gives no bytes.
"""

import struct
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import IO

import zstandard
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, DataEnd, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from acquisition.recording.errors import RecordingError
from acquisition.recording.mcap_search import next_batch

# What the parser raises on bytes that make no sense; CRC errors are ValueErrors. OSError: the disk refuses to read.
DAMAGE = (
    OSError,
    McapError,
    ValueError,
    struct.error,
    zstandard.ZstdError,
    RuntimeError,
    KeyError,
    OverflowError,
    MemoryError,
)


Content = Header | Schema | Channel | Message | Metadata


class Scan:
    """One pass over a file; `damage` says afterwards what could not be read, `whole` whether the end was reached."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.damage: list[str] = []
        self.whole = False

    def records(self) -> Iterator[Content]:
        """The records that carry content: header, metadata, and what stands in batches.

        RecordingError if the file is missing, empty or not MCAP.
        """
        try:
            with self._path.open("rb") as file:
                size = file.seek(0, 2)
                file.seek(0)
                _check_magic(self._path, file.read(8), size)
                file.seek(0)
                yield from self._contents(file, size)
        except OSError as error:
            raise RecordingError(
                f"{self._path}: cannot read the recording ({error.strerror}); check the path"
            ) from error

    def _contents(self, file: IO[bytes], size: int) -> Iterator[Content]:
        """Piece by piece: after bytes that make no sense the reading goes on at the next batch, if there is one."""
        begin: int | None = 0
        while begin is not None:
            file.seek(begin)
            failed_at = yield from self._piece(file, size, first=begin == 0)
            begin = None if failed_at is None else next_batch(file, failed_at + 1, size)

    def _piece(self, file: IO[bytes], size: int, *, first: bool) -> Generator[Content, None, int | None]:
        """Records from here on; where they make no sense any more, or None at the end."""
        reader = StreamReader(file, skip_magic=not first, emit_chunks=True, validate_crcs=True, record_size_limit=size)
        records = iter(reader.records)
        in_summary = False  # what follows the data repeats it
        while True:
            at = file.tell()
            try:
                record = next(records)
            except StopIteration:
                self.whole = True
                return None
            except DAMAGE as error:
                self.damage.append(f"byte {at} of {size}: {_says(error)}; everything before it was read")
                return at
            if isinstance(record, Chunk):
                yield from self._chunk(record, at)
            elif isinstance(record, DataEnd):
                in_summary = True
            elif isinstance(record, Header | Metadata) and not in_summary:
                yield record

    def _chunk(self, chunk: Chunk, at: int) -> Iterator[Schema | Channel | Message]:
        try:
            records: list[McapRecord] = breakup_chunk(chunk, validate_crc=True)
        except DAMAGE as error:
            self.damage.append(f"byte {at}: a batch is damaged ({_says(error)}) and was left out")
            return
        for record in records:
            if isinstance(record, Schema | Channel | Message):
                yield record


def _check_magic(path: Path, start: bytes, size: int) -> None:
    if start != b"\x89MCAP0\r\n":
        what = "the file is empty" if size == 0 else f"the file begins with {start[:8]!r}, not with MCAP's signature"
        raise RecordingError(f"{path}: not a recording: {what}; give a recording or a session folder")


def _says(error: BaseException) -> str:
    if isinstance(error, OSError):
        return f"the disk cannot read it ({error.strerror or error})"
    if isinstance(error, EndOfFile | struct.error):  # the parser's words for a record that is shorter than it says
        return "the file ends too early"
    return str(error) or type(error).__name__
