"""Datagrams to one address. Nobody need be there: what a network refuses is lost, as on site."""

import socket
from contextlib import suppress

from simulators.host.line import Report
from simulators.wire import UdpPort


class UdpSender:
    """A socket without a name of its own."""

    def __init__(self, port: UdpPort, report: Report) -> None:
        self._port, self._report = port, report
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def send_due(self) -> None:
        """What became due, as one datagram; called once a tick."""
        try:
            data = self._port.wire.due()
        except Exception as fault:  # a wire at fault must not end the other instruments
            self._report.fault(self._port.name, fault)
            return
        if data:
            with suppress(OSError):  # refused by a port that nobody has, or no room
                self._socket.sendto(data, (self._port.host, self._port.port))

    def close(self) -> None:
        self._socket.close()
