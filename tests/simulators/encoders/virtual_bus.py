"""The same nodes on any python-can bus of this process, driven by hand: for tests without a wire.

    with can.Bus("rig", interface="virtual") as there:
        nodes = NodesOnBus(there, [EncoderNode(1, lambda: 0.5)])
        nodes.pump(now_s=0.0)

No thread, no clock, no bus time: `pump` answers what has come, at the time that it is told.
"""

from collections.abc import Sequence

import can

from simulators.encoders.bus import CanFrame
from simulators.encoders.node import EncoderNode


class NodesOnBus:
    """Nodes as one participant of a python-can bus, which stays the caller's to shut down."""

    def __init__(self, bus: can.BusABC, nodes: Sequence[EncoderNode]) -> None:
        self._bus = bus
        self._nodes = tuple(nodes)

    def pump(self, now_s: float, wait_s: float = 0.0) -> int:
        """Answer every frame that has come, waiting up to `wait_s` for the first; returns how many came."""
        count = 0
        message = self._bus.recv(wait_s)
        while message is not None:
            count += 1
            frame = CanFrame(
                message.arbitration_id,
                bytes(message.data),
                extended=message.is_extended_id,
                remote=message.is_remote_frame,
                dlc=message.dlc,
            )
            for node in self._nodes:
                self._send(node.handle(frame, now_s))
            message = self._bus.recv(0.0)
        for node in self._nodes:
            self._send(node.due(now_s))
        return count

    def _send(self, frames: Sequence[CanFrame]) -> None:
        for frame in frames:
            self._bus.send(can.Message(arbitration_id=frame.id, data=frame.data, is_extended_id=False))
