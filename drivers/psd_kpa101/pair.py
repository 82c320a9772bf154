"""Two KPA101 units as one detector instrument: asked together, at fixed deadlines, read as the currents of both faces.

A unit has no clock: `device_s` is the middle between question and last answer by the host's clock. The two faces are
read `round_trip_s` apart at most. One thread uses it at a time, except `close`. It starts no thread of its own.

`Wiring` is how counts read as volts, and volts as the currents of a face. Neither the sign of x nor the scale of the
sum is certain from documents (clients differ, docs/protocols/kpa101.md): both are stated in the rig and measured by
`selfcheck`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.device import Block, Channel, Stamps, StreamDevice
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale, WireError
from drivers.psd_daq.messages import FaceIdentity, Flag, Identity
from drivers.psd_faces import FaceKind
from drivers.psd_kpa101.messages import FULL_COUNT, FULL_SCALE_V, FULL_SUM_COUNT, Info, Readings
from drivers.psd_kpa101.unit import Kpa101Unit
from drivers.transports.transport import Transport

BAUD = 115_200
MIN_RATE_HZ, MAX_RATE_HZ = 1.0, 400.0  # a question and its answer are 24 bytes: 480 a second fill the line
REPLY_S = 0.1  # as long as 48 readings take: a reply that late is given up
BATCH_S = 0.02  # rows gathered in one block; more only delays a reader
DIFFERENCES, SUMS = "difference_counts", "sum_counts"
OpenLine = Callable[[], Transport]
Floats = NDArray[np.float64]
HEADS = (FaceKind.PIN_CUSHION, FaceKind.QUADRANT)  # PDP90A; PDQ80A, PDQ30C
DARK_V = 0.02  # 0.2 % of full scale, as for the DAQ box: 66 counts of the differences
SATURATED = (Flag.PSD1_SATURATED, Flag.PSD2_SATURATED)
NO_LIGHT = (Flag.PSD1_NO_LIGHT, Flag.PSD2_NO_LIGHT)


@dataclass(frozen=True)
class Wiring:
    """One unit and its head. ValueError for a sign that is none, or scales not above 0."""

    x_sign: int = -1
    y_sign: int = 1
    sum_full_scale_v: float = 10.0  # at 65535 counts
    transimpedance_v_a: float = 1e5  # of the head; 100 kV/A in a PDP90A; places no spot

    def __post_init__(self) -> None:
        if self.x_sign not in (-1, 1) or self.y_sign not in (-1, 1):
            raise ValueError(f"x_sign {self.x_sign!r}, y_sign {self.y_sign!r}; give 1 or -1")
        if not (self.sum_full_scale_v > 0.0 and self.transimpedance_v_a > 0.0):
            raise ValueError(f"sum_full_scale_v and transimpedance_v_a must be above 0, not {self}")

    def volts(self, counts: NDArray[np.int64]) -> Floats:
        """(sample, 3) counts of x, y, sum to V."""
        per_count = FULL_SCALE_V / FULL_COUNT
        return counts.astype(np.float64) * np.array(
            [self.x_sign * per_count, self.y_sign * per_count, self.sum_full_scale_v / FULL_SUM_COUNT]
        )


def currents(signal_v: Floats, transimpedance_v_a: float) -> Floats:
    """Corner currents (sample, 4) A, in the order of a pin-cushion or quadrant face, with these differences and sum.

    The unit gives three signals of four currents. Whatever the fourth was, the spot is a function of these three, so
    currents with the same signals read as the same spot: nothing is lost, nothing added.
    """
    x, y, total = np.moveaxis(signal_v / transimpedance_v_a, -1, 0)
    return 0.25 * np.stack([total - x + y, total + x + y, total + x - y, total - x - y], axis=-1)


def flags(place: int, counts: NDArray[np.int64], signal_v: Floats) -> NDArray[np.uint16]:
    """Flags (sample,) of unit `place`, 0 or 1: a count at its end, and no light."""
    at_end = (np.abs(counts[:, :2]) >= FULL_COUNT).any(axis=1) | (counts[:, 2] >= FULL_SUM_COUNT)
    dark = signal_v[:, 2] < DARK_V
    return (at_end * int(SATURATED[place]) + dark * int(NO_LIGHT[place])).astype(np.uint16)


@dataclass(frozen=True)
class Head:
    """The detector at one unit. `serial_number` of the unit, when the rig names it: two units are soon exchanged."""

    kind: FaceKind
    length_m: float
    wiring: Wiring = field(default_factory=Wiring)
    serial_number: str | None = None

    def __post_init__(self) -> None:
        if self.kind not in HEADS:
            names = ", ".join(kind.name for kind in HEADS)
            raise ValueError(f"head of kind {self.kind.name}: a KPA101 takes {names}")


@dataclass(frozen=True)
class _PairRow:
    sequence: int
    asked_s: float
    arrived_s: float
    readings: tuple[Readings, Readings]
    round_trip_s: tuple[float, float]


class Kpa101Pair(StreamDevice[tuple[Kpa101Unit, ...]]):
    """A `drivers.device.Device`. Channels: photocurrent_a (8,), flags, difference_counts (4,), sum_counts (2,),
    round_trip_s (2,).

    Counts are as sent: x, y of unit 1, then of unit 2; each unit's sum, which has a scale of its own. `photocurrent_a`
    are corner currents with the same differences and sum, four for each face (see `Wiring`), so that all that reads a
    DAQ box reads a pair of units.
    """

    stamps: Stamps = "sent"

    def __init__(
        self,
        open_lines: tuple[OpenLine, OpenLine],
        heads: tuple[Head, Head],
        rate_hz: float = 200.0,
        *,
        name: str = "psd",
        clock: Clock | None = None,
        hurry: float = 1.0,
    ) -> None:
        """ValueError for a rate beyond 1 to 400 Hz. `hurry`: device seconds in one second of this program's clock."""
        if not MIN_RATE_HZ <= rate_hz <= MAX_RATE_HZ:
            raise ValueError(
                f"{name}: rate_hz {rate_hz!r}; two KPA101 at 115200 baud give {MIN_RATE_HZ:g} to {MAX_RATE_HZ:g}"
            )
        super().__init__(name, clock)
        self.identity: Identity | None = None
        self.missed_replies = 0
        self._heads = heads
        self._period_s = 1.0 / rate_hz
        self._batch = max(1, round(BATCH_S * rate_hz))
        self._hurry = hurry
        self._units = tuple(
            Kpa101Unit(f"{name} unit {place}", open_line, self._clock) for place, open_line in enumerate(open_lines, 1)
        )
        self._start_s = 0.0
        self._first = self._next = 0

    @property
    def bad_frame_count(self) -> int:
        """Runs of bytes that were no message, on both lines."""
        return sum(unit.junk_count for unit in self._units)

    def _open(self) -> tuple[Kpa101Unit, ...]:
        return self._units

    def _set_up(self, line: tuple[Kpa101Unit, ...]) -> None:
        """Both units identified and in monitor mode. DeviceLost, DeviceStale (silent), DeviceRefused (exchanged)."""
        infos = [unit.identify() for unit in line]
        self._check_serial_numbers(infos)
        self.identity = self._identity(infos)
        self._start_s = self._clock.now_s()
        self._first += self._next + 1 if self._next else 0  # what passed between is not known to be nothing
        self._next = 0

    def describe(self) -> tuple[Channel, ...]:
        transimpedance_v_a = min(head.wiring.transimpedance_v_a for head in self._heads)
        count_a = 0.5 * FULL_SCALE_V / FULL_COUNT / transimpedance_v_a
        return (
            Channel("photocurrent_a", "A", (8,), FULL_SCALE_V / transimpedance_v_a, count_a),
            Channel("flags", ""),
            Channel(DIFFERENCES, "", (4,), float(FULL_COUNT), 1.0),
            Channel(SUMS, "", (2,), float(FULL_SUM_COUNT), 1.0),
            Channel("round_trip_s", "s", (2,)),
        )

    def read(self, timeout_s: float) -> Block:
        deadline_s = self._clock.now_s() + timeout_s
        junk_before = self.bad_frame_count
        rows: list[_PairRow] = []
        while len(rows) < self._batch and (now_s := self._clock.now_s()) < deadline_s:
            due_s = self._start_s + self._next * self._period_s
            if now_s < due_s:
                self._clock.sleep_s(min(due_s, deadline_s) - now_s)
                continue
            row = self._sample(now_s, deadline_s)
            rows += [row] if row is not None else []
        if not rows:
            raise self._no_samples(timeout_s, junk_before)
        return self._block(rows)

    def _release(self, line: tuple[Kpa101Unit, ...]) -> None:
        for unit in line:
            unit.close()

    # --- sampling

    def _sample(self, now_s: float, deadline_s: float) -> _PairRow | None:
        """Both units asked at once; None when one did not answer."""
        number = max(self._next, math.floor((now_s - self._start_s) / self._period_s))
        self._next = number + 1
        asked_s, readings, arrived_s = list[float](), list[Readings](), list[float]()
        for unit in self._units:
            if not unit.request(min(deadline_s, self._clock.now_s() + REPLY_S)):
                return self._missed()
            asked_s.append(self._clock.now_s())
        give_up_s = min(deadline_s, asked_s[-1] + REPLY_S)
        for unit in self._units:
            reading = unit.fetch(give_up_s)
            arrived_s.append(self._clock.now_s())
            readings += [reading] if reading is not None else []
        if len(readings) < len(self._units):
            return self._missed()
        trips_s = (arrived_s[0] - asked_s[0], arrived_s[1] - asked_s[1])
        return _PairRow(self._first + number, asked_s[0], arrived_s[-1], (readings[0], readings[1]), trips_s)

    def _missed(self) -> None:
        self.missed_replies += 1

    def _block(self, rows: Sequence[_PairRow]) -> Block:
        counts = np.array([[[r.x, r.y, r.sum] for r in row.readings] for row in rows], dtype=np.int64)
        signal_v = [head.wiring.volts(counts[:, place]) for place, head in enumerate(self._heads)]
        current_a = [
            currents(signal, head.wiring.transimpedance_v_a) for signal, head in zip(signal_v, self._heads, strict=True)
        ]
        both_flags: NDArray[np.uint16] = flags(0, counts[:, 0], signal_v[0]) | flags(1, counts[:, 1], signal_v[1])
        middle_s = np.array([0.5 * (row.asked_s + row.arrived_s) for row in rows])
        return Block(
            host_s=np.array([row.arrived_s for row in rows]),
            device_s=middle_s * self._hurry,
            sequence=np.array([row.sequence for row in rows], dtype=np.int64),
            values={
                "photocurrent_a": np.concatenate(current_a, axis=1),
                "flags": both_flags,
                DIFFERENCES: counts[:, :, :2].reshape(-1, 4).astype(np.int32),
                SUMS: counts[:, :, 2].astype(np.int32),
                "round_trip_s": np.array([row.round_trip_s for row in rows]),
            },
        )

    # --- who is there

    def _check_serial_numbers(self, infos: Sequence[Info]) -> None:
        found = [str(info.serial_number) for info in infos]
        if found[0] == found[1]:
            raise DeviceRefused(f"{self.name}: both ports lead to unit {found[0]}; name two units in the rig file")
        for place, (head, number) in enumerate(zip(self._heads, found, strict=True), 1):
            if head.serial_number is not None and head.serial_number != number:
                raise DeviceRefused(
                    f"{self.name}: unit {place} is {number}, the rig file has {head.serial_number}; "
                    "exchange the ports or the serial numbers in the rig file"
                )

    def _identity(self, infos: Sequence[Info]) -> Identity:
        """Both units as one box; its currents are corner currents, whatever the head."""
        transimpedance_v_a = self._heads[0].wiring.transimpedance_v_a
        one, other = (FaceIdentity(head.kind, head.length_m) for head in self._heads)
        return Identity(
            firmware=" and ".join(dict.fromkeys(info.firmware for info in infos)),
            serial_number=", ".join(str(info.serial_number) for info in infos),
            model=" and ".join(dict.fromkeys(info.model for info in infos)),
            full_scale_a=FULL_SCALE_V / transimpedance_v_a,
            transimpedance_v_a=transimpedance_v_a,
            faces=(one, other),
            min_rate_hz=int(MIN_RATE_HZ),
            max_rate_hz=int(MAX_RATE_HZ),
        )

    def _no_samples(self, timeout_s: float, junk_before: int) -> DeviceStale | WireError | DeviceLost:
        junk = next((unit.last_junk for unit in self._units if unit.last_junk is not None), None)
        if self.bad_frame_count > junk_before and junk is not None:
            return WireError(
                f"{self.name}: bytes that are no message and no reading of both units within {timeout_s:g} s; the last "
                f"at byte {junk.offset}: {junk.first.hex(' ')}; check the cables and that {BAUD} baud is set"
            )
        return DeviceStale(
            f"{self.name}: no reading of both units within {timeout_s:g} s; check power and cables of both"
        )


def counts_of(values: Mapping[str, NDArray[Any]], unit: int) -> NDArray[np.int64] | None:
    """x, y, sum (sample, 3) of unit 1 or 2 as sent, from the values of a block; None when it is of no KPA101."""
    if DIFFERENCES not in values:
        return None
    pair = values[DIFFERENCES][:, 2 * unit - 2 : 2 * unit]
    return np.column_stack([pair, values[SUMS][:, unit - 1]]).astype(np.int64)
