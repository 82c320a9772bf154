"""RTDE on port 30004: versions 1 and 2, any number of clients, 500 Hz or a fraction of it.

What it does not imitate: the limit of 2048 bytes for a list of names, the controller's own limit of input recipes,
and messages of a running program (textmsg), which go nowhere.
Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide".
"""

import math
import struct
from collections.abc import Callable

from simulators.ur.readout import Readout
from simulators.ur.recipes import HEADER, FrameType, InputRecipe, OutputRecipe, frame, names_of
from simulators.ur.registers import Memory
from simulators.wire import TICK_S

BASE_RATE_HZ = 1.0 / TICK_S
NO_RECIPE = 0  # the id that a recipe with a wrong field gets
V2_RECIPE = 1  # one output recipe per connection, so that its id is always the same


class RtdeServer:
    """Shared by all connections: what the controller says this cycle, packed once per distinct recipe."""

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
        """For injected faults: the first frame says that it is one byte longer. RTDE itself has no checksum."""
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
