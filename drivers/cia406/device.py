"""Encoders of CiA 406 on one bus as an instrument: SYNC out, positions in, as continuous angles.

One thread uses it at a time, except `close`. `read` sends the SYNCs; while nobody reads, nothing is sampled.
"""

import math
from collections.abc import Callable, Sequence

import can
import canopen

from drivers.cia406 import codec
from drivers.cia406.codec import SPEED_LIMIT_RAD_S, ContinuousAngle, Emergency, MappedNumber, Slip, mapped_number
from drivers.cia406.configuration import (
    HEARTBEAT_MS,
    NMT_PRE_OPERATIONAL,
    NMT_START,
    SEND_LIMIT_S,
    BoundedNetwork,
    EncoderIdentity,
    EncoderObjects,
    configured,
    listening,
    nmt,
    preset,
    set_direction,
)
from drivers.cia406.cycle import Row, SyncCycle, WatchedRow, to_block
from drivers.cia406.health import NodeWatch
from drivers.clock import Clock
from drivers.device import Block, Channel, Stamps, StreamDevice
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale
from drivers.transports.can_bus import BusFault, BusFaults, OpenBus, lost_as_device_lost, opened, received, shut_down

MAX_SYNC_HZ = 1000.0  # six encoders fill half of a bus of 1 Mbit/s
SILENT_S = 0.5  # a node that answers no SYNC for so long is gone
HEARTBEAT_GOES_ON_S = 0.49  # of SILENT_S: a heartbeat this fresh is one of after the silence began
BATCH_S = 0.02  # rows gathered in one block; more only delays a reader
TOGETHER_S = 1.1e-3  # answers wait so long for the next SYNC: at 1 kHz one waking a row in place of two or more
SYNC = can.Message(arbitration_id=codec.SYNC_ID, is_extended_id=False)


