"""A serial-line adapter that stamps each frame itself, where the rig file asks for its stamps.

`Z1`, while the channel is closed: each frame then ends with four hexadecimal digits, the milliseconds of the adapter's
clock, 0 to 59999 in turn. Adapters keep the setting without power, so it is taken back at the end. Source: LAWICEL
CANUSB manual, version 1.0D, "Zn"; EasySYNC USB2-F-7x01 user guide 1.3, section 4.1.5. CAN FD has no such stamps.
"""

import re
import time
from contextlib import suppress
from typing import Any

import can

from drivers.errors import DeviceError, DeviceRefused, DeviceStale
from drivers.transports.slcan_bus import BlockSlcanBus, classic_frame

TURN_MS = 60_000
AGAIN_MS = 1000.0  # farther from what has passed on the host, and the adapter's clock has begun again
ANSWER_S = 1.0  # a USB adapter answers within milliseconds
_STAMPED = re.compile(
    r"(?:t[0-9A-F]{3}|T[0-9A-F]{8})(?P<length>[0-8])(?P<data>(?:[0-9A-F]{2})*)(?P<stamp>[0-9A-F]{4})"
    r"|(?:r[0-9A-F]{3}|R[0-9A-F]{8})[0-8](?P<remote>[0-9A-F]{4})",
    re.IGNORECASE,
)
_REMEDY = "Check its port, or delete the key, or connect an adapter with time stamps, such as a Lawicel CANUSB"
_VERSION, _ANSWER = re.compile(rb"V[^\r\a]*\r"), re.compile(rb"[\r\a]")


class MinuteClock:
    """Stamps of an adapter that begin again every minute, made continuous, in seconds.

    Of all times with the same milliseconds in the minute it takes the nearest to the last one plus what has passed on
    the host since: right while frames wait less than half a minute, however long the bus was quiet. An adapter that was
    opened again may have begun at nought: the first stamp then counts from the host's time, and all later ones from it.
    It begins in the second minute, because a stamp of 0 counts as none.
    """

    def __init__(self) -> None:
        self._last: tuple[int, float] | None = None  # ms of the adapter, host time
        self._opened_again = False
        self._ahead_ms = 0  # by which this time is ahead of the adapter's own

    def opened(self) -> None:
        """The adapter was opened, for the first time or again."""
        self._opened_again = self._last is not None

    def follow(self, stamp_ms: int, host_s: float) -> float:
        """The time in s of a stamp of 0 to 59999 that came at `host_s`."""
        last_ms, last_s = self._last or (stamp_ms + TURN_MS, host_s)
        expected_ms = last_ms + 1e3 * (host_s - last_s)
        if self._opened_again and not self._near(stamp_ms, expected_ms):
            self._ahead_ms = round(expected_ms) - stamp_ms
        self._opened_again = False
        own_ms = stamp_ms + self._ahead_ms
        at_ms = own_ms + TURN_MS * round((expected_ms - own_ms) / TURN_MS)
        self._last = at_ms, host_s
        return 1e-3 * at_ms

    def _near(self, stamp_ms: int, expected_ms: float) -> bool:
        """Whether the adapter's clock has gone on."""
        off_ms = (stamp_ms + self._ahead_ms - expected_ms + TURN_MS / 2.0) % TURN_MS - TURN_MS / 2.0
        return abs(off_ms) < AGAIN_MS


class StampedSlcanBus(BlockSlcanBus):
    """Messages carry the adapter's time, in s. Opening: DeviceRefused for an adapter that refuses `Z1`, DeviceStale for
    one that does not answer.
    """

    def __init__(self, channel: str, minutes: MinuteClock, **settings: Any) -> None:
        """`minutes` of an adapter that is opened again is the one of before; `settings` are python-can's."""
        self._minutes, self._stamps = minutes, False
        try:
            super().__init__(channel, **settings)
        except can.CanInitializationError as error:  # as which python-can hands on whatever opening raises
            if isinstance(error.__cause__, DeviceError):
                raise error.__cause__ from None
            raise

    def open(self) -> None:
        """python-can opens twice; only before the first time is the channel closed."""
        if not self._stamps:
            self._ask_for_stamps()
            self._minutes.opened()
            self._stamps = True
        super().open()

    def shutdown(self) -> None:
        with suppress(can.CanError, OSError):  # an adapter that has gone: what follows reports it
            self.close()
            self._write("Z0")
        super().shutdown()

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """As python-can's. ValueError for a frame without a stamp."""
        return super(BlockSlcanBus, self).recv(timeout)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._lines:
            self._fill(timeout)
        if not self._lines:
            return None, False
        line = self._lines.popleft()
        stamp_ms = _stamp_ms(line)
        if stamp_ms is None:
            raise ValueError(f"the line '{line[:80]}' of the adapter is no frame with a time stamp")
        plain = line[:-4]
        message = classic_frame(plain)
        if message is None:
            self._queue.put(plain)  # where python-can looks first: its own parser knows the rarer kinds
            message, _ = super()._recv_internal(0.0)
        if message is not None:
            message.timestamp = self._minutes.follow(stamp_ms, time.monotonic())
        return message, False

    def _ask_for_stamps(self) -> None:
        """The version first: what comes after it answers `Z1`, and no earlier command."""
        self._answer("V", _VERSION)
        if self._answer("Z1", _ANSWER) != b"\r":
            raise DeviceRefused(f"{self._asked} refuses 'Z1': it has no time stamps. {_REMEDY}")

    @property
    def _asked(self) -> str:
        return f'stamp = "hardware" in [devices.encoders] of the rig file: the adapter at {self.serialPortOrig.port}'

    def _answer(self, command: str, form: re.Pattern[bytes]) -> bytes:
        """What the adapter answers, in that form. DeviceStale when nothing of it comes in time."""
        self._write(command)
        came, until_s = b"", time.monotonic() + ANSWER_S
        while (found := form.search(came)) is None:
            if (left_s := until_s - time.monotonic()) <= 0.0:
                raise DeviceStale(f"{self._asked} does not answer '{command}' within {ANSWER_S:g} s. {_REMEDY}")
            came += self._waiting(left_s)
        return found[0]


def _stamp_ms(line: str) -> int | None:
    """None when the line is no frame with a stamp."""
    found = _STAMPED.fullmatch(line)
    if found is None or (found["remote"] is None and len(found["data"]) != 2 * int(found["length"])):
        return None
    stamp_ms = int(found["remote"] or found["stamp"], 16)
    return stamp_ms if stamp_ms < TURN_MS else None
