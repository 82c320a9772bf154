"""Brings the encoders of a bus to "position on every SYNC" over SDO: what each is, how it counts, what TPDO2 carries.

canopen does SDO and NMT, on a network with a limit on every wait and with answers read for as long as the set-up lasts.
The encoders are found and configured side by side.
"""

from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass

import can
import canopen

from drivers.cia406 import codec
from drivers.cia406.codec import MappedObject, Operating, Scale, mapped_object, scale_of
from drivers.errors import DeviceRefused, DeviceStale

SEND_LIMIT_S = 0.5  # an adapter that takes no frame for so long has stopped
LISTEN_S = 0.02  # how soon the listening thread of the set-up ends when asked
STOP_S = 5.0  # for its end, on a busy host: two readers of one bus would each get half of the frames


NMT_START, NMT_PRE_OPERATIONAL = 0x01, 0x80
ANSWER_S = 0.5  # SDO answers come within some ms; the rest is for a busy host
HEARTBEAT_MS = 400  # 1.5 of them are 0.6 s; a node that answers no SYNC is found after 0.5 s
POSITION_ENTRY = codec.POSITION << 16 | 32


class BoundedNetwork(canopen.Network):
    """canopen's network whose sending never waits without limit, as its own does on a full serial port."""

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        message = can.Message(arbitration_id=can_id, is_extended_id=can_id > 0x7FF, data=data, is_remote_frame=remote)
        if self.bus is None:
            raise can.CanOperationError("the bus is closed")
        with self.send_lock:
            self.bus.send(message, SEND_LIMIT_S)
        self.check()


class _Listener(can.Listener):
    """Shows every frame to `take` and keeps the error that ends the listening, which python-can would only print."""

    def __init__(self, take: Callable[[can.Message], None]) -> None:
        self._take = take
        self.error: Exception | None = None

    def on_message_received(self, msg: can.Message) -> None:
        self._take(msg)

    def on_error(self, exc: Exception) -> None:
        self.error = exc

    def stop(self) -> None:
        """Nothing to release."""


@contextmanager
def listening(network: canopen.Network, bus: can.BusABC, take: Callable[[can.Message], None]) -> Generator[None]:
    """Answers reach canopen for as long as this lasts, by a thread that ends with it; `take` sees every frame."""
    listener = _Listener(take)
    notifier = can.Notifier(bus, [*network.listeners, listener], LISTEN_S)
    try:
        yield
    except Exception as outcome:
        if listener.error is not None:  # the reason behind an answer that did not come
            raise can.CanOperationError(str(listener.error)) from outcome
        raise
    finally:
        notifier.stop(STOP_S)


@dataclass(frozen=True)
class EncoderIdentity:
    """What a configured encoder is and how its position is read off the bus."""

    node: int
    device_type: int
    vendor: int
    product: int
    revision: int
    serial_number: int
    scale: Scale
    pdo_id: int  # CAN identifier of its TPDO2
    mapping: tuple[MappedObject, ...]
    error_register: int  # 1001h when it was set up: not 0 while an emergency of before lasts


class EncoderObjects:
    """Objects of one node as numbers. DeviceStale when it does not answer, DeviceRefused when it aborts."""

    def __init__(self, name: str, number: int, node: canopen.RemoteNode) -> None:
        self.number = number
        self._name = name
        self._node = node
        self._node.sdo.RESPONSE_TIMEOUT = ANSWER_S

    def read(self, index: int, subindex: int = 0) -> int:
        try:
            return int.from_bytes(self._node.sdo.upload(index, subindex), "little")
        except canopen.SdoAbortedError as refusal:
            raise self._refused("reading", index, subindex, refusal) from refusal
        except canopen.SdoCommunicationError as silence:
            raise self._silent("reading", index, subindex) from silence

    def write(self, index: int, subindex: int, number: int, size: int) -> None:
        """`size` in bytes."""
        try:
            self._node.sdo.download(index, subindex, number.to_bytes(size, "little"))
        except canopen.SdoAbortedError as refusal:
            raise self._refused(f"writing {number:#x} to", index, subindex, refusal) from refusal
        except canopen.SdoCommunicationError as silence:
            raise self._silent("writing", index, subindex) from silence

    def refuse(self, why: str) -> DeviceRefused:
        return DeviceRefused(f"{self._name}: encoder {self.number} {why}")

    def _refused(self, doing: str, index: int, subindex: int, refusal: canopen.SdoAbortedError) -> DeviceRefused:
        code = int(refusal.code)
        return self.refuse(f"refused {doing} {index:04X}h:{subindex:02X}, abort 0x{code:08X} ({refusal})")

    def _silent(self, doing: str, index: int, subindex: int) -> DeviceStale:
        return DeviceStale(
            f"{self._name}: encoder {self.number} gave no answer within {ANSWER_S:g} s to {doing} "
            f"{index:04X}h:{subindex:02X}; check its power, cable and the bus termination"
        )


def check_profile(encoder: EncoderObjects) -> int:
    """The device type 1000h. DeviceRefused when it is not an encoder of CiA 406."""
    device_type = encoder.read(codec.DEVICE_TYPE)
    profile = device_type & 0xFFFF
    if profile != codec.PROFILE:
        raise encoder.refuse(
            f"is of device type 0x{device_type:08X} (1000h), profile {profile}, not 406 encoder; "
            "check the node numbers in the rig file"
        )
    return device_type


def configure(encoder: EncoderObjects) -> EncoderIdentity:
    """Position in TPDO2 on every SYNC, heartbeat on; the node must be pre-operational."""
    device_type = check_profile(encoder)
    scale = _scale(encoder)
    pdo_id, mapping = _position_on_sync(encoder)
    encoder.write(codec.HEARTBEAT_MS, 0, HEARTBEAT_MS, 2)
    vendor, product, revision, serial_number = (_optional(encoder, codec.IDENTITY, sub) for sub in (1, 2, 3, 4))
    errors = _optional(encoder, codec.ERROR_REGISTER, 0)
    return EncoderIdentity(
        encoder.number, device_type, vendor, product, revision, serial_number, scale, pdo_id, mapping, errors
    )