class Cia406Encoders(StreamDevice[can.BusABC]):
    """A `drivers.device.Device`. Channels: position_rad (node,), NaN where no answer came; emergency_code (node,);
    slip_rad (node,), the sum of all steps that were no motion; bus_errors, error frames so far.

    device_s is when the SYNC was sent, by the host's clock, which is when all encoders latch: they have no clock of
    their own. host_s is when the last answer was taken, TOGETHER_S after it came at most.
    `Cia406Encoders(bus_opener("socketcan", "can0", 1_000_000), nodes=[1, 2, 3, 4, 5, 6])`.
    """

    stamps: Stamps = "sent"

    def __init__(
        self,
        open_bus: OpenBus,
        nodes: Sequence[int],
        sync_hz: float = 200.0,
        *,
        name: str = "encoders",
        clock: Clock | None = None,
        speed_limit_rad_s: float = SPEED_LIMIT_RAD_S,
        acceleration_limit_rad_s2: float = math.inf,
    ) -> None:
        """ValueError for a rate beyond 1 to 1000 Hz, no nodes, one twice, or one that CANopen does not have."""
        _check(name, nodes, sync_hz)
        super().__init__(name, clock)
        self.nodes = tuple(nodes)
        self.identities: tuple[EncoderIdentity, ...] = ()
        self._open_bus = open_bus
        self._period_s = 1.0 / sync_hz
        self._batch = max(1, round(BATCH_S * sync_hz))
        self._limits = speed_limit_rad_s, acceleration_limit_rad_s2
        self._operational = False
        self._cycle = SyncCycle(len(self.nodes), self._period_s, 0.0, 0)
        self._angles: tuple[ContinuousAngle, ...] = ()
        self._positions: tuple[MappedNumber, ...] = ()
        self._node_of_pdo: dict[int, int] = {}  # CAN identifier to place in `nodes`
        self._watch = NodeWatch(name, self.nodes, HEARTBEAT_MS * 1e-3, self._period_s)
        self._faults = BusFaults(name)
        self._bad_lines = 0
        self._rows: list[WatchedRow] = []

    @property
    def emergencies(self) -> tuple[Emergency, ...]:
        """All that came, in order; the newest 256."""
        return self._watch.emergencies

    @property
    def bus_faults(self) -> tuple[BusFault, ...]:
        """Error frames, in order; the newest 256."""
        return self._faults.newest

    @property
    def slips(self) -> tuple[tuple[int, Slip], ...]:
        """(node, slip) of this connection, in order of nodes."""
        return tuple(
            (node, slip) for node, angle in zip(self.nodes, self._angles, strict=False) for slip in angle.slips
        )

    @property
    def bad_frames(self) -> int:
        """Lines and frames that made no sense, and were left out."""
        return self._bad_lines + self._watch.bad_frames

    # --- verbs

    def describe(self) -> tuple[Channel, ...]:
        """The resolution, that of the coarsest encoder, is known once connected."""
        count_rad = max((abs(identity.scale.unit_rad) for identity in self.identities), default=0.0)
        shape = (len(self.nodes),)
        return (
            Channel("position_rad", "rad", shape, float("inf"), count_rad),
            Channel("emergency_code", "", shape),
            Channel("slip_rad", "rad", shape),
            Channel("bus_errors", ""),
        )

    def read(self, timeout_s: float) -> Block:
        now_s = self._clock.now_s()
        deadline_s = now_s + timeout_s
        with lost_as_device_lost(self.name, "reading"):
            while len(self._rows) < self._batch:
                if now_s >= deadline_s:
                    break
                due_s = max(now_s, min(self._cycle.wakes_s, deadline_s))
                messages = self._receive(due_s - now_s)
                now_s = self._clock.now_s()
                # This thread sent no SYNC meanwhile: no silence of the encoders.
                deadline_s += self._watch.heartbeats.woke(now_s - due_s)
                # Before the work on what came, which is of earlier SYNCs: it would delay this one, and its answers.
                sent = now_s >= self._cycle.wakes_s and self._keep_pace(now_s)
                self._take_all(messages, now_s)
                if sent:
                    self._cycle.sent(now_s)
            self._watch.check_heartbeats()
        if not self._rows:
            raise DeviceStale(
                f"{self.name}: no encoder answered a SYNC within {timeout_s:g} s; check power, bus and bitrate"
            )
        rows, self._rows = self._rows, []
        return to_block(rows)

    def preset(self, node: int, angle_rad: float, *, store: bool = False) -> None:
        """The present position of that encoder reads `angle_rad` from now on; all are set up again. DeviceRefused."""
        place = self._place(node)
        self._change(place, lambda encoder: preset(encoder, self.identities[place].scale, angle_rad, store=store))

    def set_direction(self, node: int, *, counter_clockwise: bool) -> None:
        """Which way of turning makes the encoder's own count rise; angles stay counter-clockwise positive."""
        self._change(self._place(node), lambda encoder: set_direction(encoder, counter_clockwise=counter_clockwise))

    # --- setting up

    def _open(self) -> can.BusABC:
        return opened(self._open_bus, self.name)

    def _set_up(self, line: can.BusABC) -> None:
        """Find, check and start every encoder. DeviceLost (no bus), DeviceStale (nodes missing), DeviceRefused."""
        with lost_as_device_lost(self.name, "setting up"):
            self._start(line)

    def _release(self, line: can.BusABC) -> None:
        try:
            with lost_as_device_lost(self.name, "closing"):
                for node in self.nodes:
                    line.send(nmt(NMT_PRE_OPERATIONAL, node), SEND_LIMIT_S)
        except DeviceLost:
            pass  # nobody is left to be informed
        finally:
            self._stop_taking()
            shut_down(line)

    def _place(self, node: int) -> int:
        if node not in self.nodes:
            raise ValueError(f"{self.name}: no encoder {node}; there are {', '.join(map(str, self.nodes))}")
        return self.nodes.index(node)

    def _change(self, place: int, change: Callable[[EncoderObjects], None]) -> None:
        """Parameters are writable in the pre-operational state only (CiA 406); then everything is set up again."""
        bus, number = self._opened(), self.nodes[place]
        with lost_as_device_lost(self.name, "setting up"):
            self._stop_taking()
            network = BoundedNetwork(bus)
            with listening(network, bus, self._take):
                remote = network.add_node(canopen.RemoteNode(number, canopen.ObjectDictionary()))
                remote.nmt.send_command(NMT_PRE_OPERATIONAL)
                change(EncoderObjects(self.name, number, remote))
            self._start(bus)

    def _start(self, bus: can.BusABC) -> None:
        network = BoundedNetwork(bus)
        self._stop_taking()
        self._watch.forget_codes()
        with listening(network, bus, self._take):
            self.identities = configured(self.name, network, self.nodes)
            for node in self.nodes:
                bus.send(nmt(NMT_START, node), SEND_LIMIT_S)
        self._angles = tuple(ContinuousAngle(i.scale, *self._limits) for i in self.identities)
        self._positions = tuple(self._position_of(identity) for identity in self.identities)
        self._node_of_pdo = {identity.pdo_id: place for place, identity in enumerate(self.identities)}
        if len(self._node_of_pdo) < len(self.nodes):
            raise DeviceRefused(f"{self.name}: two encoders send TPDO2 under one identifier; correct their 1801h:01")
        start_s = self._clock.now_s()
        self._cycle = SyncCycle(len(self.nodes), self._period_s, start_s, self._cycle.sequence_at(start_s))
        self._operational = True
        self._watch.set_operational(True, start_s)

    def _position_of(self, identity: EncoderIdentity) -> MappedNumber:
        number = mapped_number(identity.mapping, codec.POSITION)
        if number is None:
            raise DeviceRefused(f"{self.name}: encoder {identity.node} keeps its position (6004h) out of 1A01h")
        return number

    def _stop_taking(self) -> None:
        """Positions, heartbeats and boot-ups mean nothing until the set-up is done; emergencies do."""
        self._operational = False
        self._watch.set_operational(False, self._clock.now_s())

    # --- streaming

    def _keep_pace(self, now_s: float) -> bool:
        """Whether a SYNC was due, and went out."""
        self._check_silence(now_s)
        due = self._cycle.sync_due(now_s)
        if due:
            self._opened().send(SYNC, SEND_LIMIT_S)
        return due

    def _receive(self, timeout_s: float) -> list[can.Message]:
        """What came; waits for it at most `timeout_s`, and when that is short to its end: one waking for all."""
        if 0.0 < timeout_s <= TOGETHER_S:
            self._clock.sleep_s(timeout_s)
            timeout_s = 0.0
        try:
            return received(self._line or self._opened(), max(timeout_s, 0.0))
        except (ValueError, IndexError):  # python-can's parser on a damaged line of a serial adapter
            self._bad_lines += 1
            return []

    def _take_all(self, messages: Sequence[can.Message], now_s: float) -> None:
        if not messages:
            self._watch.check_heartbeats()
            self._add(self._cycle.give_up(now_s))
            return
        self._watch.heartbeats.look(now_s)
        cycle, place_of = self._cycle, self._node_of_pdo.get
        for message in messages:
            place = place_of(message.arbitration_id)
            if place is None or message.is_extended_id or message.is_remote_frame or message.is_error_frame:
                self._take(message, now_s)
                continue
            units = self._positions[place].read(message.data)
            if units is None:
                self._bad_lines += 1
            elif cycle.awaits(place):
                rows = cycle.answer(place, self._angles[place].follow(units, now_s), now_s)
                if rows:
                    self._add(rows)

    def _take(self, message: can.Message, now_s: float | None = None) -> None:
        """A heartbeat, an emergency, an error, or nothing of ours; heard now unless a time is given."""
        at_s = self._clock.now_s() if now_s is None else now_s
        if message.is_error_frame:
            self._faults.take(message, at_s)
        elif not (message.is_extended_id or message.is_remote_frame):
            self._watch.take(message.arbitration_id, bytes(message.data), at_s)

    def _check_silence(self, now_s: float) -> None:
        # No more than twice as long: benches stop their arm after 1 s.
        silent = self._cycle.silent(SILENT_S + min(self._watch.heartbeats.busy_s, SILENT_S), now_s)
        if not silent:
            return
        self._faults.check(self._opened())
        alive = self._watch.heard_within(silent, HEARTBEAT_GOES_ON_S, now_s)
        busy = self._watch.heartbeats.excuse()
        remedy = "its heartbeat goes on: check SYNC and TPDO2" if alive else "check its power, cable and termination"
        mute = ", ".join(str(self.nodes[place]) for place in silent)
        raise DeviceStale(f"{self.name}: encoder {mute} has answered no SYNC for {SILENT_S:g} s; {busy}{remedy}")

    def _add(self, rows: Sequence[Row]) -> None:
        for row in rows:
            slips_rad = tuple([angle.slip_rad for angle in self._angles])
            self._rows.append(WatchedRow(row, self._watch.codes, slips_rad, self._faults.count))


def _check(name: str, nodes: Sequence[int], sync_hz: float) -> None:
    if not 1.0 <= sync_hz <= MAX_SYNC_HZ:
        raise ValueError(f"{name}: sync_hz {sync_hz!r}; give 1 to {MAX_SYNC_HZ:g}")
    if not nodes or len(set(nodes)) != len(nodes) or not all(1 <= node <= 127 for node in nodes):
        raise ValueError(f"{name}: nodes {list(nodes)}; give different numbers from 1 to 127")
