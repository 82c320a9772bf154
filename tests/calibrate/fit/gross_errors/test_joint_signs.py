"""A mirrored arm is joints that count the other way, not a left-handed instrument; both explanations are named."""

import numpy as np
import pytest

from acquisition.recording.errors import MESSAGE_LENGTH
from acquisition.recording.files import brief
from calibrate.fit.gross_errors.conventions import wrong_convention
from calibrate.model.checks.gross_error import GrossErrorKind
from calibrate.model.sensors.position import PositionWitness
from tests.calibrate.fit.gross_errors.conftest import NOISE, POINT, flange

# d, a, alpha of a six-axis arm whose links 2 and 3 move in one plane, as KUKA's, ABB's and FANUC's do (IRB 120)
PLANAR = np.array(
    [
        [0.290, 0.0, -np.pi / 2],
        [0.0, 0.270, 0.0],
        [0.0, 0.070, -np.pi / 2],
        [0.302, 0.0, np.pi / 2],
        [0.0, 0.0, -np.pi / 2],
        [0.072, 0.0, 0.0],
    ]
)
IN_PLANE, ON_AXIS = np.array([0.03, 0.0, 0.06]), np.array([0.0, 0.0, 0.06])


def planar(q):
    return flange(q, PLANAR)


def session(point=POINT, seed=3):
    """Angles in the sense of the rig, and what a tracker reads; the arm is a millimetre beside its drawing."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-2.0, 2.0, (60, 6))
    T = flange(q, PLANAR + rng.normal(0.0, 1e-3, PLANAR.shape))
    return q, T[:, :3, :3] @ point + T[:, :3, 3] + rng.normal(0.0, NOISE, (60, 3))


def counted(q, *joints):
    """The same angles from a controller that counts these joints the other way."""
    return q * np.where(np.isin(np.arange(1, 7), joints), -1.0, 1.0)


def judged(q, position_m, point=POINT):
    return wrong_convention(planar, [PositionWitness(q, position_m, point)])


@pytest.mark.parametrize("point", [POINT, IN_PLANE])
def test_a_kuka_is_named_by_its_joints_and_not_by_a_left_handed_tracker(point):
    q, position_m = session(point)
    found = judged(counted(q, 1, 4, 6), position_m, point)
    assert (found.kind, found.column) == (GrossErrorKind.JOINT_SIGN, "columns q1_rad, q4_rad, q6_rad")
    assert "joints 1, 4 and 6 turn against the rig's sense" in found.says
    assert found.remedy == "in the rig file, write sign = -1 for joints 1, 4 and 6, as for KUKA, or remove it there"
    assert found.says.endswith(found.remedy)  # a terminal cuts long messages in the middle
    assert "less likely: one of x_m, y_m, z_m is negated, or two are exchanged" in found.what


@pytest.mark.parametrize("mirror", [[-1, 1, 1], [1, -1, 1], [1, 1, -1]])
def test_a_negated_column_of_the_device_is_named_second_where_joint_signs_fit_as_well(mirror):
    q, position_m = session(POINT)
    found = judged(q, position_m * mirror)
    assert found.column == "columns q1_rad, q4_rad, q6_rad"
    assert "less likely: one of x_m, y_m, z_m is negated, or two are exchanged" in found.what
    assert "mm off its drawing then" in found.what  # drawn 30 mm beside the plane, which tells the two apart


def test_a_negated_column_is_all_there_is_where_no_joint_signs_fit():
    rng = np.random.default_rng(8)
    q = rng.uniform(-2.0, 2.0, (100, 6))
    T = flange(q)  # a UR5, whose links stand beside each other: no signs mirror it
    position_m = (T[:, :3, :3] @ POINT + T[:, :3, 3]) * [-1, 1, 1]
    found = wrong_convention(flange, [PositionWitness(q, position_m, POINT)])
    assert found.kind is GrossErrorKind.MIRRORED_AXIS
    assert "no set of joint signs explains it" in found.says
    assert "no instrument is left-handed" in found.says


def test_a_joint_that_the_target_does_not_feel_is_left_open():
    q, position_m = session(ON_AXIS)
    found = judged(counted(q, 1, 4, 6), position_m, ON_AXIS)
    assert found.column == "columns q1_rad, q4_rad"
    assert "these readings leave the sign of joint 6 open" in found.says


@pytest.mark.parametrize("joints", [(4, 6), (2, 5), (1, 3, 5), (2, 3, 4, 5), (1, 2, 3, 4, 5, 6)])
def test_any_set_of_joints_is_named(joints):
    q, position_m = session()
    found = judged(counted(q, *joints), position_m)
    assert found.column == "columns " + ", ".join(f"q{j}_rad" for j in joints)


def test_signs_and_a_quarter_turn_are_both_named():
    q, position_m = session()
    found = judged(counted(q, 1, 4, 6) + np.array([0, 0, np.pi / 2, 0, 0, 0]), position_m)
    assert "joints 1, 4 and 6 turn against the rig's sense" in found.says
    assert "zero of joint 3 is 90°" in found.says


def test_what_the_message_says_mends_the_file():
    q, position_m = session()
    assert judged(counted(counted(q, 1, 4, 6), 1, 4, 6), position_m) is None


def test_a_terminal_shows_joints_and_remedy_of_a_message_that_it_cuts():
    q, position_m = session()
    found = judged(counted(q, 1, 4, 6), position_m)
    assert len(found.says) <= MESSAGE_LENGTH
    shown = brief(f"{'folder/' * 20}session: {found.says}")
    assert "joints 1, 4 and 6" in brief(f"recordings/kuka/session: {found.says}")
    assert "write sign = -1 for joints 1, 4 and 6, as for KUKA" in shown
