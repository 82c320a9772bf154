"""The shaft that encoders without an arm sit on."""

import math

import numpy as np
import pytest

from simulators.defects.encoder import RADIUS_M
from simulators.encoders.shaft import PERIOD_S, SWING_TURNS, ShaftWorld, is_shaft
from simulators.errors import WorldError

RIG = {"devices": {"encoders": {"driver": "cia406", "nodes": [1, 2]}}}


def seen(world: ShaftWorld, seconds: np.ndarray) -> np.ndarray:
    out = []
    for at_s in seconds:
        world.advance(float(at_s))
        out.append(world.link_encoders_rad())
    return np.array(out)


def test_discs_turn_together_and_as_far_as_stated() -> None:
    angles = seen(ShaftWorld.from_rig(RIG), np.linspace(0.0, PERIOD_S, 801))
    np.testing.assert_allclose(np.ptp(angles, axis=0), 2.0 * math.tau * SWING_TURNS, rtol=1e-4)
    np.testing.assert_allclose(np.ptp(angles[:, 1] - angles[:, 0]), 0.0, atol=1e-12)


def test_an_eccentric_disc_reads_wrong_once_a_turn() -> None:
    rig = {**RIG, "emulation": {"disc_eccentricity_m": 20e-6}}
    world = ShaftWorld.from_rig(rig, seed=4)
    angles = seen(world, np.linspace(0.0, PERIOD_S, 2001))
    e = [
        disc.eccentricity_m / RADIUS_M * np.exp(1j * (disc.bearing_rad - zero))
        for disc, zero in zip(world.truth.discs, world.truth.joint_zero_rad, strict=True)
    ]
    apart = angles[:, 1] - angles[:, 0]
    assert 0.5 * np.ptp(apart) == pytest.approx(abs(e[1] - e[0]), rel=5e-3)


def test_a_slip_stays_and_an_unknown_encoder_is_refused() -> None:
    world = ShaftWorld.from_rig(RIG)
    before = world.link_encoders_rad()
    world.verbs["shaft.slip"](encoder=2, angle_rad=1e-3)
    np.testing.assert_allclose(world.link_encoders_rad() - before, [0.0, 1e-3], atol=1e-12)
    with pytest.raises(WorldError, match="no encoder 3; there are 1 to 2"):
        world.slip(3, 1e-3)


def test_only_encoders_without_an_arm_sit_on_it() -> None:
    assert is_shaft(RIG)
    assert not is_shaft({**RIG, "arm": {}})
    with pytest.raises(WorldError, match="seed -1"):
        ShaftWorld.from_rig(RIG, seed=-1)
    with pytest.raises(WorldError, match="encoder_noise_rad"):
        ShaftWorld.from_rig({**RIG, "emulation": {"encoder_noise_rad": -1.0}})
