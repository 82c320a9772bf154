"""Why the emulators cannot listen; every message names the port, the address and the remedy.

HostError
`-- PortBusy        another program listens there already
"""


class HostError(Exception):
    """A port cannot be opened as the rig wants it."""


class PortBusy(HostError):  # noqa: N818 - the field says "port busy"
    """A TCP address is taken; `host` says which, so that another can be tried."""

    def __init__(self, message: str, host: str) -> None:
        super().__init__(message)
        self.host = host
