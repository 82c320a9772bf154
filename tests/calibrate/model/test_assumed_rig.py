"""The assumed rig at one pose agrees with the chain that is fitted, and with a followed ray."""

import msgspec
import numpy as np
import pytest

from acquisition.recording.rig import ArmModel, load_rig
from calibrate.errors import DataError
from calibrate.model.arms.convert import convert
from calibrate.model.assumed_rig import AssumedRig, Light
from calibrate.model.dual_psd_rig import dual_psd_chain
from calibrate.model.parameters import start_values


@pytest.fixture(scope="module")
def rig(request):
    return load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")


@pytest.fixture(params=list(ArmModel), ids=lambda model: model.value)
def corrected(request, rig, sessions):
    """A session, its chain of every arm model with some corrections, and the assumed rig with the same."""
    session = sessions(31, n=20)
    rig = msgspec.structs.replace(rig, arm=convert(rig.arm, request.param).arm)
    chain = dual_psd_chain(rig, session.placement, session.first_psd)
    theta = start_values(chain.parameters) + np.random.default_rng(0).normal(0, 2e-3, len(chain.parameters))
    values = dict(zip([p.name for p in chain.parameters], theta, strict=True))
    return session, chain, theta, AssumedRig(rig, values)


def test_expected_spots_and_joint_derivative_are_those_of_the_fit(corrected):
    session, chain, theta, assumed = corrected
    spots, by_joint = chain.expect(theta, session.q_rad), chain.by_joint(theta, session.q_rad)
    for i, (q, place, first) in enumerate(zip(session.q_rad, session.placement, session.first_psd, strict=True)):
        expected = assumed.expect(q, int(place), int(first))
        np.testing.assert_allclose(expected.spots_m, spots[i], atol=1e-14)
        np.testing.assert_allclose(expected.by_joint, by_joint[i], atol=1e-12)
        spots_m, light = assumed.struck(assumed.flange(q), int(place), int(first))
        np.testing.assert_array_equal(spots_m, expected.spots_m)
        assert light is expected.light


def test_nominal_rig_follows_the_ray_and_lights_both_faces(rig, sessions, ur5e_exact):
    session = sessions(32, n=20, truth=None)
    assumed = AssumedRig(rig)
    angles = session.q_rad + session.truth.zeros
    for q, place, first in zip(angles, session.placement, session.first_psd, strict=True):
        expected = assumed.expect(q, int(place), int(first))
        np.testing.assert_allclose(expected.spots_m, ur5e_exact().spots(q, place, first), atol=1e-13)
    assert assumed.expect(angles[0] + np.array([np.pi, 0, 0, 0, 0, 0]), 1, 1).light is not Light.BOTH_LIT


def test_light_says_both_lit_off_the_face_and_wrong_way(rig):
    assumed = AssumedRig(rig)
    fixture = assumed.fixture
    for first in (1, 2):
        point, direction = fixture.line(np.zeros(4), first)
        origin = point - 0.2 * direction
        assert fixture.light(origin, direction, first) is Light.BOTH_LIT
        assert fixture.light(point + 0.2 * direction, direction, first) is Light.WRONG_WAY
        across = np.cross(direction, [1.0, 0.0, 0.0])
        assert fixture.light(origin + 0.03 * across, direction, first) is Light.OFF_FACE


def test_a_line_for_given_spots_gives_those_spots(rig):
    fixture = AssumedRig(rig).fixture
    rng = np.random.default_rng(1)
    for first in (1, 2):
        for spots in rng.uniform(-8e-3, 8e-3, (10, 4)):
            point, direction = fixture.line(spots, first)
            np.testing.assert_allclose(fixture.spots(point - 0.2 * direction, direction, first), spots, atol=1e-15)


def test_beam_derivatives_are_differences(corrected):
    session, _, _, assumed = corrected
    q = session.q_rad[0]
    beam = np.concatenate(assumed.beam(q))
    steps = np.eye(6) * 1e-6
    numeric = np.stack(
        [(np.concatenate(assumed.beam(q + h)) - np.concatenate(assumed.beam(q - h))) / 2e-6 for h in steps], axis=1
    )
    np.testing.assert_allclose(assumed.arm.beam_jacobian(q), numeric, atol=1e-9)
    T = assumed.T_base_psd1(int(session.placement[0]))
    origin, direction = T[:3, :3].T @ (beam[:3] - T[:3, 3]), T[:3, :3].T @ beam[3:]
    line = np.concatenate([origin, direction])
    spots = [[assumed.fixture.spots(*np.split(line + s * h, 2), 1) for s in (1, -1)] for h in steps]
    np.testing.assert_allclose(
        assumed.fixture.spots_by_beam(origin, direction, 1),
        np.stack([(up - down) / 2e-6 for up, down in spots], axis=1),
        atol=1e-6,
    )


def test_the_flange_is_that_of_the_arm(corrected):
    session, chain, theta, assumed = corrected
    q, n = session.q_rad[:3], len(chain.model.parameters)
    np.testing.assert_allclose([assumed.flange(row) for row in q], chain.model.flange(theta[:n], q), atol=1e-14)


def test_unknown_names_are_refused(rig):
    assumed = AssumedRig(rig)
    with pytest.raises(DataError, match=r"placement 7 is not in the rig \(known: 1, 2, 3\)"):
        assumed.spots(np.zeros(6), 7, 1)
    with pytest.raises(DataError, match="first_psd 3"):
        assumed.spots(np.zeros(6), 1, 3)
    with pytest.raises(KeyError, match=r"joint9\.zero"):
        AssumedRig(rig, {"joint9.zero": 0.1})
