"""The CAN bus between the nodes and the one adapter: one frame at a time, the lowest identifier first.

Does not imitate: error frames, missing acknowledge, bus-off, arbitration within the first bit times of a frame. An
adapter at another bit rate than the nodes hears and reaches nobody.

A classic CAN frame and how long it occupies the bus.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

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
