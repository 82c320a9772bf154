"""Where in damaged bytes the next batch may begin.

A chunk record is 06, its length, start, end, uncompressed size (8 bytes each), CRC (4), and the name of its compression
with a length before it: https://mcap.dev/spec, "Chunk". Whatever is found is proved or refused by its checksum.
"""

import struct
from collections.abc import Iterator
from contextlib import suppress
from typing import IO

_MARK = b"\x04\x00\x00\x00zstd"  # the only compression that this program writes
_BEFORE = 1 + 4 * 8 + 4  # bytes of a chunk record before the mark
_CHUNK = 0x06
_BLOCK = 2**20
_SECTOR = 4096  # what a disk that has gone bad in places refuses at a time
UNREADABLE_MOST = 64  # sectors in a row: a disk that refuses more has failed, and every try may take it seconds


def next_batch(file: IO[bytes], begin: int, size: int) -> int | None:
    """The place of the first record from `begin` on that looks like a chunk and fits into the file; None: no more.

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
