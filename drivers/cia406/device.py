"""Encoders of CiA 406 on one bus as an instrument: SYNC out, positions in, as continuous angles.

One thread uses it at a time, except `close`. `read` sends the SYNCs; while nobody reads, nothing is sampled.
"""

from collections.abc import Sequence

import can
import canopen

from drivers.cia406 import objects
from drivers.cia406.angle import SPEED_LIMIT_RAD_S, ContinuousAngle
from drivers.cia406.codec import Emergency, extract
from drivers.cia406.configuration import EncoderIdentity, EncoderObjects, check_profile, configure
from drivers.cia406.cycle import Row, SyncCycle
from drivers.cia406.network import (
    SEND_LIMIT_S,
    BoundedNetwork,
    OpenBus,
    listening,
    lost_as_device_lost,
    opened,
    shut_down,
)
from drivers.cia406.rows import WatchedRow, to_block
from drivers.cia406.watch import NodeWatch
from drivers.clock import Clock, SystemClock
from drivers.device import Block, Channel
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale

MAX_SYNC_HZ = 1000.0  # six encoders fill half of a bus of 1 Mbit/s
SILENT_S = 0.5  # a node that answers no SYNC for so long is gone
BATCH_S = 0.02  # rows gathered in one block; more only delays a reader
SYNC = can.Message(arbitration_id=objects.SYNC_ID, is_extended_id=False)
NMT_START, NMT_PRE_OPERATIONAL = 0x01, 0x80


