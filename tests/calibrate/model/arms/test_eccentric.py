"""An arm with discs off their shafts: derivatives, what the exact geometry says, and nothing without a [tolerance]."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import load_rig
from calibrate.apply.export.identified import identified_arm
from calibrate.errors import DataError
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.eccentric import EccentricArm, with_discs

RIG = load_rig(Path(__file__).parents[4] / "rigs" / "arm-cmm-reference.toml")
STEP = 1e-6


@pytest.fixture
def arm():
    return with_discs(arm_of(RIG), RIG)


@pytest.fixture
def somewhere(arm):
    rng = np.random.default_rng(1)
    return rng.normal(0, 0.02, len(arm.parameters)), rng.uniform(-2, 2, (5, 6))


def twist_between(T_from, T_to):
    move = T_to @ np.linalg.inv(T_from)
    w = Rotation.from_matrix(move[:, :3, :3]).as_rotvec()
    return np.concatenate([move[:, :3, 3] - np.cross(w, move[:, :3, 3]) / 2.0, w], axis=1)


def test_parameter_twists_are_the_differences_of_the_flange(arm, somewhere):
    theta, q = somewhere
    analytic = arm.twists(theta, q)
    for k, step in enumerate(np.eye(len(theta)) * STEP):
        numeric = twist_between(arm.flange(theta - step, q), arm.flange(theta + step, q)) / (2 * STEP)
        np.testing.assert_allclose(analytic[:, :, k], numeric, atol=2e-9, err_msg=arm.parameters[k].name)


def test_joint_twists_are_the_differences_of_the_flange(arm, somewhere):
    theta, q = somewhere
    for k, step in enumerate(np.eye(6) * STEP):
        numeric = twist_between(arm.flange(theta, q - step), arm.flange(theta, q + step)) / (2 * STEP)
        np.testing.assert_allclose(arm.joint_twists(theta, q)[:, :, k], numeric, atol=2e-9)


def test_the_two_numbers_of_a_disc_are_its_geometry_to_the_square_of_its_eccentricity(arm):
    """Centre e off the shaft at bearing b, radius r: reading - shaft = -atan2(e sin(q - b), r + e cos(q - b))."""
    off, bearing = 1e-4, 0.7
    shaft = np.linspace(-3.0, 3.0, 60)[:, None] * np.ones((1, 6))
    reading = shaft.copy()
    reading[:, 2] -= np.arctan2(off * np.sin(shaft[:, 2] - bearing), 1.0 + off * np.cos(shaft[:, 2] - bearing))
    names = [p.name for p in arm.parameters]
    theta = np.zeros(len(names))
    theta[names.index("joint3.disc_sine")] = off * np.cos(bearing)
    theta[names.index("joint3.disc_cosine")] = -off * np.sin(bearing)
    apart = arm.flange(theta, reading)[:, :3, 3] - arm_of(RIG).flange(np.zeros(48), shaft)[:, :3, 3]
    assert np.abs(apart).max() < 2.0 * off**2


def test_discs_are_unknowns_only_where_the_rig_leaves_them_open():
    centred = msgspec.structs.replace(RIG, tolerance=msgspec.structs.replace(RIG.tolerance, eccentricity_rad=None))
    plain = arm_of(centred)
    assert with_discs(plain, centred) is plain
    assert with_discs(plain, msgspec.structs.replace(RIG, tolerance=None)) is plain
    assert isinstance(with_discs(plain, RIG), EccentricArm)
    assert [p.prior for p in with_discs(plain, RIG).parameters[-12:]] == [1e-4] * 12


def test_an_export_that_would_lose_the_discs_is_refused():
    with pytest.raises(DataError, match=r"joint3.disc_sine is not zero.*hold = "):
        identified_arm(RIG, {"joint3.disc_sine": 1e-5})
    identified_arm(RIG, {"joint1.zero": 1e-5})
