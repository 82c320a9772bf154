"""Where a Modbus controller's quantities stand in its registers, how they are coded, how few requests fetch them.

A register has 16 bits, high byte first (Modbus Application Protocol V1.1b3, section 4.2); how two or four of them make
a longer number is not standardised, so the map states it.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivers.device import Channel, Floats

WORDS = {"int16": 1, "uint16": 1, "int32": 2, "uint32": 2, "float32": 2, "float64": 4}
DTYPES = {"int16": ">i2", "uint16": ">u2", "int32": ">i4", "uint32": ">u4", "float32": ">f4", "float64": ">f8"}
BIG, LITTLE = "big", "little"
HOLDING, INPUT = "holding", "input"
ADDRESSES = 65536


@dataclass(frozen=True)
class Register:
    """`count` numbers of one quantity from `address` on; SI value = scale * number, plus whole turns where stated.

    `turns_address`: where the signed 16-bit counts of whole turns begin that belong to the numbers, one for each (a UR
    controller gives an angle within the turn and the turn apart). ValueError for a type or place that Modbus lacks.
    """

    name: str
    address: int
    type: str
    count: int = 1
    scale: float = 1.0
    word_order: str = BIG  # which word of a longer number comes first
    table: str = HOLDING
    turns_address: int | None = None

    def __post_init__(self) -> None:
        if self.type not in DTYPES or self.word_order not in (BIG, LITTLE) or self.table not in (HOLDING, INPUT):
            raise ValueError(
                f"register {self.name}: type {self.type}, word order {self.word_order}, table {self.table}; there are "
                f"{', '.join(DTYPES)}; big, little; holding, input"
            )
        if self.address < 0 or self.end > ADDRESSES or self.count < 1 or not _usable(self.scale):
            raise ValueError(
                f"register {self.name}: address {self.address}, count {self.count}, scale {self.scale}; addresses go "
                f"from 0 to {ADDRESSES - 1}, and the scale must be a number other than 0"
            )

    @property
    def end(self) -> int:
        """First address after it."""
        return self.address + self.count * WORDS[self.type]

    @property
    def spans(self) -> tuple[tuple[int, int], ...]:
        """All (first, end) that must be read for it."""
        turns = () if self.turns_address is None else ((self.turns_address, self.turns_address + self.count),)
        return ((self.address, self.end), *turns)

    def decode(self, words: Sequence[int], turns: Sequence[int] = ()) -> Floats:
        """SI values (count,) of the raw registers; `turns` (count,) raw, where the map has them."""
        raw = np.array(words, ">u2").reshape(self.count, WORDS[self.type])
        ordered = raw if self.word_order == BIG else raw[:, ::-1]
        numbers = np.frombuffer(ordered.tobytes(), DTYPES[self.type]).astype(np.float64) * self.scale
        if self.turns_address is None:
            return numbers
        return numbers + 2.0 * math.pi * np.array(turns, ">u2").view(">i2").astype(np.float64)

    def encode(self, values: Sequence[float]) -> list[int]:
        """Raw registers of SI values (count,). ValueError for a value that the type cannot hold."""
        numbers = np.array(values, np.float64) / self.scale
        dtype = np.dtype(DTYPES[self.type])
        if dtype.kind != "f":
            limits = np.iinfo(dtype)
            numbers = np.rint(numbers)
            if not ((numbers >= limits.min) & (numbers <= limits.max)).all():
                raise ValueError(f"register {self.name}: {list(values)} does not go into {self.type} x {self.scale}")
        raw = np.frombuffer(numbers.astype(dtype).tobytes(), ">u2").reshape(self.count, WORDS[self.type])
        return (raw if self.word_order == BIG else raw[:, ::-1]).ravel().astype(int).tolist()


def _usable(scale: float) -> bool:
    return math.isfinite(scale) and scale != 0.0


MOST_READ = 125  # registers in one request (Modbus Application Protocol V1.1b3, section 6.3)
SIX = (6,)

READINGS = (
    Channel("actual_q_rad", "rad", SIX),
    Channel("actual_qd_rad_s", "rad/s", SIX),
    Channel("target_q_rad", "rad", SIX),
    Channel("actual_current_a", "A", SIX),
    Channel("joint_temperature_degC", "degC", SIX),
    Channel("robot_mode", "1"),
    Channel("safety_mode", "1"),
    Channel("protective_stopped", "1"),
    Channel("emergency_stopped", "1"),
    Channel("speed_scaling", "1"),
    Channel("payload_kg", "kg"),
    Channel("life", "1"),  # counts while the controller's program runs: the only way to see that values are fresh
)
JOINTS = "actual_q_rad"  # without these there is nothing to record
LIFE = "life"
# the handshake of docs/protocols/modbus.md: first what the host writes, then what the controller's program writes
COMMANDS = {
    "command_q_rad": 6,
    "command_speed_rad_s": 1,
    "command_acceleration_rad_s2": 1,
    "command_number": 1,
    "stop": 1,
    "host_life": 1,
}
ANSWERS = {"state": 1, "state_number": 1, "reason": 1}
COUNTS = {**{channel.name: (channel.shape or (1,))[0] for channel in READINGS}, **COMMANDS, **ANSWERS}


@dataclass(frozen=True)
class Request:
    """One read: `count` registers of a table from `address` on."""

    table: str
    address: int
    count: int


class RegisterMap:
    """The registers of one controller. ValueError for names, counts or places that cannot be."""

    def __init__(self, registers: Iterable[Register], read_across: int = 0) -> None:
        """`read_across`: so many registers that are not in the map may be read to save a request."""
        self.registers: Mapping[str, Register] = _by_name(tuple(registers))
        self._read_across = read_across
        if JOINTS not in self.registers:
            raise ValueError(f"the register map has no {JOINTS}; add it")

    @property
    def readings(self) -> tuple[Channel, ...]:
        """What can be recorded."""
        return tuple(channel for channel in READINGS if channel.name in self.registers)

    @property
    def missing_for_motion(self) -> tuple[str, ...]:
        """What a handshake would need and the map does not have."""
        return tuple(name for name in (*COMMANDS, *ANSWERS) if name not in self.registers)

    def requests(self, names: Sequence[str]) -> tuple[Request, ...]:
        """The fewest reads for these; what stands together is read together, so that it is of one moment."""
        spans = sorted((self.registers[name].table, *span) for name in names for span in self.registers[name].spans)
        joined: list[tuple[str, int, int]] = []
        for table, first, end in spans:
            if joined and joined[-1][0] == table:
                _, start, last = joined[-1]
                if first - last <= self._read_across and max(end, last) - start <= MOST_READ:
                    joined[-1] = (table, start, max(end, last))
                    continue
            joined.append((table, first, end))
        return tuple(Request(table, first, end - first) for table, first, end in joined)

    def decode(self, name: str, words: Mapping[tuple[str, int], int]) -> Floats:
        """SI values (count,) of raw registers by (table, address)."""
        register = self.registers[name]
        numbers, *turns = ([words[register.table, at] for at in range(*span)] for span in register.spans)
        return register.decode(numbers, *turns)


def _by_name(registers: tuple[Register, ...]) -> dict[str, Register]:
    found: dict[str, Register] = {}
    for register in registers:
        if register.name not in COUNTS:
            raise ValueError(f"register {register.name!r} is no known quantity; there are {', '.join(COUNTS)}")
        if register.name in found:
            raise ValueError(f"register {register.name} stands twice in the map; keep one")
        if register.count != COUNTS[register.name]:
            raise ValueError(f"register {register.name}: count {register.count}, it has {COUNTS[register.name]} values")
        if register.name in COMMANDS and register.table == INPUT:
            raise ValueError(f"register {register.name}: input registers cannot be written; put it into {HOLDING}")
        found[register.name] = register
    return found
