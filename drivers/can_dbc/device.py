"""Plain encoders on CAN that send by themselves, described by a DBC file, as an instrument.

Nothing is ever sent: a bus with another master is only listened to. The encoders are not synchronous; how old each
reading was when the row was complete is a channel. Times are those of arrival here, or the adapter's own. One thread
uses it at a time, except `close`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import can
import numpy as np

from drivers.can_dbc.description import JointSignal
from drivers.can_dbc.rows import EncoderReading, EncoderRow, RowsOfFrames
from drivers.cia406.codec import SPEED_LIMIT_RAD_S
from drivers.clock import Clock
from drivers.device import Block, Channel, Stamps, StreamDevice
from drivers.errors import DeviceStale
from drivers.transports.can_bus import BusFaults, OpenBus, lost_as_device_lost, opened, shut_down

SILENT_S = 0.5  # an encoder that sends nothing for so long is gone
BATCH_S = 0.02  # rows gathered in one block; more only delays a reader


@dataclass(frozen=True)
class _TimedRow:
    """One row, and the state of things at that time."""

    sequence: int
    host_s: float  # when it was complete
    done_s: float  # the same by the clock of the stamps
    row: EncoderRow
    bus_errors: int


class CanDbcEncoders(StreamDevice[can.BusABC]):
    """A `drivers.device.Device`. Channels: position_rad (joint,), NaN where there is none; no_reading
    (joint,), why: 0 or the value of a `NoReading`; age_s (joint,); slip_rad (joint,); bus_errors, error frames so far.

    A row is complete when every encoder has sent, or when one sends again before the others did. Rows from before a
    failure come with the next read.
    """

    def __init__(
        self,
        open_bus: OpenBus,
        joints: Sequence[JointSignal],
        *,
        name: str = "encoders",
        clock: Clock | None = None,
        stamps: Literal["arrived", "hardware"] = "arrived",
        speed_limit_rad_s: float = SPEED_LIMIT_RAD_S,
        acceleration_limit_rad_s2: float = math.inf,
    ) -> None:
        """`stamps`: "hardware" only where messages of the bus carry the adapter's time. ValueError for no joints."""
        if not joints:
            raise ValueError(f"{name}: no signals; name one per joint")
        super().__init__(name, clock)
        self.joints = tuple(joints)
        self.stamps: Stamps = stamps
        self._by_adapter = stamps == "hardware"
        self._open_bus = open_bus
        self._limits = speed_limit_rad_s, acceleration_limit_rad_s2
        self._faults = BusFaults(name)
        self._frames = self._new_frames()
        self._bad_before = 0
        self._sequence = 0
        self._heard_s: dict[int, float] = {}
        self._rows: list[_TimedRow] = []

    @property
    def bad_frames(self) -> int:
        """Lines and frames that made no sense, or carry other multiplexed signals, and were left out."""
        return self._bad_before + self._frames.bad_frames

    def _open(self) -> can.BusABC:
        return opened(self._open_bus, self.name)

    def _set_up(self, line: can.BusABC) -> None:
        """Hear every encoder once. DeviceStale naming those that are silent."""
        self._bad_before += self._frames.bad_frames
        self._frames = self._new_frames()
        if self._sequence:
            self._sequence += 1  # what passed between is not known to be nothing
        self._hear_all()

    def describe(self) -> tuple[Channel, ...]:
        shape = (len(self.joints),)
        count_rad = max(joint.resolution_rad for joint in self.joints)
        return (
            Channel("position_rad", "rad", shape, float("inf"), count_rad),
            Channel("no_reading", "", shape),
            Channel("age_s", "s", shape),
            Channel("slip_rad", "rad", shape),
            Channel("bus_errors", ""),
        )

    def read(self, timeout_s: float) -> Block:
        began_s = self._clock.now_s()
        with lost_as_device_lost(self.name, "reading"):
            while (left_s := self._left_s(began_s + timeout_s)) > 0.0:
                self._take(self._receive(left_s))
                if self._rows and self._clock.now_s() - began_s >= BATCH_S:
                    break
        self._check_silence()
        if not self._rows:
            raise DeviceStale(f"{self.name}: no encoder sent within {timeout_s:g} s; check power, bus and bitrate")
        rows, self._rows = self._rows, []
        return self._block(rows)

    def _release(self, line: can.BusABC) -> None:
        shut_down(line)

    # --- frames

    def _hear_all(self) -> None:
        until_s = self._clock.now_s() + 2.0 * SILENT_S
        self._heard_s, before = {}, len(self._rows)
        with lost_as_device_lost(self.name, "opening"):
            while len(self._heard_s) < len(self.joints) and (left_s := self._left_s(until_s)) > 0.0:
                self._take(self._receive(left_s))
        del self._rows[before:]  # of encoders that were not all there yet
        silent = [joint.name for place, joint in enumerate(self.joints) if place not in self._heard_s]
        if silent:
            raise DeviceStale(
                f"{self.name}: nothing heard of {', '.join(silent)} within {2.0 * SILENT_S:g} s; "
                "check power, bit rate, the bus termination, and that the DBC file is of these encoders"
            )

    def _receive(self, timeout_s: float) -> can.Message | None:
        bus = self._opened()
        try:
            return bus.recv(min(max(timeout_s, 0.0), SILENT_S))
        except (ValueError, IndexError):  # python-can's parser on a damaged line of a serial adapter
            self._bad_before += 1
            return None

    def _take(self, message: can.Message | None) -> None:
        """A frame, which may complete a row."""
        now_s = self._clock.now_s()
        if message is None or message.is_remote_frame:
            return
        if message.is_error_frame:
            self._faults.take(message, now_s)
            return
        stamp_s = message.timestamp if self._by_adapter else now_s
        frame = message.arbitration_id, message.is_extended_id
        rows = self._frames.take(frame, bytes(message.data), stamp_s)
        self._heard_s.update(dict.fromkeys(self._frames.last_read, now_s))
        for row in rows:
            self._rows.append(_TimedRow(self._sequence, now_s, stamp_s, row, self._faults.count))
            self._sequence += 1

    def _check_silence(self) -> None:
        now_s = self._clock.now_s()
        silent = [self.joints[place].name for place, heard_s in self._heard_s.items() if now_s - heard_s >= SILENT_S]
        if silent:
            self._heard_s = dict.fromkeys(self._heard_s, now_s)  # reported once, and again after as long
            raise DeviceStale(
                f"{self.name}: {', '.join(silent)} sent nothing for {SILENT_S:g} s; "
                "check its power, cable and termination"
            )

    def _block(self, rows: Sequence[_TimedRow]) -> Block:
        nothing, places = EncoderReading(math.nan, math.nan), range(len(self.joints))
        each = [[row.row.readings.get(place, nothing) for place in places] for row in rows]
        times_s = np.array([[reading.time_s for reading in row] for row in each])
        done_s = np.array([row.done_s for row in rows])
        return Block(
            host_s=np.array([row.host_s for row in rows]),
            device_s=np.nanmean(times_s, axis=1),
            sequence=np.array([row.sequence for row in rows], dtype=np.int64),
            values={
                "position_rad": np.array([[reading.angle_rad for reading in row] for row in each]),
                "no_reading": np.array([row.row.no_reading() for row in rows], dtype=np.uint8),
                "age_s": done_s[:, None] - times_s,
                "slip_rad": np.array([row.row.slip_rad for row in rows], dtype=np.float64),
                "bus_errors": np.array([row.bus_errors for row in rows], dtype=np.uint32),
            },
        )

    def _new_frames(self) -> RowsOfFrames:
        return RowsOfFrames(self.joints, *self._limits)
