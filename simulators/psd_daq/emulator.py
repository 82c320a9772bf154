"""The PSD DAQ box on its port, with the verbs of the side channel.

One serial connection to the box.
"""

from collections.abc import Mapping
from typing import Any

from simulators.psd_daq.daq import LitFaces, PsdDaqBox
from simulators.psd_daq.frames import Refusal, RequestReader, nak
from simulators.psd_daq.line import DEFAULT_BAUD, TransmitLine
from simulators.wire import Bench, SerialPort


class PsdDaqWire:
    """Bytes to requests, and what has left the line to bytes.

    Does not imitate: baud rate (a pseudo-terminal has none, any setting works), modem lines, break, parity errors; the
    time that requests take on their way in.
    """

    def __init__(self, box: PsdDaqBox, world: LitFaces) -> None:
        self._box = box
        self._world = world
        self._reader = RequestReader()

    def handle(self, data: bytes) -> bytes:
        for request in self._reader.feed(data):
            self._box.obey(request)
        return self.due()

    def due(self) -> bytes:
        return self._box.line.delivered(self._world.time_s)

    def refusal(self, request: bytes) -> bytes | None:
        """For injected faults: the box does not take a request that it knows."""
        requests = RequestReader().feed(request)
        return nak(requests[0].kind, Refusal.UNKNOWN_REQUEST, "injected fault") if requests else None


DEFAULT_SERIAL_NUMBER = "CB-0001"


def build(world: LitFaces, rig: Mapping[str, Any], baud: int = DEFAULT_BAUD) -> Bench:
    """The box of `rig["devices"]["psd"]` with the faces of `rig["fixture"]`; its link is the rig's port, if any.

    Verbs: "psd.silence" {on} stops all that it says while sampling goes on; "psd.damage" {frames} turns one bit in
    each of the next so many data frames.
    """
    device = rig["devices"]["psd"]
    serial_number = str(device.get("serial_number", DEFAULT_SERIAL_NUMBER))
    box = PsdDaqBox(world, 2.0 * float(rig["fixture"]["half_size_m"]), serial_number, TransmitLine(baud))

    def silence(on: bool = True) -> None:
        box.silent = on

    def damage(frames: int = 1) -> None:
        box.damaged_frames = frames

    port = SerialPort("psd", PsdDaqWire(box, world), device.get("port"))
    return Bench((box,), (port,), {"psd.silence": silence, "psd.damage": damage}, box.clock)
