"""RTDE on port 30004: versions 1 and 2, any number of clients with their recipes, 500 Hz or a fraction of it.

A recipe is the list of variables that a client reads or writes, compiled once. Data types and frame layout are the
controller's side: everything is big-endian and packed.

What it does not imitate: the limit of 2048 bytes for a list of names, the controller's own limit of input recipes, and
messages of a running program (textmsg), which go nowhere.

Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide", sections "Field names and associated types" and "RTDE
package format".
"""

import math
import struct
from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import Any, cast

from simulators.ur.fields import Field, InputField, Source, input_field, output_field
from simulators.ur.readout import Readout
from simulators.ur.registers import Memory
from simulators.wire import TICK_S

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


BASE_RATE_HZ = 1.0 / TICK_S
NO_RECIPE = 0  # the id that a recipe with a wrong field gets
V2_RECIPE = 1  # one output recipe per connection, so that its id is always the same


class RtdeServer:
    """Shared by all connections: what the controller states this cycle, packed once per distinct recipe."""

    def __init__(self, memory: Memory, version: tuple[int, int, int, int], read: Callable[[], Readout]) -> None:
        self.memory, self.version = memory, version
        self.silent = False  # side channel: the stream stops, connections stay
        self._read = read
        self._readout: Readout | None = None
        self._packed: dict[object, bytes] = {}

    def new_cycle(self) -> None:
        self._readout = None
        self._packed.clear()

    @property
    def readout(self) -> Readout:
        if self._readout is None:
            self._readout = self._read()
        return self._readout

    def pack(self, recipe: OutputRecipe) -> bytes:
        packed = self._packed.get(recipe.key)
        if packed is None:
            packed = self._packed[recipe.key] = recipe.pack(self.readout)
        return packed

    def accept(self) -> "RtdeWire":
        return RtdeWire(self)


class RtdeWire:
    """One client's connection."""

    def __init__(self, server: RtdeServer) -> None:
        self._server = server
        self._pending = bytearray()
        self.closing = False  # also after bytes that are no RTDE: the stream cannot be found again
        self._protocol = 1  # until version 2 is asked for
        self._rate_hz = BASE_RATE_HZ
        self._output: OutputRecipe | None = None
        self._inputs: list[InputRecipe] = []
        self._started = False
        self._credit = 0.0
        self._last_tick = -1

    def handle(self, data: bytes) -> bytes:
        if self.closing:
            return b""
        self._pending += data
        answers = bytearray()
        at = 0
        while len(self._pending) - at >= HEADER.size:
            size, kind = HEADER.unpack_from(self._pending, at)
            if size < HEADER.size:
                self.closing = True
                answers += self._message(0, f"frame of {size} bytes: a size counts its own 3 bytes of header")
                break
            if len(self._pending) - at < size:
                break
            answers += self._answer(kind, bytes(self._pending[at + HEADER.size : at + size]))
            at += size
        del self._pending[:at]
        return bytes(answers)

    def due(self) -> bytes:
        if not self._started or self._output is None or self._server.silent:
            return b""
        tick = self._server.readout.tick
        if tick == self._last_tick:
            return b""
        cycles = 1 if self._last_tick < 0 else tick - self._last_tick
        self._last_tick = tick
        self._credit = min(self._credit + cycles * self._rate_hz / BASE_RATE_HZ, 1.0 + 1e-9)
        if self._credit < 1.0 - 1e-9:  # 125 Hz: four quarters are one, whatever the rounding
            return b""
        self._credit -= 1.0
        return self._server.pack(self._output)

    def damaged(self, output: bytes) -> bytes:
        """For injected faults: the first frame states one byte more than it has. RTDE itself has no checksum."""
        size, kind = HEADER.unpack_from(output)
        return HEADER.pack(size + 1, kind) + output[HEADER.size :]

    def refusal(self, request: bytes) -> bytes | None:
        """For injected faults: an error message instead of the answer that a client waits for."""
        if len(request) < HEADER.size or request[2] in (FrameType.DATA_PACKAGE, FrameType.TEXT_MESSAGE):
            return None
        return self._message(1, "injected fault")

    def _answer(self, kind: int, payload: bytes) -> bytes:
        match kind:
            case FrameType.REQUEST_PROTOCOL_VERSION:
                return self._choose_protocol(payload)
            case FrameType.GET_CONTROLLER_VERSION:
                return frame(FrameType.GET_CONTROLLER_VERSION, struct.pack(">4I", *self._server.version))
            case FrameType.SETUP_OUTPUTS:
                return self._setup_outputs(payload)
            case FrameType.SETUP_INPUTS:
                return self._setup_inputs(payload)
            case FrameType.START:
                self._started = self._output is not None and self._output.complete
                return frame(FrameType.START, bytes([self._started]))
            case FrameType.PAUSE:
                self._started = False
                return frame(FrameType.PAUSE, b"\x01")
            case FrameType.DATA_PACKAGE:
                return self._write_inputs(payload)
            case FrameType.TEXT_MESSAGE:
                return b""
            case _:
                return self._message(1, f"unknown package type {kind}")

    def _choose_protocol(self, payload: bytes) -> bytes:
        wanted = int.from_bytes(payload[:2], "big")
        accepted = len(payload) >= 2 and wanted in (1, 2)
        if accepted:
            self._protocol = wanted
        return frame(FrameType.REQUEST_PROTOCOL_VERSION, bytes([accepted]))

    def _setup_outputs(self, payload: bytes) -> bytes:
        self._started = False
        if self._protocol == 1:
            self._output = OutputRecipe(names_of(payload), None)
            return frame(FrameType.SETUP_OUTPUTS, ",".join(self._output.types).encode())
        if len(payload) < 8:
            return self._message(1, "output setup without a frequency")
        (rate_hz,) = struct.unpack_from(">d", payload)
        if not (math.isfinite(rate_hz) and 0.0 < rate_hz <= BASE_RATE_HZ):
            return self._message(1, f"output frequency {rate_hz} Hz; up to {BASE_RATE_HZ:.0f} Hz is possible")
        self._rate_hz, self._credit = rate_hz, 0.0
        self._output = OutputRecipe(names_of(payload[8:]), V2_RECIPE)
        recipe_id = V2_RECIPE if self._output.complete else NO_RECIPE
        return frame(FrameType.SETUP_OUTPUTS, bytes([recipe_id]) + ",".join(self._output.types).encode())

    def _setup_inputs(self, payload: bytes) -> bytes:
        recipe = InputRecipe(names_of(payload), self._server.memory, self)
        recipe_id = NO_RECIPE
        if recipe.complete and len(self._inputs) < 255:
            self._inputs.append(recipe)
            recipe_id = len(self._inputs)
        return frame(FrameType.SETUP_INPUTS, bytes([recipe_id]) + ",".join(recipe.types).encode())

    def _write_inputs(self, payload: bytes) -> bytes:
        number = payload[0] if payload else NO_RECIPE
        if not 1 <= number <= len(self._inputs):
            return self._message(1, f"data for input recipe {number}, which was not set up")
        if not self._inputs[number - 1].write(payload[1:]):
            return self._message(1, f"data for input recipe {number} is too short")
        return b""

    def _message(self, level: int, text: str) -> bytes:
        """Level 0 exception, 1 error, 2 warning, 3 info."""
        body, source = text.encode()[:255], b"RTDE"
        if self._protocol == 1:
            return frame(FrameType.TEXT_MESSAGE, bytes([level]) + body)
        payload = bytes([len(body)]) + body + bytes([len(source)]) + source + bytes([level])
        return frame(FrameType.TEXT_MESSAGE, payload)
