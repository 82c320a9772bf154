"""What the emulators refuse, each with a message that names the port, the value or the file, and the remedy.

HostError: why the emulators cannot listen; PortBusy, where another program listens there already. WorldError: a rig
that cannot be built, an unknown station, a set-point without sense.
"""


class WorldError(ValueError):
    """The message names the thing, the value and the remedy."""


class HostError(Exception):
    """A port cannot be opened as the rig wants it."""


class PortBusy(HostError):  # noqa: N818 - the field says "port busy"
    """A TCP address is taken; `host` names it, so that another can be tried."""

    def __init__(self, message: str, host: str) -> None:
        super().__init__(message)
        self.host = host
