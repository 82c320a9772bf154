"""The SDO server of a node: object dictionary over 8-byte frames, expedited and segmented.

Source: CiA 301 (4.2.0) section 7.2.4.3. Does not imitate: block transfer (refused with 05040001h, as small encoders
do), the time-out of a transfer that a client left half done (the next initiate ends it).
"""

import struct
from dataclasses import dataclass

from simulators.encoders.object_dictionary import AbortCode, NodeDictionary, SdoAbort

SEGMENT_BYTES = 7
LONGEST_DOWNLOAD = 256  # bytes; nothing in the dictionary is longer
CLIENT_SEGMENT_DOWN, CLIENT_DOWNLOAD, CLIENT_UPLOAD, CLIENT_SEGMENT_UP, CLIENT_ABORT = range(5)  # command specifiers
UPLOAD_EXPEDITED, UPLOAD_SEGMENTED, DOWNLOAD_DONE, SEGMENT_STORED, ABORT = 0x43, 0x41, 0x60, 0x20, 0x80
TOGGLE, LAST, EXPEDITED, SIZE_GIVEN = 0x10, 0x01, 0x02, 0x01


@dataclass
class _Transfer:
    """A segmented transfer under way: what is still to go up, or what has come down."""

    index: int
    subindex: int
    up: bool
    data: bytes
    toggle: int = 0


class SdoServer:
    """Requests of 8 bytes to answers of 8 bytes; None where the protocol has no answer."""

    def __init__(self, dictionary: NodeDictionary) -> None:
        self._dictionary = dictionary
        self._transfer: _Transfer | None = None

    def answer(self, request: bytes) -> bytes | None:
        if len(request) != 8:
            return None  # CiA 301: an SDO always has 8 bytes; others are not for us
        command = request[0] >> 5
        index, subindex = struct.unpack_from("<HB", request, 1)
        if command in (CLIENT_SEGMENT_UP, CLIENT_SEGMENT_DOWN) and self._transfer is not None:
            index, subindex = self._transfer.index, self._transfer.subindex
        try:
            return self._do(command, request, index, subindex)
        except SdoAbort as refusal:
            self._transfer = None
            return struct.pack("<BHBI", ABORT, index, subindex, refusal.code)

    def reset(self) -> None:
        self._transfer = None

    def _do(self, command: int, request: bytes, index: int, subindex: int) -> bytes | None:
        match command:
            case _ if command == CLIENT_UPLOAD:
                return self._upload(index, subindex)
            case _ if command == CLIENT_DOWNLOAD:
                return self._download(request, index, subindex)
            case _ if command == CLIENT_SEGMENT_UP:
                return self._segment_up(request[0])
            case _ if command == CLIENT_SEGMENT_DOWN:
                return self._segment_down(request)
            case _ if command == CLIENT_ABORT:
                self._transfer = None
                return None
            case _:
                raise SdoAbort(AbortCode.UNKNOWN_COMMAND)

    def _upload(self, index: int, subindex: int) -> bytes:
        data = self._dictionary.read(index, subindex)
        self._transfer = None
        if 1 <= len(data) <= 4:
            unused = 4 - len(data)
            return struct.pack("<BHB", UPLOAD_EXPEDITED | unused << 2, index, subindex) + data.ljust(4, b"\0")
        self._transfer = _Transfer(index, subindex, True, data)
        return struct.pack("<BHBI", UPLOAD_SEGMENTED, index, subindex, len(data))

    def _segment_up(self, head: int) -> bytes:
        transfer = self._under_way(True, head)
        segment, transfer.data = transfer.data[:SEGMENT_BYTES], transfer.data[SEGMENT_BYTES:]
        unused = SEGMENT_BYTES - len(segment)
        answer = transfer.toggle | unused << 1 | (0 if transfer.data else LAST)
        transfer.toggle ^= TOGGLE
        if not transfer.data:
            self._transfer = None
        return bytes((answer,)) + segment.ljust(SEGMENT_BYTES, b"\0")

    def _download(self, request: bytes, index: int, subindex: int) -> bytes:
        head = request[0]
        self._transfer = None
        if head & EXPEDITED:
            size = 4 - (head >> 2 & 3) if head & SIZE_GIVEN else self._size(index, subindex)
            self._dictionary.write(index, subindex, request[4 : 4 + size])
        else:
            self._transfer = _Transfer(index, subindex, False, b"")
        return struct.pack("<BHBI", DOWNLOAD_DONE, index, subindex, 0)

    def _segment_down(self, request: bytes) -> bytes:
        transfer = self._under_way(False, request[0])
        unused = request[0] >> 1 & 7
        transfer.data += request[1 : 8 - unused]
        if len(transfer.data) > LONGEST_DOWNLOAD:
            raise SdoAbort(AbortCode.WRONG_LENGTH)
        answer = SEGMENT_STORED | transfer.toggle
        transfer.toggle ^= TOGGLE
        if request[0] & LAST:
            self._transfer = None
            self._dictionary.write(transfer.index, transfer.subindex, transfer.data)
        return bytes((answer,)).ljust(8, b"\0")

    def _under_way(self, up: bool, head: int) -> _Transfer:
        if self._transfer is None or self._transfer.up is not up:
            raise SdoAbort(AbortCode.UNKNOWN_COMMAND)
        if head & TOGGLE != self._transfer.toggle:
            raise SdoAbort(AbortCode.TOGGLE)
        return self._transfer

    def _size(self, index: int, subindex: int) -> int:
        """Bytes of an object whose writer gave no size: those that the dictionary says."""
        entry = self._dictionary.entries.get((index, subindex))
        return 4 if entry is None or entry.size is None else entry.size
