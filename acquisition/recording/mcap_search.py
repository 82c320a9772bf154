"""Where in damaged bytes the next batch may begin.

A chunk record is 06, its length, start, end, uncompressed size (8 bytes each), CRC (4), and the name of its compression
with a length before it: https://mcap.dev/spec, "Chunk". Whatever is found is proved or refused by its checksum.
"""

import struct
from typing import IO

_MARK = b"\x04\x00\x00\x00zstd"  # the only compression that this program writes
_BEFORE = 1 + 4 * 8 + 4  # bytes of a chunk record before the mark
_CHUNK = 0x06
_BLOCK = 2**20


def next_batch(file: IO[bytes], begin: int, size: int) -> int | None:
    """The place of the first record from `begin` on that looks like a chunk and fits into the file; None: no more."""
    at = begin
    while at < size:
        file.seek(at)
        block = file.read(_BLOCK + _BEFORE + len(_MARK))
        mark = block.find(_MARK, _BEFORE)
        while mark >= 0:
            start = mark - _BEFORE
            if _fits(block[start:mark], size - at - start):
                return at + start
            mark = block.find(_MARK, mark + 1)
        at += _BLOCK
    return None


def _fits(head: bytes, left: int) -> bool:
    opcode, length = struct.unpack_from("<BQ", head)
    return opcode == _CHUNK and 9 + length <= left