class Cia406Encoders:
    """A `drivers.device.Device`. Channels: position_rad (node,), NaN where no answer came; emergency_code (node,).

    device_s is when the SYNC was sent, by the host's clock, which is when all encoders latch: they have no clock of
    their own. `Cia406Encoders(bus_opener("socketcan", "can0", 1_000_000), nodes=[1, 2, 3, 4, 5, 6])`.
    """

    def __init__(
        self,
        open_bus: OpenBus,
        nodes: Sequence[int],
        sync_hz: float = 200.0,
        *,
        name: str = "encoders",
        clock: Clock | None = None,
        speed_limit_rad_s: float = SPEED_LIMIT_RAD_S,
    ) -> None:
        """ValueError for a rate beyond 1 to 1000 Hz, no nodes, one twice, or one that CANopen does not have."""
        _check(name, nodes, sync_hz)
        self.name = name
        self.nodes = tuple(nodes)
        self.identities: tuple[EncoderIdentity, ...] = ()
        self._open_bus = open_bus
        self._period_s = 1.0 / sync_hz
        self._batch = max(1, round(BATCH_S * sync_hz))
        self._clock: Clock = SystemClock() if clock is None else clock
        self._speed_limit_rad_s = speed_limit_rad_s
        self._bus: can.BusABC | None = None
        self._operational = False
        self._cycle = SyncCycle(len(self.nodes), self._period_s, 0.0, 0)
        self._angles: tuple[ContinuousAngle, ...] = ()
        self._node_of_pdo: dict[int, int] = {}  # CAN identifier to place in `nodes`
        self._watch = NodeWatch(name, self.nodes)
        self._bad_lines = 0
        self._rows: list[WatchedRow] = []

    @property
    def emergencies(self) -> tuple[Emergency, ...]:
        """All that came, in order; the newest 256."""
        return self._watch.emergencies

    @property
    def bad_frames(self) -> int:
        """Lines and frames that made no sense, and were left out."""
        return self._bad_lines + self._watch.bad_frames

    # --- verbs

    def connect(self) -> None:
        """Find, check and start every encoder. DeviceLost (no bus), DeviceStale (nodes missing), DeviceRefused."""
        self.close()
        bus = self._bus = opened(self._open_bus, self.name)
        try:
            with lost_as_device_lost(self.name, "setting up"):
                self._set_up(bus)
        except BaseException:
            self.close()
            raise

    def describe(self) -> tuple[Channel, ...]:
        """The resolution, that of the coarsest encoder, is known once connected."""
        count_rad = max((abs(identity.scale.unit_rad) for identity in self.identities), default=0.0)
        shape = (len(self.nodes),)
        return (
            Channel("position_rad", "rad", shape, float("inf"), count_rad),
            Channel("emergency_code", "", shape),
        )

    def read(self, timeout_s: float) -> Block:
        deadline_s = self._clock.now_s() + timeout_s
        with lost_as_device_lost(self.name, "reading"):
            while len(self._rows) < self._batch:
                now_s = self._clock.now_s()
                if now_s >= deadline_s:
                    break
                self._keep_pace(now_s)
                self._take(self._receive(min(self._cycle.wakes_s, deadline_s) - now_s))
        if not self._rows:
            raise DeviceStale(
                f"{self.name}: no encoder answered a SYNC within {timeout_s:g} s; check power, bus and bitrate"
            )
        rows, self._rows = self._rows, []
        return to_block(rows)

    def close(self) -> None:
        bus, self._bus = self._bus, None
        if bus is None:
            return
        try:
            with lost_as_device_lost(self.name, "closing"):
                for node in self.nodes:
                    bus.send(_nmt(NMT_PRE_OPERATIONAL, node), SEND_LIMIT_S)
        except DeviceLost:
            pass  # nobody is left to be told
        finally:
            self._stop_taking()
            shut_down(bus)

    # --- setting up

    def _set_up(self, bus: can.BusABC) -> None:
        network = BoundedNetwork(bus)
        self._stop_taking()
        self._watch.forget_codes()
        with listening(network, bus, self._take):
            self.identities = self._configured(network)
            for node in self.nodes:
                bus.send(_nmt(NMT_START, node), SEND_LIMIT_S)
        self._angles = tuple(ContinuousAngle(i.scale, self._speed_limit_rad_s) for i in self.identities)
        self._node_of_pdo = {identity.pdo_id: place for place, identity in enumerate(self.identities)}
        if len(self._node_of_pdo) < len(self.nodes):
            raise DeviceRefused(f"{self.name}: two encoders send TPDO2 under one identifier; correct their 1801h:01")
        start_s = self._clock.now_s()
        sequence = self._cycle.next_sequence
        self._cycle = SyncCycle(len(self.nodes), self._period_s, start_s, sequence + 1 if sequence else 0)
        self._operational = True
        self._watch.set_operational(True)

    def _stop_taking(self) -> None:
        """Positions, heartbeats and boot-ups mean nothing until the set-up is done; emergencies do."""
        self._operational = False
        self._watch.set_operational(False)

    def _configured(self, network: canopen.Network) -> tuple[EncoderIdentity, ...]:
        """All missing nodes are named in one error, not one after the other."""
        encoders: list[EncoderObjects] = []
        missing: list[int] = []
        for node in self.nodes:
            remote = network.add_node(canopen.RemoteNode(node, canopen.ObjectDictionary()))
            remote.nmt.send_command(NMT_PRE_OPERATIONAL)
            encoders.append(EncoderObjects(self.name, node, remote))
        for encoder in encoders:
            try:
                check_profile(encoder)
            except DeviceStale:
                missing.append(encoder.number)
        if missing:
            raise DeviceStale(
                f"{self.name}: no answer from encoder node {', '.join(map(str, missing))} of {len(self.nodes)}; "
                "check power, node numbers, bit rate and bus termination"
            )
        return tuple(configure(encoder) for encoder in encoders)

    # --- streaming

    def _keep_pace(self, now_s: float) -> None:
        self._add(self._cycle.give_up(now_s))
        self._check_silence(now_s)
        if self._cycle.sync_due(now_s):
            self._connected().send(SYNC, SEND_LIMIT_S)
            self._cycle.sent(now_s)

    def _receive(self, timeout_s: float) -> can.Message | None:
        try:
            return self._connected().recv(max(timeout_s, 0.0))
        except (ValueError, IndexError):  # python-can's parser on a damaged line of a serial adapter
            self._bad_lines += 1
            return None

    def _take(self, message: can.Message | None) -> None:
        """One frame: a position, a heartbeat, an emergency, or nothing of ours."""
        if message is None or message.is_extended_id or message.is_remote_frame or message.is_error_frame:
            return
        place = self._node_of_pdo.get(message.arbitration_id)
        if self._operational and place is not None:
            self._take_position(place, bytes(message.data))
            return
        self._watch.take(message.arbitration_id, bytes(message.data), self._clock.now_s())

    def _take_position(self, place: int, data: bytes) -> None:
        units = extract(self.identities[place].mapping, data, objects.POSITION)
        if units is None:
            self._bad_lines += 1
        elif self._cycle.awaits(place):
            now_s = self._clock.now_s()
            self._add(self._cycle.answer(place, self._angles[place].follow(units, now_s), now_s))

    def _check_silence(self, now_s: float) -> None:
        silent = self._cycle.silent(SILENT_S, now_s)
        if not silent:
            return
        alive = self._watch.heard_within(silent, SILENT_S, now_s)
        remedy = "its heartbeat goes on: check SYNC and TPDO2" if alive else "check its power, cable and termination"
        mute = ", ".join(str(self.nodes[place]) for place in silent)
        raise DeviceStale(f"{self.name}: encoder {mute} has answered no SYNC for {SILENT_S:g} s; {remedy}")

    def _add(self, row: Row | None) -> None:
        if row is not None:
            self._rows.append((row, self._watch.codes))

    def _connected(self) -> can.BusABC:
        bus = self._bus
        if bus is None:
            raise DeviceLost(f"{self.name}: not connected; call connect() first")
        return bus


def _check(name: str, nodes: Sequence[int], sync_hz: float) -> None:
    if not 1.0 <= sync_hz <= MAX_SYNC_HZ:
        raise ValueError(f"{name}: sync_hz {sync_hz!r}; give 1 to {MAX_SYNC_HZ:g}")
    if not nodes or len(set(nodes)) != len(nodes) or not all(1 <= node <= 127 for node in nodes):
        raise ValueError(f"{name}: nodes {list(nodes)}; give different numbers from 1 to 127")


def _nmt(command: int, node: int) -> can.Message:
    return can.Message(arbitration_id=0, data=[command, node], is_extended_id=False)
