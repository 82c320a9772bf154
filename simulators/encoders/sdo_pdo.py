"""A transmit PDO: what it carries, when it is sent, and how both are changed over SDO.

Source: CiA 301 (4.2.0) sections 7.5.2.35 (18xxh) and 7.5.2.36 (1Axxh). Does not imitate: inhibit time, remote request,
transmission type 0, sending on a change of value (types 254 and 255 follow their event timer only).
"""

from functools import partial

from simulators.encoders.bus import CanFrame
from simulators.encoders.object_dictionary import AbortCode, NodeDictionary, SdoAbort

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
        """The node becomes operational: count SYNCs anew, first event now."""
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
        self._next_event_s = None  # the new period counts from the next look at the time

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
