"""The rig's register map as the server sees it: numbers into words and back.

ValueError for an entry that cannot be served; the rig file itself is checked where it is read.

The server's registers: which addresses there are, which of them may be written.
"""

import itertools
import math
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

HOLDING, INPUT = "holding", "input"
Listener = Callable[[int, int], None]  # address, word


class RegisterMemory:
    """Two tables of 16-bit registers; an address that the map does not cover does not exist."""

    def __init__(self) -> None:
        self._words: dict[str, dict[int, int]] = {HOLDING: {}, INPUT: {}}
        self._writable: set[int] = set()
        self.on_write: list[Listener] = []

    def define(self, table: str, addresses: Iterable[int], *, writable: bool = False) -> None:
        """Registers with the value zero, as after power-on."""
        for address in addresses:
            self._words[table].setdefault(address, 0)
            if writable:
                self._writable.add(address)

    def put(self, table: str, address: int, words: Sequence[int]) -> None:
        """From the controller's side."""
        self._words[table].update(zip(range(address, address + len(words)), words, strict=True))

    def get(self, table: str, address: int, count: int) -> list[int] | None:
        """None when an address is not there."""
        table_words = self._words[table]
        words = [table_words.get(at) for at in range(address, address + count)]
        return None if None in words else [word for word in words if word is not None]

    def write(self, address: int, words: Sequence[int]) -> bool:
        """From a client; all or nothing. False when an address is not there, or is not the client's to write."""
        if not all(at in self._writable for at in range(address, address + len(words))):
            return False
        self.put(HOLDING, address, words)
        for at, word in zip(range(address, address + len(words)), words, strict=True):
            for listener in self.on_write:
                listener(at, word)
        return True


CODES = {"int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f", "float64": "d"}
TURN_RAD = 2.0 * math.pi


@dataclass(frozen=True)
class RegisterEntry:
    """A quantity's place and coding."""

    name: str
    table: str
    address: int
    code: str
    count: int
    scale: float
    little: bool
    turns_address: int | None

    @property
    def words(self) -> int:
        return self.count * struct.calcsize(">" + self.code) // 2

    def encoded(self, values: Sequence[float]) -> list[int]:
        """SI values into words; what does not fit is cut off at the end of the range, as a PLC's conversion does."""
        numbers = [value / self.scale for value in values]
        each = [_packed(self.code, number) for number in numbers]
        return [word for words in each for word in (reversed(words) if self.little else words)]

    def decoded(self, words: Sequence[int]) -> list[float]:
        size = self.words // self.count
        values: list[float] = []
        for at in range(0, self.words, size):
            part = words[at : at + size]
            raw = struct.pack(f">{size}H", *(reversed(part) if self.little else part))
            values.append(struct.unpack(">" + self.code, raw)[0] * self.scale)
        return values


class RegisterMap:
    """All entries of a rig, over a memory."""

    def __init__(self, device: Mapping[str, Any], memory: RegisterMemory, written_by_clients: Sequence[str]) -> None:
        self.entries = {entry.name: entry for entry in map(_entry, device.get("register", ()))}
        self._memory = memory
        self._bridge(int(device.get("read_across", 0)))
        for entry in self.entries.values():
            writable = entry.name in written_by_clients
            memory.define(entry.table, range(entry.address, entry.address + entry.words), writable=writable)
            if entry.turns_address is not None:
                memory.define(entry.table, range(entry.turns_address, entry.turns_address + entry.count))

    def put(self, name: str, values: Sequence[float]) -> None:
        """Nothing when the rig has no such register."""
        entry = self.entries.get(name)
        if entry is None:
            return
        if entry.turns_address is not None:
            turns = [math.floor(value / TURN_RAD) for value in values]
            self._memory.put(entry.table, entry.turns_address, [turn & 0xFFFF for turn in turns])
            values = [value - TURN_RAD * turn for value, turn in zip(values, turns, strict=True)]
        self._memory.put(entry.table, entry.address, entry.encoded(values))

    def get(self, name: str) -> list[float]:
        """What a client has written; zeros before."""
        entry = self.entries[name]
        return entry.decoded(self._memory.get(entry.table, entry.address, entry.words) or [0] * entry.words)

    def _bridge(self, widest: int) -> None:
        """Controllers whose map may be read across its gaps have something in them."""
        ends = sorted(
            (entry.table, first, first + count)
            for entry in self.entries.values()
            for first, count in ((entry.address, entry.words), (entry.turns_address, entry.count))
            if first is not None
        )
        for (table, _, end), (other, first, _) in itertools.pairwise(ends):
            if table == other and 0 < first - end <= widest:
                self._memory.define(table, range(end, first))


def _entry(raw: Mapping[str, Any]) -> RegisterEntry:
    return RegisterEntry(
        name=str(raw["name"]),
        table=str(raw.get("table", HOLDING)),
        address=int(raw["address"]),
        code=CODES[raw["type"]],
        count=int(raw.get("count", 1)),
        scale=float(raw.get("scale", 1.0)),
        little=raw.get("word_order", "big") == "little",
        turns_address=raw.get("turns_address"),
    )


def _packed(code: str, number: float) -> tuple[int, ...]:
    size = struct.calcsize(">" + code)
    if code in "fd":
        raw = struct.pack(">" + code, number)
    else:
        signed = code.islower()
        least, most = (-(1 << 8 * size - 1), (1 << 8 * size - 1) - 1) if signed else (0, (1 << 8 * size) - 1)
        raw = struct.pack(">" + code, min(max(round(number), least), most))
    return struct.unpack(f">{size // 2}H", raw)
