"""The encoder behind the objects of CiA 406: from a shaft angle to the position value 6004h.

A rising angle (counter-clockwise, right hand about the shaft) is a rising raw count; the code sequence bit then says
whether the position rises with it. Scaling and preset as in CiA 406 (3.2), 6000h to 6003h and 6509h.
"""

import math
from collections.abc import Callable

from simulators.encoders.object_dictionary import AbortCode, NodeDictionary, SdoAbort

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
