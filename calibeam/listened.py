"""What a second of a device's samples tells of it: how fast and how noisy they are, and what is wrong with them."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.cia406.codec import EMERGENCY_TEXTS
from drivers.device import Block
from drivers.psd_daq.messages import FaceIdentity
from drivers.psd_faces import FaceKind, layer_mismatch

LEAST_RATE = 0.9  # of the rate asked for; below this samples are lost or the device cannot keep up
LAYERS = 0.02  # between the sums of a duo-lateral face, one photocurrent; feels right: a healthy one has per mille

Floats = NDArray[np.float64]


def pace(blocks: Sequence[Block], wanted_hz: float) -> tuple[float, str]:
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


def noise(values: Floats) -> float:
    """One sigma of the noisiest column from neighbouring samples (von Neumann 1941); slow motion does not count."""
    steps = np.diff(values, axis=0)
    steps = steps[np.isfinite(steps).all(axis=1)] if np.isfinite(steps).all(axis=1).any() else np.nan_to_num(steps)
    return float(np.sqrt(0.5 * (steps**2).mean(axis=0)).max()) if len(steps) else 0.0


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
    """What encoders, and the bus, have told of themselves by the newest sample; 1001h of each node at the start."""
    for number, code in enumerate(block.values.get("emergency_code", np.zeros((1, 0)))[-1], start=1):
        if code:
            words = EMERGENCY_TEXTS.get(int(code), "unknown to this program")
            return f"the encoder of joint {number} tells emergency {int(code):04X}h, {words}: see its manual"
    for node, register in error_registers.items():
        if register:
            return f"encoder node {node} is at fault, error register {register:02X}h: see 1003h and its manual"
    errors = int(block.values.get("bus_errors", np.zeros(1))[-1])
    return f"{errors} error frames on the bus: check termination, bit rate and cables" if errors else ""
