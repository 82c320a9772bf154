"""Every readable record of an MCAP file, in file order, however the file ends.

Reads from the front, because the index at the end is missing when a session was killed. Layout of the records:
https://mcap.dev/spec. A batch whose checksum is wrong is left out and reported; the batches after it are still
read, also where the length of a record is damaged and the next batch must be searched for, or the disk gives no bytes.

The search for the next batch in damaged bytes: a chunk record is 06, its length, start, end, uncompressed size (8 bytes
each), CRC (4), and the name of its compression with a length before it: https://mcap.dev/spec, "Chunk". Whatever is
found is proved or refused by its checksum.
"""

import struct
from collections.abc import Generator, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import IO

import lz4.frame
import zstandard
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, DataEnd, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from acquisition.recording.errors import RecordingError
from acquisition.recording.files.bounds import BATCH_BYTES, MESSAGES, UNPACKED_BYTES

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


METADATA_TIMES = 16  # as much memory as bytes, where keys and values are short
ContentRecord = Header | Schema | Channel | Message | Metadata


class Scan:
    """One pass over a file; `damage` states afterwards what could not be read, `whole` whether the end was reached."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._bytes, self._messages = UNPACKED_BYTES, MESSAGES  # that may still be read
        self.damage: list[str] = []
        self.whole = False

    def records(self) -> Iterator[ContentRecord]:
        """The records that carry content: header, metadata, and what stands in batches.

        RecordingError if the file is missing, empty or not MCAP.
        """
        try:
            with self._path.open("rb") as file:
                size = file.seek(0, 2)
                self._bytes, self._messages = max(UNPACKED_BYTES, 8 * size), max(MESSAGES, size // 32)
                file.seek(0)
                _check_magic(self._path, file.read(8), size)
                file.seek(0)
                yield from self._contents(file, size)
        except OSError as error:
            raise RecordingError(
                f"{self._path}: cannot read the recording ({error.strerror}); check the path"
            ) from error

    def _contents(self, file: IO[bytes], size: int) -> Iterator[ContentRecord]:
        """Piece by piece: after bytes that make no sense the reading goes on at the next batch, if there is one."""
        begin: int | None = 0
        while begin is not None:
            file.seek(begin)
            failed_at = yield from self._piece(file, size, first=begin == 0)
            begin = None if failed_at is None else next_batch(file, failed_at + 1, size)

    def _piece(self, file: IO[bytes], size: int, *, first: bool) -> Generator[ContentRecord, None, int | None]:
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
                self._bytes -= METADATA_TIMES * (file.tell() - at)
                if self._bytes < 0:
                    self.damage.append(f"byte {at} of {size}: metadata of more than a recording has; it was left out")
                    continue
                yield record

    def _chunk(self, chunk: Chunk, at: int) -> Iterator[Schema | Channel | Message]:
        try:
            plain = unpacked(chunk, min(BATCH_BYTES, self._bytes))
            self._bytes -= len(plain.data)
            self._messages -= _count(plain.data)
            if self._messages < 0:
                raise ValueError("the batches up to here hold more messages than a recording of this size")
            records: list[McapRecord] = breakup_chunk(plain, validate_crc=True)
        except DAMAGE as error:
            self.damage.append(f"byte {at}: a batch is damaged ({_says(error)}) and was left out")
            return
        for record in records:
            if isinstance(record, Schema | Channel | Message):
                yield record


def check_batches(path: Path) -> None:
    """ValueError for an MCAP file of which a batch, or all together, unpack to more than the bounds."""
    left = max(UNPACKED_BYTES, 8 * path.stat().st_size)
    with path.open("rb") as file:
        for record in StreamReader(file, emit_chunks=True, record_size_limit=path.stat().st_size).records:
            if isinstance(record, Chunk):
                left -= len(unpacked(record, min(BATCH_BYTES, left)).data)


def unpacked(chunk: Chunk, most: int) -> Chunk:
    """The batch without its compression; ValueError, before it is unpacked, where it is larger than `most` bytes."""
    size, data = max(chunk.uncompressed_size, len(chunk.data)), chunk.data
    if chunk.compression == "zstd":
        size = max(size, zstandard.frame_content_size(data))  # what the library goes by, where the frame states one
    if size > most:
        raise ValueError(f"{size / 1e6:.0f} MB when unpacked, at most {most / 1e6:.0f} MB are read here")
    if chunk.compression == "zstd":
        data = zstandard.decompress(data, max_output_size=chunk.uncompressed_size)
    elif chunk.compression == "lz4":
        data = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=chunk.uncompressed_size)
    return replace(chunk, compression="", data=data)


def _count(data: bytes) -> int:
    """Records of an unpacked batch, each 9 bytes and its content."""
    at = count = 0
    while at + 9 <= len(data):
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")
        count += 1
    return count


def _check_magic(path: Path, start: bytes, size: int) -> None:
    if start != b"\x89MCAP0\r\n":
        what = "the file is empty" if size == 0 else f"the file begins with {start[:8]!r}, not with MCAP's signature"
        raise RecordingError(f"{path}: not a recording: {what}; give a recording or a session folder")


def _says(error: BaseException) -> str:
    if isinstance(error, OSError):
        return f"the disk cannot read it ({error.strerror or error})"
    if isinstance(error, EndOfFile | struct.error):  # the parser's words for a record that is shorter than it states
        return "the file ends too early"
    return str(error) or type(error).__name__


_MARK = b"\x04\x00\x00\x00zstd"  # the only compression that this program writes
_BEFORE = 1 + 4 * 8 + 4  # bytes of a chunk record before the mark
_CHUNK = 0x06
_BLOCK = 2**20
_SECTOR = 4096  # what a disk that has gone bad in places refuses at a time
UNREADABLE_MOST = 64  # sectors in a row: a disk that refuses more has failed, and every try may take it seconds


def next_batch(file: IO[bytes], begin: int, size: int) -> int | None:
    """The place of the first record from `begin` on that resembles a chunk and fits into the file; None: no more.

    What the disk does not give is left out; behind UNREADABLE_MOST sectors in a row nothing more is tried.
    """
    at, refused = begin, 0
    while at < size and refused < UNREADABLE_MOST:
        wanted = min(_BLOCK + _BEFORE + len(_MARK), size - at)
        block = _readable(file, at, wanted)
        mark = block.find(_MARK, _BEFORE)
        while mark >= 0:
            start = mark - _BEFORE
            if _fits(block[start:mark], size - at - start):
                return at + start
            mark = block.find(_MARK, mark + 1)
        if len(block) == wanted:
            at, refused = at + _BLOCK, 0
        else:
            at = ((at + len(block)) // _SECTOR + 1) * _SECTOR
            refused = 1 if block else refused + 1
    return None


def _readable(file: IO[bytes], at: int, count: int) -> bytes:
    """`count` bytes from `at`; where the disk refuses some of them, those before the first sector that it refuses."""
    try:
        file.seek(at)
        return file.read(count)
    except OSError:
        return b"".join(_sectors(file, at, at + count))


def _sectors(file: IO[bytes], begin: int, end: int) -> Iterator[bytes]:
    at = begin
    with suppress(OSError):
        while at < end:
            file.seek(at)
            yield file.read(min(_SECTOR - at % _SECTOR, end - at))
            at += _SECTOR - at % _SECTOR


def _fits(head: bytes, left: int) -> bool:
    opcode, length = struct.unpack_from("<BQ", head)
    return opcode == _CHUNK and 9 + length <= left
