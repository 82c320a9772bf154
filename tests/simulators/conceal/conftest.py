"""A small rig without deviations, and a scene in which nothing happens unless a test says so."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simulators.arm.drawing import Drawing, fixed_parts, turning_com_m
from simulators.arm.kinematics import Arm
from simulators.conceal.rigs import IRB120
from simulators.defects import Scene


def arm_of(drawing: Drawing) -> Arm:
    n = drawing.n_joints
    return Arm(
        fixed=fixed_parts(drawing),
        zero_rad=np.zeros(n),
        lower_rad=np.asarray(drawing.lower_rad),
        upper_rad=np.asarray(drawing.upper_rad),
        mass_kg=np.asarray(drawing.mass_kg) if drawing.mass_kg else np.zeros(n),
        com_m=turning_com_m(drawing) if drawing.mass_kg else np.zeros((n, 3)),
        tool_kg=0.7,
        tool_com_m=np.array([0.02, -0.01, 0.06]),
        gravity_m_s2=np.array([0.0, 0.0, -9.81]),
    )


@pytest.fixture
def arm() -> Arm:
    return arm_of(IRB120)


@pytest.fixture
def scene() -> Callable[..., Scene]:
    """A scene for joint angles (row, n): every sample approached from below, nothing warm, nothing carried."""

    def make(goal_rad: np.ndarray, **changes: Any) -> Scene:
        rows = len(goal_rad)
        none = np.zeros(rows, dtype=np.int64)
        places = ("room", "laser", *(f"{kind}{joint}" for kind in ("joint", "link") for joint in range(1, 7)))
        plain = Scene(
            t_s=10.0 * np.arange(rows),
            via_rad=goal_rad - 0.05,
            goal_rad=goal_rad,
            qd_rad_s=np.zeros_like(goal_rad),
            wait_s=np.ones(rows),
            payload_kg=np.zeros(rows),
            payload_com_m=np.array([0.0, 0.0, 0.1]),
            placement=none + 1,
            first_psd=none + 1,
            seat=none,
            temperature_degC={where: np.full(rows, 20.0) for where in places},
            laser_power=np.ones(rows),
            extra={"fan_rpm": np.full(rows, 1000.0)},
        )
        return replace(plain, **changes)

    return make


@pytest.fixture
def poses() -> np.ndarray:
    """Postures of an IRB 120, (row, 6) rad."""
    rng = np.random.default_rng(5)
    return rng.uniform(-0.8, 0.8, (12, 6)) + np.array([0.0, 0.2, -0.3, 0.5, 0.7, 0.0])