def preset(encoder: EncoderObjects, scale: Scale, angle_rad: float, *, store: bool) -> None:
    """The present position reads `angle_rad` from now on. DeviceRefused when the encoder refuses.

    `store` keeps it through power-off where the encoder does not by itself; its memory wears: never in a loop.
    """
    units = round(angle_rad / scale.unit_rad)
    encoder.write(codec.PRESET, 0, units % int(scale.range_units), 4)
    if store:
        encoder.write(codec.STORE, 1, codec.SAVE, 4)


def set_direction(encoder: EncoderObjects, *, counter_clockwise: bool) -> None:
    """Which way of turning makes 6004h rise; the other bits of 6000h stay."""
    operating = encoder.read(codec.OPERATING_PARAMETERS)
    wanted = operating | Operating.COUNTER_CLOCKWISE if counter_clockwise else operating & ~Operating.COUNTER_CLOCKWISE
    if wanted != operating:
        encoder.write(codec.OPERATING_PARAMETERS, 0, wanted, 2)


def _scale(encoder: EncoderObjects) -> Scale:
    operating = encoder.read(codec.OPERATING_PARAMETERS)
    scaled = bool(operating & Operating.SCALING)
    units = encoder.read(codec.UNITS_PER_TURN) if scaled else 0
    range_units = encoder.read(codec.RANGE_UNITS) if scaled else 0
    resolution, turns = encoder.read(codec.TURN_RESOLUTION), encoder.read(codec.TURNS)
    try:
        return scale_of(operating, units, range_units, resolution, max(turns, 1))  # single-turn devices may report 0
    except ValueError as cause:
        raise encoder.refuse(f"states a scale that cannot be: {cause}; check 6000h to 6002h, 6501h, 6502h") from cause


def _position_on_sync(encoder: EncoderObjects) -> tuple[int, tuple[MappedObject, ...]]:
    """Identifier and mapping of TPDO2, changed only where it does not yet send the position on every SYNC."""
    cob_id = encoder.read(codec.TPDO2_COMMUNICATION, 1)
    kind = encoder.read(codec.TPDO2_COMMUNICATION, 2)
    mapping = _mapping(encoder)
    mapped = any(entry.index == codec.POSITION and entry.bits == 32 for entry in mapping)
    if not mapped or cob_id & codec.PDO_INVALID or kind != codec.EVERY_SYNC:
        cob_id &= ~codec.PDO_INVALID
        encoder.write(codec.TPDO2_COMMUNICATION, 1, cob_id | codec.PDO_INVALID, 4)
        encoder.write(codec.TPDO2_COMMUNICATION, 2, codec.EVERY_SYNC, 1)
        if not mapped:
            _map_position(encoder)
            mapping = _mapping(encoder)
        encoder.write(codec.TPDO2_COMMUNICATION, 1, cob_id, 4)
    return cob_id & 0x7FF, mapping


def _mapping(encoder: EncoderObjects) -> tuple[MappedObject, ...]:
    count = encoder.read(codec.TPDO2_MAPPING, 0)
    return tuple(mapped_object(encoder.read(codec.TPDO2_MAPPING, entry)) for entry in range(1, count + 1))


def _map_position(encoder: EncoderObjects) -> None:
    """The sequence of CiA 301, 7.5.2.36: no entries, write them, state how many."""
    encoder.write(codec.TPDO2_MAPPING, 0, 0, 1)
    encoder.write(codec.TPDO2_MAPPING, 1, POSITION_ENTRY, 4)
    encoder.write(codec.TPDO2_MAPPING, 0, 1, 1)


def _optional(encoder: EncoderObjects, index: int, subindex: int) -> int:
    """0 where a device leaves an optional object out."""
    try:
        return encoder.read(index, subindex)
    except DeviceRefused:
        return 0


def configured(name: str, network: canopen.Network, nodes: Sequence[int]) -> tuple[EncoderIdentity, ...]:
    """Every node pre-operational and set up. DeviceStale naming all that are missing, not one after the other.

    DeviceRefused as `configure`. The nodes are asked side by side, a thread each until all are done: one after the
    other six take six times as long, which with a slow adapter is more than a second.
    """
    encoders: list[EncoderObjects] = []
    for node in nodes:
        remote = network.add_node(canopen.RemoteNode(node, canopen.ObjectDictionary()))
        remote.nmt.send_command(NMT_PRE_OPERATIONAL)
        encoders.append(EncoderObjects(name, node, remote))
    with ThreadPoolExecutor(len(encoders)) as side_by_side:
        answered = list(side_by_side.map(_answers, encoders))
    missing = [encoder.number for encoder, there in zip(encoders, answered, strict=True) if not there]
    if missing:
        raise DeviceStale(
            f"{name}: no answer from encoder node {', '.join(map(str, missing))} of {len(nodes)}; "
            "check power, node numbers, bit rate and bus termination"
        )
    with ThreadPoolExecutor(len(encoders)) as side_by_side:
        return tuple(side_by_side.map(configure, encoders))


def nmt(command: int, node: int) -> can.Message:
    """A network management command to one node (CiA 301, 7.2.8)."""
    return can.Message(arbitration_id=0, data=[command, node], is_extended_id=False)


def _answers(encoder: EncoderObjects) -> bool:
    """Whether the node is there; DeviceRefused when it is no encoder."""
    try:
        check_profile(encoder)
    except DeviceStale:
        return False
    return True
