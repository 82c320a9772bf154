"""Encoders of a rig: their driver, for a session and for a log, and what a second of their samples shows.

Rate, noise and faults are judged for the other devices, too, by the check of the devices and by the live page.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from acquisition.recording.rig.devices import EncoderDriver, EncodersDevice
from drivers.can_dbc.description import NoReading, joint_signals
from drivers.can_dbc.device import CanDbcEncoders
from drivers.cia406.codec import EMERGENCY_TEXTS
from drivers.cia406.device import Cia406Encoders
from drivers.clock import Clock
from drivers.device import Block, Device
from drivers.errors import DeviceRefused
from drivers.psd_daq.messages import FaceIdentity
from drivers.psd_faces import FaceKind, layer_mismatch
from drivers.transports.can_bus import OpenBus, Tap, bus_opener, tapped

LEAST_RATE = 0.9  # of the rate asked for; below this samples are lost or the device cannot keep up
LAYERS = 0.02  # between the sums of a duo-lateral face, one photocurrent; feels right: a healthy one has per mille

Floats = NDArray[np.float64]


def sample_rate(blocks: Sequence[Block], wanted_hz: float) -> tuple[float, str]:
    """Samples a second of the device's clock, and what is wrong with them."""
    device_s = np.concatenate([block.device_s for block in blocks])
    sequence = np.concatenate([block.sequence for block in blocks])
    span_s = float(device_s[-1] - device_s[0])
    if len(device_s) < 2 or span_s <= 0.0:
        return 0.0, "its clock stands still: restart it"
    rate_hz = (len(device_s) - 1) / span_s
    lost = int((np.diff(sequence) - 1).clip(0).sum())
    if rate_hz < LEAST_RATE * wanted_hz:
        lines = f"{lost} samples were lost on the way" if lost else "it cannot keep up"
        return rate_hz, f"{wanted_hz:.0f} Hz are asked for, {lines}: lower the rate in the rig file, or free the line"
    return rate_hz, ""


def sample_noise(values: Floats) -> float:
    """One sigma of the noisiest column from third differences: smooth motion does not count.

    Variance of the k-th differences of white noise is binomial(2k, k) sigma^2: Anderson, The Statistical Analysis of
    Time Series, 1971, section 3.4. Samples beside one that is missing are left out.
    """
    third = np.diff(values, n=3, axis=0)
    there = np.isfinite(third)
    squares = np.where(there, third, 0.0) ** 2
    return float(np.sqrt(squares.sum(axis=0) / (20.0 * np.maximum(there.sum(axis=0), 1))).max())


def uneven_layers(faces: Sequence[FaceIdentity], lit: Sequence[bool], current_a: Floats) -> str:
    """Duo-lateral faces whose two layers do not carry the same photocurrent; current_a (sample, 4 a face)."""
    for number, (face, has_light) in enumerate(zip(faces, lit, strict=True), start=1):
        mean_a = current_a[:, 4 * number - 4 : 4 * number].mean(axis=0)
        mismatch = float(layer_mismatch(mean_a))
        if face.kind is FaceKind.DUO_LATERAL and has_light and mismatch > LAYERS:
            return (
                f"the sums of the two layers of face {number} differ by {100.0 * mismatch:.0f} %: "
                "check its four contacts and amplifiers"
            )
    return ""


def bus_trouble(block: Block, error_registers: Mapping[int, int]) -> str:
    """What encoders, and the bus, have reported of themselves by the newest sample; 1001h of each node at the start."""
    for number, code in enumerate(block.values.get("emergency_code", np.zeros((1, 0)))[-1], start=1):
        if code:
            words = EMERGENCY_TEXTS.get(int(code), "unknown to this program")
            return f"the encoder of joint {number} reports emergency {int(code):04X}h, {words}: see its manual"
    for node, register in error_registers.items():
        if register:
            return f"encoder node {node} is at fault, error register {register:02X}h: see 1003h and its manual"
    errors = int(block.values.get("bus_errors", np.zeros(1))[-1])
    return f"{errors} error frames on the bus: check termination, bit rate and cables" if errors else ""


def unread(blocks: Sequence[Block]) -> str:
    """Which encoders gave no angle in any row, and why, as far as their driver states it; "" where each gave one."""
    angles_rad = np.concatenate([block.values["position_rad"] for block in blocks])
    mute = np.flatnonzero(np.isnan(angles_rad).all(axis=0)).tolist()
    codes = np.concatenate([b.values["no_reading"] for b in blocks]) if "no_reading" in blocks[0].values else None
    left_out = [k + 1 for k in mute if codes is not None and (codes[:, k] != NoReading.NO_ANSWER.value).any()]
    silent = [k + 1 for k in mute if k + 1 not in left_out]
    if silent:
        return f"no answer from the encoder of joint {', '.join(map(str, silent))}: check node number, power and cable"
    if left_out:
        return (
            f"every reading of the encoder of joint {', '.join(map(str, left_out))} is out of the range that its "
            "signal states, or too fast: correct range, start bit and byte order in the DBC file"
        )
    return ""


VIEWED = ("position_rad",)  # channels worth a plot


def encoder_driver(device: EncodersDevice, clock: Clock, tap: Tap | None = None, *, hurry: float = 1.0) -> Device:
    """Not connected yet; `tap` is shown every frame on the bus. DeviceRefused for values that no driver takes.

    `hurry`: device seconds in one second of this program's clock.
    """
    open_bus = bus_opener(
        device.interface,
        device.channel,
        device.bitrate,
        device.options,
        serial_number=device.serial_number,
        stamped=device.stamped_by_adapter,
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
        )
    except ValueError as error:
        raise DeviceRefused(f"[devices.encoders] of the rig file: {error}") from error


def _described(open_bus: OpenBus, device: EncodersDevice, clock: Clock, hurry: float) -> Device:
    joints = joint_signals(Path(device.dbc or ""), device.signals, device.units_per_turn)
    limit_rad_s2 = (device.acceleration_limit_rad_s2 or math.inf) * stamp_pace(device, hurry) ** 2
    return CanDbcEncoders(
        open_bus,
        joints,
        clock=clock,
        stamps="hardware" if device.stamped_by_adapter else "arrived",
        acceleration_limit_rad_s2=limit_rad_s2,
    )


def stamp_pace(device: EncodersDevice, hurry: float) -> float:
    """Device seconds in one second of the rows' time stamps: the adapter's clock is a device, too."""
    return 1.0 if device.stamped_by_adapter else hurry


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
    """Which encoders are connected, for a comparison with those of before; none for those that cannot report it."""
    if not isinstance(driver, Cia406Encoders):
        return ()
    return tuple(
        f"node {each.node} of vendor {each.vendor:#x}, product {each.product:#x}, serial number {each.serial_number}, "
        f"{each.scale.unit_rad:.6g} rad a count, range {each.scale.range_units}"
        for each in driver.identities
    )


def identities_of(driver: Device) -> list[dict[str, Any]]:
    """What each encoder of a connected driver reported of itself, as JSON-like values: raw frames are read by it."""
    if not isinstance(driver, Cia406Encoders):
        return []
    return [msgspec.to_builtins(identity) for identity in driver.identities]
