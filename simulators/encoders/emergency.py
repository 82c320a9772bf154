"""Emergency messages of a node: error register 1001h, history 1003h, alarms 6503h and the EMCY frame.

Layout: error code u16, error register u8, then 6503h in bytes 3-4 and 6505h in bytes 5-6 (Baumer EAM manual).
"""

import struct

from simulators.encoders.abort import AbortCode, SdoAbort
from simulators.encoders.dictionary import NodeDictionary
from simulators.encoders.frame import CanFrame

HISTORY = 8
POSITION_ERROR_CODE = 0x7320
POSITION_ERROR_ALARM = 0x0001  # bit 0 of 6503h
GENERIC = 0x01
REGISTER_BITS = {0x2: 0x02, 0x3: 0x04, 0x4: 0x08, 0x8: 0x10, 0x7: 0x20, 0xF: 0x80}  # code class to bit (CiA 301, 1001h)


class Emergencies:
    """Errors that a node has reported; code 0 ends them all."""

    def __init__(self, node_id: int, dictionary: NodeDictionary) -> None:
        self._node_id = node_id
        self._dictionary = dictionary
        self._codes: list[int] = []  # newest first
        dictionary.on_write(0x1003, 0, self._clear_history)

    def report(self, code: int) -> CanFrame:
        """The EMCY frame of an error code, 0 for "no error any more"; registers follow."""
        register = 0 if code == 0 else self._dictionary.number(0x1001) | GENERIC | REGISTER_BITS.get(code >> 12, 0)
        alarms = 0 if code == 0 else self._dictionary.number(0x6503)
        if code == POSITION_ERROR_CODE:
            alarms |= POSITION_ERROR_ALARM
        self._dictionary.put(0x1001, 0, register)
        self._dictionary.put(0x6503, 0, alarms)
        if code != 0:
            self._remember([code, *self._codes][:HISTORY])
        warnings = self._dictionary.number(0x6505)
        return CanFrame(0x080 + self._node_id, struct.pack("<HBHHx", code, register, alarms, warnings))

    def reset(self) -> None:
        self._codes = []

    def _clear_history(self, count: int) -> None:
        if count != 0:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        self._remember([])

    def _remember(self, codes: list[int]) -> None:
        self._codes = codes
        self._dictionary.put(0x1003, 0, len(codes))
        for place, code in enumerate(codes + [0] * (HISTORY - len(codes)), start=1):
            self._dictionary.put(0x1003, place, code)
