"""The driver of the encoders that a rig file names, for a session and for a log."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
from msgspec import structs

from acquisition.recording.rig.devices import EncoderDriver, EncodersDevice
from drivers.can_dbc.description import joint_signals
from drivers.can_dbc.device import CanDbcEncoders
from drivers.cia406.device import Cia406Encoders
from drivers.clock import Clock
from drivers.device import Device
from drivers.errors import DeviceRefused
from drivers.transports.can_interfaces import OpenBus, bus_opener
from drivers.transports.can_tap import Tap, tapped

EMULATED_PATIENCE = 10.0  # an emulator on a busy machine was seen at a seventh of the speed asked for
VIEWED = ("position_rad",)  # channels worth a plot


def encoder_driver(
    device: EncodersDevice, clock: Clock, tap: Tap | None = None, *, emulated: bool = False, hurry: float = 1.0
) -> Device:
    """Not connected yet; `tap` is shown every frame on the bus. DeviceRefused for values that no driver takes.

    `hurry`: device seconds in one second of this program's clock.
    """
    open_bus = bus_opener(
        device.interface, device.channel, device.bitrate, device.options, serial_number=device.serial_number
    )
    if tap is not None:
        open_bus = tapped(open_bus, tap)
    try:
        if device.driver is EncoderDriver.CAN_DBC:
            return _described(open_bus, device, clock, hurry)
        return Cia406Encoders(
            open_bus,
            device.nodes,
            device.sync_hz,
            clock=clock,
            acceleration_limit_rad_s2=(device.acceleration_limit_rad_s2 or math.inf) * hurry**2,
            patience=EMULATED_PATIENCE if emulated else 1.0,
        )
    except ValueError as error:
        raise DeviceRefused(f"[devices.encoders] of the rig file: {error}") from error


def _described(open_bus: OpenBus, device: EncodersDevice, clock: Clock, hurry: float) -> Device:
    joints = joint_signals(Path(device.dbc or ""), device.signals, device.units_per_turn)
    limit_rad_s2 = (device.acceleration_limit_rad_s2 or math.inf) * hurry**2
    return CanDbcEncoders(open_bus, joints, clock=clock, acceleration_limit_rad_s2=limit_rad_s2)


def emulated_encoders(device: EncodersDevice, announced: Mapping[str, Any]) -> EncodersDevice:
    """The same encoders where emulators announced their adapter."""
    return structs.replace(
        device,
        interface=announced["interface"],
        channel=announced["channel"],
        bitrate=announced["bitrate"],
        serial_number=None,
        options={},
    )


def names_of(driver: Device) -> tuple[str, ...]:
    """Which encoders are connected, for a comparison with those of before; none for those that cannot say so."""
    if not isinstance(driver, Cia406Encoders):
        return ()
    return tuple(
        f"node {each.node} of vendor {each.vendor:#x}, product {each.product:#x}, serial number {each.serial_number}, "
        f"{each.scale.unit_rad:.6g} rad a count, range {each.scale.range_units}"
        for each in driver.identities
    )


def identities_of(driver: Device) -> list[dict[str, Any]]:
    """What each encoder of a connected driver said of itself, as JSON-like values: with it raw frames can be read."""
    if not isinstance(driver, Cia406Encoders):
        return []
    return [msgspec.to_builtins(identity) for identity in driver.identities]
