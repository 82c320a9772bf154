"""The dual PSD against a followed ray, and its derivatives against differences."""

import numpy as np
import pytest

from calibrate.errors import DataError
from calibrate.model.optics.dual_psd import DualPsd, Fixture, PairTolerance
from calibrate.model.optics.laser import LaserMount


@pytest.fixture
def session(sessions):
    return sessions(11, n=24)


def sensor_of(session, **priors):
    truth = session.truth
    mount = LaserMount.from_drawing(truth.laser_origin, truth.laser_direction)
    fixture = Fixture(0.010, truth.psd2, truth.places)
    return DualPsd(mount, fixture, session.placement, session.first_psd, **priors)


def flanges(session):
    return np.array([session.truth.flange(q) for q in session.q_rad + session.truth.zeros])


def values(sensor, rng, size):
    start = np.array([p.start for p in sensor.parameters])
    return start + size * rng.normal(size=len(start))


def test_spots_are_those_of_the_followed_ray_in_both_orders(session):
    sensor, truth = sensor_of(session), session.truth
    phi = values(sensor, np.random.default_rng(0), 0.0)
    rows = zip(session.q_rad + truth.zeros, session.placement, session.first_psd, strict=True)
    expected = np.array([truth.spots(*row) for row in rows])
    assert set(session.first_psd) == {1, 2}
    np.testing.assert_allclose(sensor.expect(phi, flanges(session)), expected, atol=1e-13)


def test_off_the_face_spots_are_still_those_of_the_plane_but_not_lit(session):
    sensor = sensor_of(session)
    phi = values(sensor, np.random.default_rng(0), 0.0)
    T = flanges(session)
    assert sensor.lit(phi, T).all()
    T[:, :3, 3] += 0.08 * T[:, :3, 0]  # 80 mm aside: across the beam
    assert np.isfinite(sensor.expect(phi, T)).all()
    assert not sensor.lit(phi, T).all(axis=1).any()


def test_a_laser_that_points_away_lights_nothing(session):
    sensor = sensor_of(session)
    T = flanges(session)
    T[:, :3, :3] = T[:, :3, :3] @ np.diag([1.0, -1.0, -1.0])  # half a turn about x: the beam is -y
    assert not sensor.lit(values(sensor, np.random.default_rng(0), 0.0), T).any()


def test_derivative_by_twist(session):
    sensor, T = sensor_of(session), flanges(session)
    phi = values(sensor, np.random.default_rng(1), 1e-3)
    analytic = sensor.by_twist(phi, T)
    for k, step in enumerate(np.eye(6) * 1e-6):
        move = np.eye(4)
        move[:3, 3] = step[:3]
        x, y, z = step[3:]
        move[:3, :3] += np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        back = np.linalg.inv(move)
        numeric = (sensor.expect(phi, move @ T) - sensor.expect(phi, back @ T)) / 2e-6
        np.testing.assert_allclose(analytic[:, :, k], numeric, atol=1e-5)


def test_derivative_by_every_parameter_gains_and_psd2_included(session):
    sensor, T = sensor_of(session, gain_prior=5e-3, pair_prior=PairTolerance(5e-5, 1e-3)), flanges(session)
    phi = values(sensor, np.random.default_rng(2), 1e-3)
    analytic = sensor.by_parameter(phi, T)
    for k, step in enumerate(np.eye(len(phi)) * 1e-6):
        numeric = (sensor.expect(phi + step, T) - sensor.expect(phi - step, T)) / 2e-6
        np.testing.assert_allclose(analytic[:, :, k], numeric, atol=1e-6, err_msg=sensor.parameters[k].name)


def test_gains_and_psd2_are_held_unless_a_prior_frees_them(session):
    held = {p.name for p in sensor_of(session).parameters if not p.free}
    assert held == {f"psd{k}.gain_{a}" for k in (1, 2) for a in "xy"} | {
        f"psd2.{a}" for a in ("x", "y", "z", "roll", "pitch", "yaw")
    }
    assert all(p.free for p in sensor_of(session, gain_prior=5e-3, pair_prior=PairTolerance(5e-5, 1e-3)).parameters)


def test_a_placement_without_poses_is_held(sessions):
    session = sessions(12, n=8, places=(2,))
    free = {p.name.split(".")[0] for p in sensor_of(session).parameters if p.free}
    assert free == {"laser", "placement2"}


def test_unknown_placement_and_order_are_refused(session):
    sensor = sensor_of(session)
    with pytest.raises(DataError, match=r"placement 9 is not in the rig \(known: 1, 2, 3\)"):
        DualPsd(sensor.mount, sensor.fixture, np.array([9]), np.array([1]))
    with pytest.raises(DataError, match="first_psd of pose 0 is 3; it must be 1 or 2"):
        DualPsd(sensor.mount, sensor.fixture, np.array([1]), np.array([3]))
