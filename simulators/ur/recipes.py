"""Recipes: which variables a client gets or writes, compiled once.

RTDE's data types and frame layout, the controller's side.

Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide", sections "Field names and associated types" and
"RTDE package format". Everything is big-endian and packed.
"""

import struct
from collections.abc import Sequence
from enum import IntEnum
from typing import Any, cast

from simulators.ur.fields import Field, InputField, Source, input_field, output_field
from simulators.ur.readout import Readout
from simulators.ur.registers import Memory

HEADER = struct.Struct(">HB")  # size of the whole frame, type


class FrameType(IntEnum):
    """ASCII letters of the guide."""

    REQUEST_PROTOCOL_VERSION = 86  # V
    GET_CONTROLLER_VERSION = 118  # v
    TEXT_MESSAGE = 77  # M
    DATA_PACKAGE = 85  # U
    SETUP_OUTPUTS = 79  # O
    SETUP_INPUTS = 73  # I
    START = 83  # S
    PAUSE = 80  # P


STRUCT_CODES = {
    "BOOL": "?",
    "UINT8": "B",
    "UINT32": "I",
    "UINT64": "Q",
    "INT32": "i",
    "DOUBLE": "d",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
    "VECTOR6UINT32": "6I",
}
LENGTHS = {"VECTOR3D": 3, "VECTOR6D": 6, "VECTOR6INT32": 6, "VECTOR6UINT32": 6}  # every other type: one number


def frame(frame_type: FrameType, payload: bytes = b"") -> bytes:
    """One frame; a payload never exceeds 65532 bytes here, because the longest recipe is far shorter."""
    return HEADER.pack(HEADER.size + len(payload), frame_type) + payload


NOT_FOUND = "NOT_FOUND"
IN_USE = "IN_USE"


def names_of(text: bytes) -> tuple[str, ...]:
    """Comma separated names; empty entries (ur_rtde ends its list with a comma) are none."""
    decoded = text.decode("ascii", errors="replace")
    return tuple(name for name in (part.strip() for part in decoded.split(",")) if name)


class OutputRecipe:
    """Packs a whole data frame; `types` is what the controller answers."""

    def __init__(self, names: tuple[str, ...], recipe_id: int | None) -> None:
        """`recipe_id` None: protocol version 1, whose data frames carry no id."""
        found = [output_field(name) for name in names]
        self.key = (names, recipe_id)
        self.types = tuple(NOT_FOUND if field is None else field.type_name for field in found)
        self.complete = bool(found) and None not in found
        fields = [field for field in found if field is not None]
        codes = "".join(STRUCT_CODES[field.type_name] for field in fields)
        self._pack = struct.Struct(">HB" + ("" if recipe_id is None else "B") + codes)
        self._values: list[Any] = [
            self._pack.size,
            FrameType.DATA_PACKAGE,
            *([] if recipe_id is None else [recipe_id]),
        ]
        self._numbers: list[tuple[int, Source]] = []
        self._vectors: list[tuple[slice, Source]] = []
        for field in fields:
            self._place(field)

    def pack(self, readout: Readout) -> bytes:
        """The data frame of one cycle."""
        values = self._values
        for index, read in self._numbers:
            values[index] = read(readout)
        for span, read in self._vectors:
            values[span] = read(readout)
        return self._pack.pack(*values)

    def _place(self, field: Field) -> None:
        """Appends a field's place; a constant is written once, here."""
        at, length = len(self._values), LENGTHS.get(field.type_name)
        if field.constant is not None:
            self._values += [field.constant] if length is None else list(cast(tuple[float, ...], field.constant))
            return
        self._values.extend([0.0] * (length or 1))
        if length is None:
            self._numbers.append((at, field.read))
        else:
            self._vectors.append((slice(at, at + length), field.read))


class InputRecipe:
    """Writes the values of a client's data frame; an unknown or foreign field makes it unusable."""

    def __init__(self, names: tuple[str, ...], memory: Memory, owner: object) -> None:
        found = [input_field(name, memory) for name in names]
        self.types = tuple(_answer(field, name, memory, owner) for field, name in zip(found, names, strict=True))
        self.complete = bool(found) and NOT_FOUND not in self.types and IN_USE not in self.types
        self._writers: list[tuple[InputField, int]] = [
            (field, LENGTHS.get(field.type_name, 1)) for field in found if field is not None
        ]
        self._values = struct.Struct(">" + "".join(STRUCT_CODES[field.type_name] for field, _ in self._writers))

    def write(self, payload: bytes) -> bool:
        """False when the payload is too short; what is too long is ignored, as ur_rtde sends more in one call."""
        if len(payload) < self._values.size:
            return False
        values: Sequence[float] = self._values.unpack_from(payload)
        at = 0
        for field, length in self._writers:
            field.write(values[at] if length == 1 else tuple(values[at : at + length]))
            at += length
        return True


def _answer(field: InputField | None, name: str, memory: Memory, owner: object) -> str:
    if field is None:
        return NOT_FOUND
    return field.type_name if memory.claim(name, owner) else IN_USE
