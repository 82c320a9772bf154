"""One entry of a register map: where a quantity stands in a controller's registers, and how it is coded there.

A register has 16 bits, high byte first (Modbus Application Protocol V1.1b3, section 4.2); how two or four of them make
a longer number is not standardised, so the map says it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivers.device import Floats

WORDS = {"int16": 1, "uint16": 1, "int32": 2, "uint32": 2, "float32": 2, "float64": 4}
DTYPES = {"int16": ">i2", "uint16": ">u2", "int32": ">i4", "uint32": ">u4", "float32": ">f4", "float64": ">f8"}
BIG, LITTLE = "big", "little"
HOLDING, INPUT = "holding", "input"
ADDRESSES = 65536


@dataclass(frozen=True)
class Register:
    """`count` numbers of one quantity from `address` on; SI value = scale * number, plus whole turns where told.

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
