"""Every instrument is a witness: a healthy session strains it by the arm's own error, a wrong convention far more."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibrate.fit.gross_errors.conventions import wrong_convention
from calibrate.model.checks.gross_error import GrossErrorKind
from calibrate.model.sensors.bar import BarWitness
from calibrate.model.sensors.full_pose import OrientationWitness
from calibrate.model.sensors.position import PositionWitness
from calibrate.model.sensors.seat import SeatWitness
from calibrate.model.sensors.wire import WireWitness
from tests.calibrate.fit.gross_errors.conftest import POINT, flange

DRUM = np.array([1.1, -0.9, 0.2])


def moved(table, q):
    T = flange(q, table)
    return T[:, :3, :3] @ POINT + T[:, :3, 3]


def positions(scene, q):
    return PositionWitness(q, scene.position_m, POINT)


def orientations(scene, q):
    turned = scene.turn * Rotation.from_matrix(flange(scene.q_rad, scene.table)[:, :3, :3])
    return OrientationWitness(q, (turned * Rotation.from_rotvec([0.4, -1.0, 0.7])).as_rotvec())


def wire(scene, q):
    return WireWitness(q, np.linalg.norm(moved(scene.table, scene.q_rad) - DRUM, axis=1), POINT, None)


def bars(scene, q):
    """Ends of bars as they would be if each were as long as this pair of poses needs; half of the rows are ends a."""
    tips = moved(scene.table, scene.q_rad)
    return BarWitness(q, np.linalg.norm(tips[60:] - tips[:60], axis=1), POINT)


WITNESSES = (positions, orientations, wire, bars)  # of poses all over the workspace


@pytest.mark.parametrize("witness", WITNESSES)
def test_a_healthy_session_is_strained_by_the_arm_alone_and_nothing_is_said(scene, witness):
    one = witness(scene, scene.q_rad)
    assert one.strain(flange(scene.q_rad)).typical_m < 3e-3
    assert wrong_convention(flange, [one]) is None


DAILY = [(w, 2 + i) for i, w in enumerate(WITNESSES)]
# Daily for them: another joint by each instrument.
MORE = [pytest.param(w, 2 + (i + 2) % 4, marks=pytest.mark.endure) for i, w in enumerate(WITNESSES)]


@pytest.mark.parametrize(("witness", "joint"), [*DAILY, *MORE])
def test_every_instrument_names_a_joint_counted_the_other_way_round(scene, witness, joint):
    q = scene.q_rad * np.where(np.arange(6) == joint - 1, -1.0, 1.0)
    found = wrong_convention(flange, [witness(scene, q)])
    assert f"column q{joint}_rad: joint {joint} turns against" in found.says  # orientations alone leave rivals


def test_several_instruments_bear_witness_together(scene):
    q = scene.q_rad * np.array([1, 1, -1, 1, 1, 1])
    found = wrong_convention(flange, [witness(scene, q) for witness in WITNESSES])
    assert "column q3_rad" in found.says


def test_orientations_see_the_last_joint_which_positions_of_a_target_on_its_axis_cannot(scene):
    q = scene.q_rad * np.array([1, 1, 1, 1, 1, -1])
    assert "column q6_rad" in wrong_convention(flange, [orientations(scene, q)]).says


def test_orientations_the_other_way_round_are_named(scene):
    one = orientations(scene, scene.q_rad)
    found = wrong_convention(flange, [OrientationWitness(scene.q_rad, -one.rotation_rad)])
    assert found.kind is GrossErrorKind.INVERTED_ROTATION
    assert "rx_rad" in found.says


@pytest.mark.parametrize("witness", [positions, wire])
def test_millimetres_are_named(scene, witness):
    scene.position_m *= 1e3
    one = witness(scene, scene.q_rad)
    if isinstance(one, WireWitness):
        one = WireWitness(one.q_rad, 1e3 * one.length_m, one.point_m, one.drum_m)
    found = wrong_convention(flange, [one])
    assert found.kind is GrossErrorKind.MILLIMETRES
    assert "write metres" in found.says


def test_cones_are_not_satisfied_by_an_arm_that_hardly_moves(scene):
    rng = np.random.default_rng(4)
    q = _seated(scene.table, moved(scene.table, scene.q_rad[:3]), rng)
    one = SeatWitness(q, np.repeat([1, 2, 3], 25), POINT)
    assert wrong_convention(flange, [one]) is None
    turned = SeatWitness(q * np.array([1, 1, -1, 1, 1, 1]), one.seat, POINT)
    assert wrong_convention(flange, [turned]).column == "column q3_rad"


def _seated(table, cones, rng):
    """Readings (75, 6) of tips in three cones from many sides, by Newton steps on difference quotients."""
    goal = np.repeat(cones, 60, axis=0)
    q = rng.uniform(-1.8, 1.8, (len(goal), 6))
    for _ in range(60):
        now = moved(table, q)
        J = np.stack([(moved(table, q + s) - now) / 1e-7 for s in np.eye(6) * 1e-7], axis=2)
        Jt = np.swapaxes(J, 1, 2)
        q = q + (Jt @ np.linalg.solve(J @ Jt + 1e-9 * np.eye(3), (goal - now)[..., None]))[..., 0].clip(-0.4, 0.4)
    good = np.linalg.norm(moved(table, q) - goal, axis=1) < 1e-8
    return np.concatenate([q[60 * k : 60 * k + 60][good[60 * k : 60 * k + 60]][:25] for k in range(3)])


@pytest.mark.endure  # daily, of two mistakes at once: signs and a zero, test_joint_signs.py
def test_a_mirrored_axis_and_a_zero_off_are_both_named(scene):
    scene.position_m[:, 1] *= -1.0
    q = scene.q_rad + np.array([0, 0, np.pi / 2, 0, 0, 0])
    found = wrong_convention(flange, [positions(scene, q)])
    assert "determinant -1" in found.says
    assert "column q3_rad: zero of joint 3 is 90°" in found.says
    assert "add -1.570796 rad" in found.remedy


def test_noiseless_positions_do_not_tell_equal_conventions_apart_by_rounding(scene):
    T = flange(scene.q_rad)
    exact = T[:, :3, :3] @ POINT + T[:, :3, 3]
    assert wrong_convention(flange, [PositionWitness(scene.q_rad, exact, POINT)]) is None
