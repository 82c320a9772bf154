"""The CAN bus between the nodes and the one adapter, and the serial-line adapter itself.

The bus carries one frame at a time, the lowest identifier first, for as long as the frame occupies it. Does not
imitate: error frames, missing acknowledge, bus-off, arbitration within the first bit times of a frame. An adapter at
another bit rate than the nodes hears and reaches nobody.

The adapter has ASCII commands on one side, the bus on the other:

    C close   S0..S8 bit rate   O open   L listen only   tIIILDD.. TIIIIIIIILDD.. rIIIL RIIIIIIIIL send   V N F ask
    Z0 Z1 time stamps off, on

Each ends with CR; answered by CR (done) or BEL (refused), a sent frame by z CR or Z CR. Source: LAWICEL CANUSB manual,
version 1.0D, section "The CANUSB ASCII commands". Stamps are the milliseconds of the world's clock, 0 to 59999, as four
digits behind a frame. Does not imitate: a setting of Z that outlasts the power, acceptance filters (M, m), bit timing
registers (s), polling (A, P, X), the CAN FD commands of later firmware: all answered by BEL.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from simulators.wire import TICK_S

STANDARD_STUFFED_BITS, EXTENDED_STUFFED_BITS = 34, 54  # header and CRC bits that are subject to stuffing
UNSTUFFED_BITS = 13  # CRC delimiter, acknowledge slot and delimiter, end of frame, pause


@dataclass(frozen=True)
class CanFrame:
    """`dlc` is the number of data bytes; a remote frame has a dlc and no data."""

    id: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False
    dlc: int = -1  # -1: as many as there are data bytes

    def __post_init__(self) -> None:
        if self.dlc < 0:
            object.__setattr__(self, "dlc", len(self.data))


def bus_bits(frame: CanFrame) -> float:
    """Bit times on the bus, pause included: exact without stuff bits, plus half of the most that stuffing can add.

    An 8-byte frame takes 111 to 135 bits; the number between depends on the data, here it is always 123.
    Source: R. I. Davis et al., "Controller Area Network (CAN) schedulability analysis: refuted, revisited and
    revised", Real-Time Systems 35, 2007, equation (1): C = g + 8 s + 13 + floor((g + 8 s - 1) / 4), g = 34 or 54.
    """
    stuffed = (EXTENDED_STUFFED_BITS if frame.extended else STANDARD_STUFFED_BITS) + 8 * len(frame.data)
    return stuffed + UNSTUFFED_BITS + 0.5 * ((stuffed - 1) // 4)


MOST_WAITING = 256  # frames of all senders; more are lost, as in full transmit buffers


class Node(Protocol):
    """A participant: answers what it hears, sends what is due. `silent` is a fault: as if its plug were pulled."""

    node_id: int
    silent: bool

    def handle(self, frame: CanFrame, now_s: float) -> list[CanFrame]: ...

    def due(self, now_s: float) -> list[CanFrame]: ...

    def raise_emergency(self, code: int) -> None: ...

    def reset(self) -> None: ...


@dataclass(frozen=True)
class _Waiting:
    ready_s: float
    order: int
    frame: CanFrame
    from_adapter: bool


class CanBus:
    """`heard` are the frames that the adapter saw, each with the time of its end."""

    def __init__(self, bitrate: int, nodes: Sequence[Node]) -> None:
        self.bitrate = bitrate
        self.nodes = tuple(nodes)
        self.heard: deque[tuple[float, CanFrame]] = deque()
        self.lost = 0
        self._waiting: list[_Waiting] = []
        self._free_s = 0.0
        self._order = 0

    def submit(self, frame: CanFrame, ready_s: float) -> bool:
        """A frame that the adapter wants to send; False when there is no room."""
        return self._queue(frame, ready_s, from_adapter=True)

    def run(self, until_s: float) -> None:
        """Everything that ends on the bus by `until_s`; nodes answer as frames reach them."""
        while self._waiting:
            start_s = max(self._free_s, min(waiting.ready_s for waiting in self._waiting))
            ready = (waiting for waiting in self._waiting if waiting.ready_s <= start_s)
            winner = min(ready, key=lambda waiting: (waiting.frame.id, waiting.order))
            end_s = start_s + bus_bits(winner.frame) / self.bitrate
            if end_s > until_s:
                return
            self._waiting.remove(winner)
            self._free_s = end_s
            self._deliver(winner, end_s)

    def poll_nodes(self, now_s: float) -> None:
        """Collect what nodes send of themselves."""
        for node in self.nodes:
            for frame in node.due(now_s):
                self._queue(frame, now_s, from_adapter=False)

    def _deliver(self, sent: _Waiting, end_s: float) -> None:
        if not sent.from_adapter:
            self.heard.append((end_s, sent.frame))
            return  # nodes take nothing from each other: all their consumers are in the master
        for node in self.nodes:
            for answer in node.handle(sent.frame, end_s):
                self._queue(answer, end_s, from_adapter=False)

    def _queue(self, frame: CanFrame, ready_s: float, *, from_adapter: bool) -> bool:
        if len(self._waiting) >= MOST_WAITING:
            self.lost += 1
            return False
        self._order += 1
        self._waiting.append(_Waiting(ready_s, self._order, frame, from_adapter))
        return True


CR, BEL = b"\r", b"\a"
TURN_MS = 60_000  # after which stamps begin again
BITRATES = (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)  # S0 to S8
LONGEST_LINE = 32  # T, 8 digits of identifier, length, 16 digits of data: 26
VERSION, SERIAL = b"V1013", b"NCB01"
ID_DIGITS = {"t": 3, "r": 3, "T": 8, "R": 8}
LARGEST_ID = {3: 0x7FF, 8: 0x1FFFFFFF}


class Timed(Protocol):
    """What an adapter needs of a world."""

    @property
    def time_s(self) -> float: ...


class SlcanAdapter:
    """A wire of `simulators.wire`. Frames that come while nobody reads are lost in the port, not here."""

    def __init__(self, bus: CanBus, world: Timed) -> None:
        self._bus = bus
        self._world = world
        self._line = bytearray()
        self._bitrate: int | None = None
        self._open = False
        self._listen_only = False
        self._stamps = False

    def handle(self, data: bytes) -> bytes:
        answer = bytearray()
        for byte in data:
            if byte == CR[0]:
                answer += self._obey(bytes(self._line))
                self._line.clear()
            elif len(self._line) <= LONGEST_LINE:
                self._line.append(byte)
        return bytes(answer)

    def due(self) -> bytes:
        """Frames whose last bit has passed by the world's time."""
        out = bytearray()
        now_s = self._world.time_s
        while self._bus.heard and self._bus.heard[0][0] <= now_s:
            end_s, frame = self._bus.heard.popleft()
            if self._hears:
                out += as_line(frame, end_s if self._stamps else None)
        return bytes(out)

    def damaged(self, output: bytes) -> bytes:
        """For injected faults: frames whose checksum is wrong end in the adapter, which does not inform the client."""
        lines = output.split(CR)
        return CR.join(line for line in lines if line[:1] not in (b"t", b"T", b"r", b"R"))

    def refusal(self, request: bytes) -> bytes | None:
        """For injected faults: BEL for every command."""
        return BEL * request.count(CR) or None

    @property
    def _hears(self) -> bool:
        return self._open and self._bitrate == self._bus.bitrate

    def _obey(self, line: bytes) -> bytes:
        if len(line) > LONGEST_LINE or not line.isascii():
            return BEL
        text = line.decode("ascii")
        match text[:1]:
            case "":
                return CR
            case "S":
                return self._set_bitrate(text[1:])
            case "O" | "L" if text in ("O", "L"):
                return self._open_channel(listen_only=text == "L")
            case "C" if text == "C":
                return self._close()
            case "Z" if text in ("Z0", "Z1") and not self._open:
                self._stamps = text == "Z1"
                return CR
            case "t" | "T" | "r" | "R":
                return self._send(text)
            case "V" | "N" | "F" if len(text) == 1:
                return self._tell(text)
            case _:
                return BEL

    def _set_bitrate(self, digits: str) -> bytes:
        if self._open or digits not in {str(code) for code in range(len(BITRATES))}:
            return BEL
        self._bitrate = BITRATES[int(digits)]
        return CR

    def _open_channel(self, *, listen_only: bool) -> bytes:
        if self._open or self._bitrate is None:
            return BEL
        self._open, self._listen_only = True, listen_only
        return CR

    def _close(self) -> bytes:
        was_open, self._open = self._open, False
        return CR if was_open else BEL

    def _send(self, text: str) -> bytes:
        frame = from_line(text)
        if frame is None or not self._open or self._listen_only:
            return BEL
        if self._bitrate == self._bus.bitrate:
            now_s = self._world.time_s
            if not self._bus.submit(frame, now_s):
                return BEL
            self._bus.run(now_s + TICK_S)  # nodes latch the present state, not the one after the next step
        return (b"Z" if frame.extended else b"z") + CR

    def _tell(self, text: str) -> bytes:
        if text == "F":
            return (b"F00" if self._bitrate in (None, self._bus.bitrate) else b"F80") + CR  # bit 7: bus error
        return (VERSION if text == "V" else SERIAL) + CR


def as_line(frame: CanFrame, end_s: float | None = None) -> bytes:
    """The line by which the client learns of a frame; with the time of its end in the minute where it is given."""
    letter = "r" if frame.remote else "t"
    number = f"{letter.upper()}{frame.id:08X}" if frame.extended else f"{letter}{frame.id:03X}"
    stamp = "" if end_s is None else f"{math.floor(1e3 * end_s) % TURN_MS:04X}"
    return f"{number}{frame.dlc:X}{frame.data.hex().upper()}{stamp}\r".encode("ascii")


def from_line(text: str) -> CanFrame | None:
    """The frame of a send command; None when the line is not one."""
    digits = ID_DIGITS[text[0]]
    head, payload = text[1 : 2 + digits], text[2 + digits :]
    remote = text[0] in "rR"
    if len(head) != digits + 1 or not all(c in "0123456789abcdefABCDEF" for c in head + payload):
        return None
    number, dlc = int(head[:-1], 16), int(head[-1], 16)
    if number > LARGEST_ID[digits] or dlc > 8 or len(payload) != (0 if remote else 2 * dlc):
        return None
    return CanFrame(number, bytes.fromhex(payload), extended=digits == 8, remote=remote, dlc=dlc)
