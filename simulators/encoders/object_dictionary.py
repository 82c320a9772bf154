"""The object dictionary of a node, and the encoder behind the objects of CiA 406.

Typed entries come from an EDS file, values are bytes, live objects have hooks. An SDO server breaks a transfer off with
the abort codes of CiA 301 (4.2.0, table 22).

The encoder turns a shaft angle into the position value 6004h. A rising angle (counter-clockwise, right hand about the
shaft) is a rising raw count; the code sequence bit then determines whether the position rises with it. Scaling and
preset as in CiA 406 (3.2), 6000h to 6003h and 6509h.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

import canopen
from canopen.objectdictionary import ODArray, ODRecord, ODVariable, datatypes


class AbortCode(IntEnum):
    """What the server answers in the last four bytes."""

    TOGGLE = 0x05030000
    UNKNOWN_COMMAND = 0x05040001
    WRITE_ONLY = 0x06010001
    READ_ONLY = 0x06010002
    NO_OBJECT = 0x06020000
    NOT_MAPPABLE = 0x06040041
    PDO_TOO_LONG = 0x06040042
    WRONG_LENGTH = 0x06070010
    NO_SUBINDEX = 0x06090011
    INVALID_VALUE = 0x06090030
    TOO_HIGH = 0x06090031
    TOO_LOW = 0x06090032
    NOT_STORED = 0x08000020
    WRONG_STATE = 0x08000022


class SdoAbort(Exception):  # noqa: N818 - the field's term
    """Refuses an access to the object dictionary."""

    def __init__(self, code: AbortCode) -> None:
        super().__init__(f"SDO abort 0x{code:08X} {code.name}")
        self.code = code


EDS_PATH = Path(__file__).with_name("encoder.eds")
Address = tuple[int, int]  # index, subindex


@dataclass(frozen=True)
class Entry:
    """What the EDS states of one sub-object; `size` in bytes, None for text."""

    size: int | None
    signed: bool
    readable: bool
    writable: bool
    mappable: bool
    low: int | None
    high: int | None
    default: bytes


class NodeDictionary:
    """Values of one node. `read` and `write` are what SDO does; the node itself uses `number` and `put`."""

    def __init__(self, node_id: int, eds_path: Path = EDS_PATH) -> None:
        self.entries = dict(_entries(node_id, eds_path))
        self._values = {address: entry.default for address, entry in self.entries.items()}
        self._stored: dict[Address, bytes] = {}
        self._numbers: dict[Address, int] = {}  # of values that are not live, as `number` has read them
        self.changes = 0  # counts every change of a value, so that what follows from values need not be computed again
        self._read_hooks: dict[Address, Callable[[], int]] = {}
        self._write_hooks: dict[Address, Callable[[int], None]] = {}

    def on_read(self, index: int, subindex: int, value: Callable[[], int]) -> None:
        """`value()` is asked whenever the object is read."""
        self._read_hooks[index, subindex] = value

    def on_write(self, index: int, subindex: int, accept: Callable[[int], None]) -> None:
        """`accept(number)` is called before a number is written; it may raise SdoAbort, then nothing is written."""
        self._write_hooks[index, subindex] = accept

    def read(self, index: int, subindex: int) -> bytes:
        entry = self._entry(index, subindex)
        if not entry.readable:
            raise SdoAbort(AbortCode.WRITE_ONLY)
        return self.data(index, subindex)

    def write(self, index: int, subindex: int, data: bytes) -> None:
        entry = self._entry(index, subindex)
        if not entry.writable:
            raise SdoAbort(AbortCode.READ_ONLY)
        if entry.size is None or len(data) != entry.size:
            raise SdoAbort(AbortCode.WRONG_LENGTH)
        number = int.from_bytes(data, "little", signed=entry.signed)
        if entry.high is not None and number > entry.high:
            raise SdoAbort(AbortCode.TOO_HIGH)
        if entry.low is not None and number < entry.low:
            raise SdoAbort(AbortCode.TOO_LOW)
        accept = self._write_hooks.get((index, subindex))
        if accept is not None:
            accept(number)
        self._values[index, subindex] = data
        self._changed()

    def data(self, index: int, subindex: int = 0) -> bytes:
        """The present value as it goes over the wire, little endian."""
        live = self._read_hooks.get((index, subindex))
        if live is not None:
            entry = self.entries[index, subindex]
            return live().to_bytes(entry.size or 0, "little", signed=entry.signed)
        return self._values[index, subindex]

    def number(self, index: int, subindex: int = 0) -> int:
        """Decoded once: a node reads its settings every cycle, and they hardly ever change."""
        address = index, subindex
        known = self._numbers.get(address)
        if known is not None:
            return known
        number = int.from_bytes(self.data(index, subindex), "little", signed=self.entries[address].signed)
        if address not in self._read_hooks:
            self._numbers[address] = number
        return number

    def put(self, index: int, subindex: int, number: int) -> None:
        """Sets a value from inside: no access right, limit or hook is asked."""
        entry = self.entries[index, subindex]
        self._values[index, subindex] = number.to_bytes(entry.size or 0, "little", signed=entry.signed)
        self._changed()

    def store(self) -> None:
        """What 1010h does: the writable values survive the next reset."""
        self._stored = {address: self._values[address] for address, entry in self.entries.items() if entry.writable}

    def forget(self) -> None:
        """What 1011h does: defaults again after the next reset."""
        self._stored = {}

    def reset(self) -> None:
        """Values as after power-on: defaults, with what was stored."""
        self._values = {address: entry.default for address, entry in self.entries.items()} | self._stored
        self._changed()

    def _changed(self) -> None:
        self._numbers.clear()
        self.changes += 1

    def _entry(self, index: int, subindex: int) -> Entry:
        entry = self.entries.get((index, subindex))
        if entry is None:
            known = any(index == known_index for known_index, _ in self.entries)
            raise SdoAbort(AbortCode.NO_SUBINDEX if known else AbortCode.NO_OBJECT)
        return entry


def _entries(node_id: int, eds_path: Path) -> Iterator[tuple[Address, Entry]]:
    dictionary = canopen.import_od(str(eds_path), node_id)
    for index in dictionary:
        found = dictionary[index]
        variables = list(found.values()) if isinstance(found, ODArray | ODRecord) else [found]
        for variable in variables:
            yield (variable.index, variable.subindex), _entry_of(variable)


def _entry_of(variable: ODVariable) -> Entry:
    text = variable.data_type == datatypes.VISIBLE_STRING
    signed = variable.data_type in datatypes.SIGNED_TYPES
    size = None if text else len(variable) // 8
    default = variable.default
    encoded = str(default or "").encode() if size is None else int(default or 0).to_bytes(size, "little", signed=signed)
    access = variable.access_type
    return Entry(
        size, signed, access != "wo", "w" in access, variable.pdo_mappable, variable.min, variable.max, encoded
    )


UNITS_PER_TURN = 1 << 20
TURNS = 1 << 12
RAW_RANGE = UNITS_PER_TURN * TURNS  # 32 bits
CODE_COUNTER_CLOCKWISE, SCALING_ON = 0x0001, 0x0004  # bits of 6000h


class AbsoluteEncoder:
    """Multi-turn, 20 bits a turn, 4096 turns. `angle_rad()` is the shaft's angle, any number of turns.

    Does not imitate: errors of the disc within a turn (the world's business), speed 6030h, latency of the reading.
    """

    def __init__(self, angle_rad: Callable[[], float], dictionary: NodeDictionary) -> None:
        self._angle_rad = angle_rad
        self._dictionary = dictionary
        self._offset = 0  # in units; kept through power-off, as 6509h is stored with the preset
        dictionary.on_read(0x6004, 0, self.position)
        dictionary.on_read(0x6500, 0, lambda: dictionary.number(0x6000))
        dictionary.on_read(0x6509, 0, self._signed_offset)
        dictionary.on_write(0x6003, 0, self._preset)

    def position(self) -> int:
        """6004h: units, wrapping at the measuring range."""
        return (self._scaled() + self._offset) % self._range

    @property
    def _scaling(self) -> bool:
        return bool(self._dictionary.number(0x6000) & SCALING_ON)

    @property
    def _range(self) -> int:
        return self._dictionary.number(0x6002) if self._scaling else RAW_RANGE

    def _scaled(self) -> int:
        raw = math.floor(self._angle_rad() / math.tau * UNITS_PER_TURN)
        if not self._dictionary.number(0x6000) & CODE_COUNTER_CLOCKWISE:
            raw = -raw
        raw %= RAW_RANGE
        if self._scaling:
            raw = raw * self._dictionary.number(0x6001) // UNITS_PER_TURN
        return raw % self._range

    def _preset(self, position: int) -> None:
        if position >= self._range:
            raise SdoAbort(AbortCode.TOO_HIGH)
        self._offset = (position - self._scaled()) % self._range

    def _signed_offset(self) -> int:
        offset = self._offset % (1 << 32)
        return offset - (1 << 32) if offset >= 1 << 31 else offset
