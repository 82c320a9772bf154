"""Laws that every instrument keeps: derivatives are those of differences, selection commutes, silence is zero."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from calibrate.model.optics.dual_psd import DualPsd, Fixture, PairTolerance
from calibrate.model.optics.laser import LaserMount
from calibrate.model.placement import Device, Target
from calibrate.model.rigid import transform
from calibrate.model.sensors.catalogue import BY_NAME
from calibrate.model.sensors.encoder_difference import EncoderDifference
from calibrate.model.sensors.full_pose import FullPose
from calibrate.model.sensors.plane import Plane, best_planes
from calibrate.model.sensors.point_line import PointLine, meeting_points
from calibrate.model.sensors.position import Position
from calibrate.model.sensors.seat import Seat, mean_tips
from calibrate.model.sensors.tip_distance import TipDistance
from calibrate.model.sensors.wire import Wire

POSES = 7
STEP = 1e-6
TARGET = Target(np.array([0.02, -0.01, 0.08]))
DEVICE = Device(transform([1.2, -0.4, 0.3], [0.3, -0.2, 1.2]))
MOUNT = LaserMount.from_drawing(np.array([0.0, 0.03, 0.05]), np.array([0.1, 1.0, 0.0]))
GROUP = np.array([1, 2, 1, 2, 2, 1, 1])


def flanges(seed):
    rng = np.random.default_rng(seed)
    return np.array(
        [
            transform(rng.uniform(-0.5, 0.5, 3) + np.array([0.4, 0, 0.4]), rng.uniform(-1.5, 1.5, 3))
            for _ in range(POSES)
        ]
    )


def full_pose():
    seen = (
        Rotation.from_rotvec([0.02, 0.03, -0.01]).as_matrix() @ DEVICE.T_base_device[:3, :3].T @ flanges(1)[:, :3, :3]
    )
    return FullPose(TARGET, DEVICE, seen @ transform([0, 0, 0], [0.3, 0.1, 2.0])[:3, :3], np.eye(3)[[2, 0, 1]])


def dual_psd():
    faces = Fixture(
        0.01, transform([0, 0.12, 0.12], [2.356, 0, 0]), {k: transform([k, 0, 0], [0, 0.1, 0]) for k in (1, 2)}
    )
    return DualPsd(MOUNT, faces, GROUP, 1 + np.arange(POSES) % 2, 1e-3, PairTolerance(1e-4, 1e-3))


def camera():
    device = Device(DEVICE.T_base_device, name="camera")
    return replace(full_pose(), target=Target(TARGET.point_m, 0.2, "marker"), device=device)


SENSORS = {
    "position": lambda: Position(TARGET, DEVICE),
    "full-pose": full_pose,
    "camera-pose": camera,
    "wire": lambda: Wire(TARGET, DEVICE),
    "seat": lambda: Seat(TARGET, mean_tips(flanges(1)[:, :3, 3], GROUP)),
    "plane": lambda: Plane(TARGET, best_planes(flanges(1)[:, :3, 3], np.ones(POSES, dtype=int))),
    "encoder-difference": lambda: EncoderDifference((2, 3), np.array([0.4, -3.0])),
    "point": lambda: PointLine(MOUNT, meeting_points(MOUNT, flanges(1), GROUP)),
}
PAIRS = {"distance": lambda: TipDistance(TARGET), "bar": lambda: TipDistance(TARGET)}


@pytest.fixture(params=list(SENSORS))
def sensor(request):
    return SENSORS[request.param]()


@pytest.fixture(params=list(PAIRS))
def pair_sensor(request):
    return PAIRS[request.param]()


def values(sensor, seed, size=5e-3):
    start = np.array([p.start for p in sensor.parameters])
    return start + size * np.random.default_rng(seed).normal(size=len(start))


def moved(T, twist):
    """Flange poses after a small base-frame twist [v; w], and what a finite one would be is of no matter here."""
    return transform(twist[:3], twist[3:]) @ T


def check(analytic, plus, minus, name=""):
    assert_allclose(analytic, (plus - minus) / (2 * STEP), atol=3e-9, rtol=3e-8, err_msg=name)


def test_derivative_by_twist(sensor):
    phi, T = values(sensor, 2), flanges(1)
    analytic = sensor.by_twist(phi, T)
    assert analytic.shape == (*sensor.expect(phi, T).shape, 6)
    for k, step in enumerate(np.eye(6) * STEP):
        check(analytic[:, :, k], sensor.expect(phi, moved(T, step)), sensor.expect(phi, moved(T, -step)), f"twist {k}")


def test_derivative_by_every_parameter(sensor):
    phi, T = values(sensor, 3), flanges(1)
    analytic = sensor.by_parameter(phi, T)
    assert analytic.shape == (*sensor.expect(phi, T).shape, len(sensor.parameters))
    for k, step in enumerate(np.eye(len(phi)) * STEP):
        check(analytic[:, :, k], sensor.expect(phi + step, T), sensor.expect(phi - step, T), sensor.parameters[k].name)


@pytest.mark.parametrize("name", [*SENSORS, "dual-psd"])
def test_selected_poses_are_seen_as_before(name):
    sensor = {**SENSORS, "dual-psd": dual_psd}[name]()
    phi, T, rows = values(sensor, 4), flanges(1), np.array([0, 2, 5])
    cut = sensor.select(rows)
    assert [p.name for p in cut.parameters] == [p.name for p in sensor.parameters]
    assert_allclose(cut.expect(phi, T[rows]), sensor.expect(phi, T)[rows])
    assert_allclose(cut.by_parameter(phi, T[rows]), sensor.by_parameter(phi, T)[rows])


def test_every_sensor_of_the_catalogue_is_held_to_these_laws():
    assert {*SENSORS, *PAIRS, "dual-psd"} == set(BY_NAME)  # the light of a dual PSD: test_dual_psd.py


@pytest.mark.parametrize("name", [name for name in SENSORS if name not in ("point", "encoder-difference")])
def test_what_corrections_are_about_says_where_everything_starts(name):
    sensor = SENSORS[name]()
    phi, T = values(sensor, 5), flanges(1)
    shifted = sensor.placed({k: tuple(np.add(v, 0.01)) for k, v in sensor.about().items()})
    assert not np.allclose(shifted.expect(phi, T), sensor.expect(phi, T), atol=1e-4)
    assert_allclose(shifted.placed(sensor.about()).expect(phi, T), sensor.expect(phi, T), atol=1e-12)


def test_new_poses_are_compared_with_what_is_expected_there(sensor):
    phi, T = values(sensor, 6), flanges(1)
    expected = sensor.expect(phi, T)
    assert_allclose(sensor.facing(expected).expect(phi, T)[:, 3:], 0.0, atol=1e-12)
    assert_allclose(sensor.facing(expected).expect(phi, T)[:, :3], expected[:, :3])


def test_names_are_unique_and_units_said(sensor):
    names = [p.name for p in sensor.parameters]
    assert len(set(names)) == len(names)
    assert {p.unit for p in sensor.parameters} <= {"m", "rad"}


def test_a_pair_s_derivatives_by_both_twists(pair_sensor):
    phi, A, B = values(pair_sensor, 2), flanges(1), flanges(2)
    by_a, by_b = pair_sensor.by_twists(phi, A, B)
    for k, step in enumerate(np.eye(6) * STEP):
        plus, minus = pair_sensor.expect(phi, moved(A, step), B), pair_sensor.expect(phi, moved(A, -step), B)
        check(by_a[:, :, k], plus, minus)
        plus, minus = pair_sensor.expect(phi, A, moved(B, step)), pair_sensor.expect(phi, A, moved(B, -step))
        check(by_b[:, :, k], plus, minus)


def test_a_pair_s_derivative_by_every_parameter(pair_sensor):
    phi, A, B = values(pair_sensor, 3), flanges(1), flanges(2)
    analytic = pair_sensor.by_parameter(phi, A, B)
    for k, step in enumerate(np.eye(len(phi)) * STEP):
        check(analytic[:, :, k], pair_sensor.expect(phi + step, A, B), pair_sensor.expect(phi - step, A, B))


def test_a_full_pose_near_half_a_turn_has_no_jump():
    T = flanges(1)[:1]
    phi = np.zeros(12)
    turned = T[:, :3, :3] @ Rotation.from_rotvec([np.pi, 0, 0]).as_matrix()
    seen = DEVICE.T_base_device[:3, :3].T @ turned
    nearly = FullPose(TARGET, DEVICE, seen, Rotation.from_rotvec([-np.pi + 1e-6, 0, 0]).as_matrix())
    assert_allclose(np.linalg.norm(nearly.expect(phi, T)[0, 3:]), 1e-6, rtol=1e-6)
