"""One encoder on the bus: network state, heartbeat, SYNC, SDO and PDO. CAN frames in, CAN frames out, no I/O.

Sources: CiA 301 (4.2.0) section 7.3.2 (NMT), 7.2.8.3 (heartbeat, boot-up). Does not imitate: node guarding, LSS, TIME,
store on 1010h taking time.

Emergency messages of a node: error register 1001h, history 1003h, alarms 6503h and the EMCY frame.

Layout: error code u16, error register u8, then 6503h in bytes 3-4 and 6505h in bytes 5-6 (Baumer EAM manual).
"""

import struct
from collections.abc import Callable
from enum import IntEnum

from simulators.encoders.bus import CanFrame
from simulators.encoders.object_dictionary import AbortCode, AbsoluteEncoder, NodeDictionary, SdoAbort
from simulators.encoders.sdo_pdo import TIMER_SLACK_S, SdoServer, TransmitPdo

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


NMT_ID = 0x000
SAVE = int.from_bytes(b"save", "little")  # 1010h
LOAD = int.from_bytes(b"load", "little")  # 1011h


class NmtState(IntEnum):
    """As the heartbeat reports it; INITIALISING is the boot-up message."""

    INITIALISING = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class NmtCommand(IntEnum):
    """First byte of an NMT message; the second is the node, 0 for all."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class EncoderNode:
    """Node `node_id`, 1 to 127. The boot-up message is the first thing that `due` returns."""

    def __init__(self, node_id: int, angle_rad: Callable[[], float]) -> None:
        if not 1 <= node_id <= 127:
            raise ValueError(f"encoder node {node_id}: CANopen has nodes 1 to 127; correct devices.encoders.nodes")
        self.node_id = node_id
        self.silent = False  # fault: as if its plug were pulled
        self.state = NmtState.INITIALISING
        self.dictionary = NodeDictionary(node_id)
        self.encoder = AbsoluteEncoder(angle_rad, self.dictionary)
        self.emergencies = Emergencies(node_id, self.dictionary)
        self._sdo = SdoServer(self.dictionary)
        self._pdos = tuple(TransmitPdo(number, self.dictionary) for number in (1, 2))
        self._waiting: list[CanFrame] = []
        self._next_heartbeat_s: float | None = None
        self._bind()
        self.reset()

    # --- what comes

    def handle(self, frame: CanFrame, now_s: float) -> list[CanFrame]:
        """Answers to a frame that the bus delivered at `now_s`, in the order sent."""
        if self.silent or frame.extended or frame.remote:
            return []
        if frame.id == NMT_ID:
            self._obey(frame.data, now_s)
            return self.due(now_s)
        if frame.id == self.dictionary.number(0x1005) & 0x7FF:
            return self._on_sync()
        if frame.id == 0x600 + self.node_id and self.state in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL):
            answer = self._sdo.answer(frame.data)
            return [] if answer is None else [CanFrame(0x580 + self.node_id, answer)]
        return []

    def due(self, now_s: float) -> list[CanFrame]:
        """What the node sends of itself: boot-up, emergencies, heartbeat, timed PDOs."""
        frames, self._waiting = self._waiting, []
        frames += self._heartbeat(now_s)
        if self.state is NmtState.OPERATIONAL:
            frames += [frame for pdo in self._pdos if (frame := pdo.on_time(now_s)) is not None]
        return [] if self.silent else frames

    # --- faults from outside

    def raise_emergency(self, code: int) -> None:
        """Report an error code with the next `due`; 0: no error any more. ValueError unless 16 bits."""
        if not 0 <= code <= 0xFFFF:
            raise ValueError(f"emergency code {code}: give 0 to 65535")
        frame = self.emergencies.report(code)
        if self.state is not NmtState.STOPPED:
            self._waiting.append(frame)

    def reset(self) -> None:
        """As after power-on: stored parameters, boot-up message, pre-operational."""
        self.dictionary.reset()
        self.emergencies.reset()
        self._sdo.reset()
        self._next_heartbeat_s = None
        self._waiting = [self._life(NmtState.INITIALISING)]
        self.state = NmtState.PRE_OPERATIONAL

    # --- inside

    def _obey(self, data: bytes, now_s: float) -> None:
        if len(data) != 2 or data[1] not in (0, self.node_id):
            return
        match data[0]:
            case NmtCommand.START:
                if self.state is not NmtState.OPERATIONAL:
                    for pdo in self._pdos:
                        pdo.start(now_s)
                self.state = NmtState.OPERATIONAL
            case NmtCommand.STOP:
                self.state = NmtState.STOPPED
            case NmtCommand.ENTER_PRE_OPERATIONAL:
                self.state = NmtState.PRE_OPERATIONAL
            case NmtCommand.RESET_NODE | NmtCommand.RESET_COMMUNICATION:
                self.reset()
            case _:
                pass  # CiA 301: unknown commands are ignored

    def _on_sync(self) -> list[CanFrame]:
        if self.state is not NmtState.OPERATIONAL:
            return []
        return [frame for pdo in self._pdos if (frame := pdo.on_sync()) is not None]

    def _heartbeat(self, now_s: float) -> list[CanFrame]:
        period_s = self.dictionary.number(0x1017) * 1e-3
        if period_s == 0.0:
            self._next_heartbeat_s = None
            return []
        if self._next_heartbeat_s is None:
            self._next_heartbeat_s = now_s + period_s
        if now_s < self._next_heartbeat_s - TIMER_SLACK_S:
            return []
        self._next_heartbeat_s = max(self._next_heartbeat_s + period_s, now_s)
        return [self._life(self.state)]

    def _life(self, state: NmtState) -> CanFrame:
        return CanFrame(0x700 + self.node_id, bytes((state,)))

    def _bind(self) -> None:
        """Objects that do something when they are written."""

        def store(word: int) -> None:
            if word != SAVE:
                raise SdoAbort(AbortCode.NOT_STORED)
            self.dictionary.store()

        def restore(word: int) -> None:
            if word != LOAD:
                raise SdoAbort(AbortCode.NOT_STORED)
            self.dictionary.forget()

        def new_period(period_ms: int) -> None:
            self._next_heartbeat_s = None

        self.dictionary.on_write(0x1010, 1, store)
        self.dictionary.on_write(0x1011, 1, restore)
        self.dictionary.on_read(0x1010, 1, lambda: 1)  # bit 0: saves on command
        self.dictionary.on_read(0x1011, 1, lambda: 1)
        self.dictionary.on_write(0x1017, 0, new_period)
        # CiA 406: the cyclic timer is the event timer of TPDO1 under another name
        self.dictionary.on_read(0x6200, 0, lambda: self.dictionary.number(0x1800, 5))
        self.dictionary.on_write(0x6200, 0, lambda period_ms: self.dictionary.put(0x1800, 5, period_ms))
