"""One serial connection to the box."""

from simulators.psd_daq.daq import LitFaces, PsdDaqBox
from simulators.psd_daq.frames import Refusal, RequestReader, nak


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
