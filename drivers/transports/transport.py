"""Bytes in and out, with a limit on every wait: the lowest seam, where a test puts a line in memory."""

from typing import Protocol


class Transport(Protocol):
    """An open line. Raises DeviceLost when it has gone; `name` says where it leads, for messages."""

    name: str

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        """What has come, at least one byte, at most `max_bytes`; b"" when nothing came within `timeout_s`."""
        ...

    def write(self, data: bytes, timeout_s: float) -> None:
        """All of `data`, or DeviceLost when the line did not take it within `timeout_s`."""
        ...

    def close(self) -> None:
        """Release the line; safe more than once, and while another thread waits in `read`."""
        ...
