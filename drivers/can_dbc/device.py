"""Plain encoders on CAN that send by themselves, described by a DBC file, as an instrument.

Nothing is ever sent: a bus with another master is only listened to. The encoders are not synchronous; how old each
reading was when the row was complete is a channel. Times are those of arrival here, or the adapter's own. One thread
uses it at a time, except `close`.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import can
import numpy as np

from drivers.can_dbc.description import JointSignal
from drivers.cia406.codec import SPEED_LIMIT_RAD_S, ContinuousAngle
from drivers.clock import Clock
from drivers.device import Block, Channel, Stamps, StreamDevice
from drivers.errors import DeviceStale
from drivers.transports.can_bus import BusFaults, OpenBus, lost_as_device_lost, opened, shut_down

SILENT_S = 0.5  # an encoder that sends nothing for so long is gone
BATCH_S = 0.02  # rows gathered in one block; more only delays a reader


@dataclass(frozen=True)
class _EncoderRow:
    """One reading of each encoder, and the state of things at that time."""

    sequence: int
    host_s: float  # when it was complete
    done_s: float  # the same by the clock of the stamps
    readings: Mapping[int, tuple[float, float]]  # place -> angle, stamp
    slip_rad: tuple[float, ...]
    bus_errors: int


class CanDbcEncoders(StreamDevice[can.BusABC]):
    """A `drivers.device.Device`. Channels: position_rad (joint,), NaN where none came; age_s (joint,); slip_rad
    (joint,); bus_errors, error frames so far.

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
        self.bad_frames = 0
        self._open_bus = open_bus
        self._limits = speed_limit_rad_s, acceleration_limit_rad_s2
        self._faults = BusFaults(name)
        self._angles = self._new_angles()
        self._places: dict[tuple[int, bool], list[int]] = {}
        for place, joint in enumerate(self.joints):
            self._places.setdefault(joint.frame, []).append(place)
        self._sequence = 0
        self._row: dict[int, tuple[float, float]] = {}  # place -> angle, stamp
        self._heard_s: dict[int, float] = {}
        self._rows: list[_EncoderRow] = []

    def _open(self) -> can.BusABC:
        return opened(self._open_bus, self.name)

    def _set_up(self, line: can.BusABC) -> None:
        """Hear every encoder once. DeviceStale naming those that are silent."""
        self._angles = self._new_angles()
        self._row.clear()
        if self._sequence:
            self._sequence += 1  # what passed between is not known to be nothing
        self._hear_all()

    def describe(self) -> tuple[Channel, ...]:
        shape = (len(self.joints),)
        count_rad = max(abs(joint.scale.unit_rad) for joint in self.joints)
        return (
            Channel("position_rad", "rad", shape, float("inf"), count_rad),
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
            self.bad_frames += 1
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
        places = self._places.get((message.arbitration_id, message.is_extended_id), [])
        if any(place in self._row for place in places):
            self._finish(now_s, stamp_s)
        data = bytes(message.data)
        for place in places:
            counts = self.joints[place].counts(data)
            if counts is None:
                self.bad_frames += 1
                continue
            angle_rad = self._angles[place].follow(counts, stamp_s) + self.joints[place].offset_rad
            self._row[place] = angle_rad, stamp_s
            self._heard_s[place] = now_s
        if len(self._row) == len(self.joints):
            self._finish(now_s, stamp_s)

    def _finish(self, now_s: float, stamp_s: float) -> None:
        readings, self._row = self._row, {}
        slips_rad = tuple(angle.slip_rad for angle in self._angles)
        self._rows.append(_EncoderRow(self._sequence, now_s, stamp_s, readings, slips_rad, self._faults.count))
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

    def _block(self, rows: Sequence[_EncoderRow]) -> Block:
        nothing = (math.nan, math.nan)
        each = np.array([[row.readings.get(place, nothing) for place in range(len(self.joints))] for row in rows])
        done_s = np.array([row.done_s for row in rows])
        return Block(
            host_s=np.array([row.host_s for row in rows]),
            device_s=np.nanmean(each[:, :, 1], axis=1),
            sequence=np.array([row.sequence for row in rows], dtype=np.int64),
            values={
                "position_rad": each[:, :, 0],
                "age_s": done_s[:, None] - each[:, :, 1],
                "slip_rad": np.array([row.slip_rad for row in rows], dtype=np.float64),
                "bus_errors": np.array([row.bus_errors for row in rows], dtype=np.uint32),
            },
        )

    def _new_angles(self) -> tuple[ContinuousAngle, ...]:
        return tuple(ContinuousAngle(joint.scale, *self._limits) for joint in self.joints)
