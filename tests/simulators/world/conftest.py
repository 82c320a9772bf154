"""A UR5e with laser and fixture, as a rig file gives it, without any deviation unless a test asks for one."""

import math
from collections.abc import Callable
from typing import Any

import pytest

UR5E = [  # a_m, alpha_rad, d_m, mass_kg, com_m
    (0.0, math.pi / 2, 0.1625, 3.761, (0.0, -0.02561, 0.00193)),
    (-0.425, 0.0, 0.0, 8.058, (0.2125, 0.0, 0.11336)),
    (-0.3922, 0.0, 0.0, 2.846, (0.15, 0.0, 0.0265)),
    (0.0, math.pi / 2, 0.1333, 1.37, (0.0, -0.0018, 0.01634)),
    (0.0, -math.pi / 2, 0.0997, 1.3, (0.0, 0.0018, 0.01634)),
    (0.0, 0.0, 0.0996, 0.365, (0.0, 0.0, -0.001159)),
]


@pytest.fixture
def ur5e() -> Callable[..., dict[str, Any]]:
    """A rig; keywords become keys of [emulation]."""

    def make(**emulation: float) -> dict[str, Any]:
        return {
            "arm": {
                "gravity_m_s2": [0, 0, -9.81],
                "joint": [
                    {"a_m": a, "alpha_rad": alpha, "d_m": d, "mass_kg": mass, "com_m": list(com)}
                    for a, alpha, d, mass, com in UR5E
                ],
            },
            "tool": {
                "mass_kg": 0.4,
                "com_m": [0.0, 0.02, 0.04],
                "laser_origin_m": [0.0, 0.03, 0.05],
                "laser_direction": [0.0, 1.0, 0.0],
            },
            "fixture": {
                "half_size_m": 0.010,
                "psd2_in_psd1": {"origin_m": [0.0, 0.045886, 0.065532], "rotation_rad": [1.9198621771937625, 0, 0]},
            },
            "placement": [
                {"id": 1, "psd1_in_base": {"origin_m": [0.55, 0.10, 0.15], "rotation_rad": [0, 0, -math.pi / 2]}},
                {"id": 2, "psd1_in_base": {"origin_m": [0.45, -0.25, 0.30], "rotation_rad": [0, 0, -2.1]}},
            ],
            "emulation": {"seed": 7, **emulation},
        }

    return make


@pytest.fixture
def no_deviation() -> dict[str, float]:
    """Deviations of the size that the example rig emulates."""
    return {
        "length_sigma_m": 3e-4,
        "angle_sigma_rad": 5e-4,
        "joint_zero_max_rad": 0.035,
        "placement_origin_sigma_m": 3e-3,
        "placement_rotation_sigma_rad": 8.7e-3,
        "laser_origin_sigma_m": 5e-4,
        "laser_direction_sigma_rad": 2e-3,
        "joint_repeatability_rad": 3e-6,
        "psd_noise_m": 2e-6,
    }
