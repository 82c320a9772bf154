"""An encoder that sends by itself, without any protocol above the frame: rigs/encoders-plain.dbc in Python.

Frame 0x100 + node every period: angle i32 little endian, 2^20 a turn, rising counter-clockwise; a counter of frames u8;
a byte whose bit 0 says that the encoder is at fault. Does not imitate: drift of its clock, a start that takes time.
"""

import math
import struct
from collections.abc import Callable

from simulators.encoders.frame import CanFrame

FIRST_ID = 0x100
UNITS_PER_TURN = 1 << 20
SLACK_S = 1e-6  # sums of seconds in floating point are not exact


class PlainEncoder:
    """A node of `simulators.encoders.bus`: takes nothing, sends on its own time."""

    def __init__(self, node_id: int, angle_rad: Callable[[], float], period_s: float) -> None:
        self.node_id = node_id
        self.silent = False  # fault: as if its plug were pulled
        self._angle_rad = angle_rad
        self._period_s = period_s
        self._next_s = 0.0
        self._counter = 0
        self._fault = 0

    def handle(self, frame: CanFrame, now_s: float) -> list[CanFrame]:
        """Nothing that others say concerns it."""
        return []

    def due(self, now_s: float) -> list[CanFrame]:
        if now_s < self._next_s - SLACK_S:
            return []
        self._next_s = max(self._next_s + self._period_s, now_s)
        units = math.floor(self._angle_rad() / math.tau * UNITS_PER_TURN)
        wrapped = (units + (1 << 31)) % (1 << 32) - (1 << 31)
        data = struct.pack("<iBB", wrapped, self._counter, self._fault)
        self._counter = (self._counter + 1) % 256
        return [] if self.silent else [CanFrame(FIRST_ID + self.node_id, data)]

    def raise_emergency(self, code: int) -> None:
        """Any code but 0 sets the fault bit."""
        self._fault = int(code != 0)

    def reset(self) -> None:
        """A power dip: the counter begins anew."""
        self._counter = self._fault = 0
