"""The beam on both faces of the fixture, for many samples at once.

In a sensor's frame the face is z = 0: the beam meets it at o - d (o_z / d_z), and a mirror turns d_z about (law of
reflection). The cosines and the power share of each face follow.
"""

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import inverse
from simulators.defects.scene import Light

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
FULL_SUM_V = 5.0  # sum signal of the whole laser: amplifiers are set so that they do not saturate
REFLECTIVITY = 0.3  # bare silicon at 635 nm under its passivation


def shine(
    T_base_tool: Floats, direction: Floats, psd1: Floats, psd2_in_psd1: Floats, first: Whole, power: Floats
) -> Light:
    """Light on both sensors. Poses (row, 4, 4) in the base: of the laser, beam along `direction` (3,), and of PSD 1."""
    psd2 = psd1 @ psd2_in_psd1
    second_struck = (first == 2)[:, np.newaxis, np.newaxis]
    near, far = np.where(second_struck, psd2, psd1), np.where(second_struck, psd1, psd2)
    to_near = inverse(near)
    origin = _point(to_near, T_base_tool[:, :3, 3])
    onward = _along(to_near, T_base_tool[:, :3, :3] @ direction)
    near_m = _meet(origin, onward)
    to_far = inverse(far) @ near
    mirrored = onward * np.array([1.0, 1.0, -1.0])
    arriving = _along(to_far, mirrored)
    far_m = _meet(_point(to_far, near_m), arriving)
    spot_m = np.stack((near_m[:, :2], far_m[:, :2]), axis=1)
    directions = np.stack((onward, arriving), axis=1)
    shares = np.array([1.0 - REFLECTIVITY, REFLECTIVITY * (1.0 - REFLECTIVITY)])
    sum_v = FULL_SUM_V * power[:, np.newaxis] * shares
    swap = first == 2
    for values in (spot_m, directions, sum_v):
        values[swap] = values[swap][:, ::-1]
    return Light(spot_m, directions, sum_v)


def _point(motion: Floats, point: Floats) -> Floats:
    return np.einsum("rij,rj->ri", motion[:, :3, :3], point) + motion[:, :3, 3]


def _along(motion: Floats, direction: Floats) -> Floats:
    return np.einsum("rij,rj->ri", motion[:, :3, :3], direction)


def _meet(origin: Floats, direction: Floats) -> Floats:
    return origin - direction * (origin[:, 2] / direction[:, 2])[:, np.newaxis]
