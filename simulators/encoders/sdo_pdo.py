"""The SDO server of a node and its transmit PDOs: what they carry, when they are sent, how both are changed over SDO.

SDO: object dictionary over 8-byte frames, expedited and segmented. Source: CiA 301 (4.2.0) section 7.2.4.3. Does not
imitate: block transfer (refused with 05040001h, as small encoders do), the time-out of a transfer that a client left
half done (the next initiate ends it).

PDO: source: CiA 301 (4.2.0) sections 7.5.2.35 (18xxh) and 7.5.2.36 (1Axxh). Does not imitate: inhibit time, remote
request, transmission type 0, sending on a change of value (types 254 and 255 follow their event timer only).
"""

import struct
from dataclasses import dataclass
from functools import partial

from simulators.encoders.bus import CanFrame
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
        """Bytes of an object whose writer gave no size: those that the dictionary states."""
        entry = self._dictionary.entries.get((index, subindex))
        return 4 if entry is None or entry.size is None else entry.size


INVALID = 1 << 31
EXTENDED_ID = 1 << 29
SYNCHRONOUS = range(1, 241)
EVENT_TYPES = (254, 255)
MAX_ENTRIES = 4
PDO_BITS = 64
TIMER_SLACK_S = 1e-6  # sums of seconds in floating point are not exact; far below the timers' millisecond


class TransmitPdo:
    """TPDO `number` (1, 2, ...) of the node that has `dictionary`."""

    def __init__(self, number: int, dictionary: NodeDictionary) -> None:
        self._dictionary = dictionary
        self._communication = 0x1800 + number - 1
        self._mapping = 0x1A00 + number - 1
        self._syncs = 0
        self._next_event_s: float | None = None
        self._known = -1  # change of the dictionary up to which the next line holds
        self._period_s = 0.0  # of the event timer; 0: nothing is sent by time
        dictionary.on_write(self._communication, 1, self._accept_cob_id)
        dictionary.on_write(self._communication, 2, self._accept_type)
        dictionary.on_write(self._communication, 5, self._accept_timer)
        dictionary.on_write(self._mapping, 0, self._accept_count)
        for entry in range(1, MAX_ENTRIES + 1):
            dictionary.on_write(self._mapping, entry, partial(self._accept_entry, entry))

    def start(self, now_s: float) -> None:
        """The node becomes operational: count SYNCs from zero, first event now."""
        self._syncs = 0
        self._next_event_s = now_s

    def on_sync(self) -> CanFrame | None:
        """The frame, when this is the n-th SYNC of type n."""
        kind = self._type
        if kind not in SYNCHRONOUS or not self._valid:
            return None
        self._syncs += 1
        if self._syncs < kind:
            return None
        self._syncs = 0
        return self._frame()

    def on_time(self, now_s: float) -> CanFrame | None:
        """The frame, when the event timer of an event-driven PDO has run off."""
        if self._known != self._dictionary.changes:
            self._known, self._period_s = self._dictionary.changes, self._event_period_s()
        period_s = self._period_s
        if period_s == 0.0:
            return None
        if self._next_event_s is None or self._next_event_s > now_s + TIMER_SLACK_S:
            self._next_event_s = now_s + period_s if self._next_event_s is None else self._next_event_s
            return None
        self._next_event_s = max(self._next_event_s + period_s, now_s)
        return self._frame()

    def _event_period_s(self) -> float:
        timed = self._type in EVENT_TYPES and self._valid
        return self._dictionary.number(self._communication, 5) * 1e-3 if timed else 0.0

    @property
    def _type(self) -> int:
        return self._dictionary.number(self._communication, 2)

    @property
    def _valid(self) -> bool:
        return not self._dictionary.number(self._communication, 1) & INVALID

    def _frame(self) -> CanFrame:
        count = self._dictionary.number(self._mapping, 0)
        mapped = (self._dictionary.number(self._mapping, entry) for entry in range(1, count + 1))
        data = b"".join(self._dictionary.data(word >> 16, word >> 8 & 0xFF) for word in mapped)
        return CanFrame(self._dictionary.number(self._communication, 1) & 0x7FF, data)

    # --- writes over SDO

    def _accept_cob_id(self, cob_id: int) -> None:
        if cob_id & EXTENDED_ID:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        now = self._dictionary.number(self._communication, 1)
        if self._valid and not cob_id & INVALID and (cob_id ^ now) & 0x7FF:
            raise SdoAbort(AbortCode.INVALID_VALUE)  # the identifier may change only while the PDO is invalid

    def _accept_type(self, kind: int) -> None:
        if kind not in SYNCHRONOUS and kind not in EVENT_TYPES:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        self._syncs = 0

    def _accept_timer(self, period_ms: int) -> None:
        self._next_event_s = None  # the new period counts from the next reading of the clock

    def _accept_entry(self, entry: int, word: int) -> None:
        if self._valid or self._dictionary.number(self._mapping, 0) != 0:
            raise SdoAbort(AbortCode.WRONG_STATE)
        if word != 0:
            self._bits(word)

    def _accept_count(self, count: int) -> None:
        if self._valid:
            raise SdoAbort(AbortCode.WRONG_STATE)
        if count > MAX_ENTRIES:
            raise SdoAbort(AbortCode.TOO_HIGH)
        words = [self._dictionary.number(self._mapping, entry) for entry in range(1, count + 1)]
        if sum(self._bits(word) for word in words) > PDO_BITS:
            raise SdoAbort(AbortCode.PDO_TOO_LONG)

    def _bits(self, word: int) -> int:
        """Length that a mapping entry states. NOT_MAPPABLE when there is no such object of that length."""
        entry = self._dictionary.entries.get((word >> 16, word >> 8 & 0xFF))
        if entry is None or not entry.mappable or entry.size is None or entry.size * 8 != word & 0xFF:
            raise SdoAbort(AbortCode.NOT_MAPPABLE)
        return word & 0xFF
