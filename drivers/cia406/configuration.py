"""Bringing one encoder to "position on every SYNC", over SDO: what it is, how it counts, what its TPDO2 carries."""

from dataclasses import dataclass

import canopen

from drivers.cia406 import objects
from drivers.cia406.angle import Scale, scale_of
from drivers.cia406.codec import MappedObject, mapped_object
from drivers.cia406.objects import Operating
from drivers.errors import DeviceRefused, DeviceStale

ANSWER_S = 0.5  # SDO answers come within some ms; the rest is for a busy host
HEARTBEAT_MS = 400  # 1.5 of them are 0.6 s; a node that answers no SYNC is found after 0.5 s
MULTI_TURN = 2
POSITION_ENTRY = objects.POSITION << 16 | 32


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

    @property
    def multi_turn(self) -> bool:
        """As 1000h says in its high word: 1 single-turn, 2 multi-turn (CiA 406, 1000h)."""
        return self.device_type >> 16 == MULTI_TURN


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
    device_type = encoder.read(objects.DEVICE_TYPE)
    profile = device_type & 0xFFFF
    if profile != objects.PROFILE:
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
    encoder.write(objects.HEARTBEAT_MS, 0, HEARTBEAT_MS, 2)
    vendor, product, revision, serial_number = (_optional(encoder, objects.IDENTITY, sub) for sub in (1, 2, 3, 4))
    errors = _optional(encoder, objects.ERROR_REGISTER, 0)
    return EncoderIdentity(
        encoder.number, device_type, vendor, product, revision, serial_number, scale, pdo_id, mapping, errors
    )


def preset(encoder: EncoderObjects, scale: Scale, angle_rad: float, *, store: bool) -> None:
    """The present position reads `angle_rad` from now on. DeviceRefused when the encoder says no.

    `store` keeps it through power-off where the encoder does not by itself; its memory wears: never in a loop.
    """
    units = round(angle_rad / scale.unit_rad)
    encoder.write(objects.PRESET, 0, units % scale.range_units, 4)
    if store:
        encoder.write(objects.STORE, 1, objects.SAVE, 4)


def set_direction(encoder: EncoderObjects, *, counter_clockwise: bool) -> None:
    """Which way of turning makes 6004h rise; the other bits of 6000h stay."""
    operating = encoder.read(objects.OPERATING_PARAMETERS)
    wanted = operating | Operating.COUNTER_CLOCKWISE if counter_clockwise else operating & ~Operating.COUNTER_CLOCKWISE
    if wanted != operating:
        encoder.write(objects.OPERATING_PARAMETERS, 0, wanted, 2)


def _scale(encoder: EncoderObjects) -> Scale:
    operating = encoder.read(objects.OPERATING_PARAMETERS)
    scaled = bool(operating & Operating.SCALING)
    units = encoder.read(objects.UNITS_PER_TURN) if scaled else 0
    range_units = encoder.read(objects.RANGE_UNITS) if scaled else 0
    resolution, turns = encoder.read(objects.TURN_RESOLUTION), encoder.read(objects.TURNS)
    try:
        return scale_of(operating, units, range_units, resolution, max(turns, 1))  # single-turn devices may say 0
    except ValueError as cause:
        raise encoder.refuse(f"states a scale that cannot be: {cause}; check 6000h to 6002h, 6501h, 6502h") from cause


def _position_on_sync(encoder: EncoderObjects) -> tuple[int, tuple[MappedObject, ...]]:
    """Identifier and mapping of TPDO2, changed only where it does not yet send the position on every SYNC."""
    cob_id = encoder.read(objects.TPDO2_COMMUNICATION, 1)
    kind = encoder.read(objects.TPDO2_COMMUNICATION, 2)
    mapping = _mapping(encoder)
    mapped = any(entry.index == objects.POSITION and entry.bits == 32 for entry in mapping)
    if not mapped or cob_id & objects.PDO_INVALID or kind != objects.EVERY_SYNC:
        cob_id &= ~objects.PDO_INVALID
        encoder.write(objects.TPDO2_COMMUNICATION, 1, cob_id | objects.PDO_INVALID, 4)
        encoder.write(objects.TPDO2_COMMUNICATION, 2, objects.EVERY_SYNC, 1)
        if not mapped:
            _map_position(encoder)
            mapping = _mapping(encoder)
        encoder.write(objects.TPDO2_COMMUNICATION, 1, cob_id, 4)
    return cob_id & 0x7FF, mapping


def _mapping(encoder: EncoderObjects) -> tuple[MappedObject, ...]:
    count = encoder.read(objects.TPDO2_MAPPING, 0)
    return tuple(mapped_object(encoder.read(objects.TPDO2_MAPPING, entry)) for entry in range(1, count + 1))


def _map_position(encoder: EncoderObjects) -> None:
    """The sequence of CiA 301, 7.5.2.36: no entries, write them, say how many."""
    encoder.write(objects.TPDO2_MAPPING, 0, 0, 1)
    encoder.write(objects.TPDO2_MAPPING, 1, POSITION_ENTRY, 4)
    encoder.write(objects.TPDO2_MAPPING, 0, 1, 1)


def _optional(encoder: EncoderObjects, index: int, subindex: int) -> int:
    """0 where a device leaves an optional object out."""
    try:
        return encoder.read(index, subindex)
    except DeviceRefused:
        return 0
