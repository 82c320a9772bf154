"""Plans keep within the limits of joints, areas and boxes, and refuse before anything moves."""

import numpy as np
import pytest

from acquisition.errors import RefusedMotionError
from acquisition.motion.cell import Box, Cell, SlowArea, body_points
from acquisition.motion.inverse.closed_form import closed_form
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.kinematics import transform
from acquisition.motion.paths.segments import By, Curve, Pace, Place, Segment
from acquisition.motion.plan import OVER, plan
from acquisition.recording.rig import load_rig
from calibeam.motion.gate_of_rig import cell_of, pace_of
from tests.acquisition.motion.conftest import RIG, ur5e

SOLVER = Solver(ur5e(1e-3), closed_form(ur5e()))
HOME_RAD = np.array([0.3, -1.4, 1.6, -0.5, 1.3, 0.1])
PACE = Pace(np.full(6, 0.8), np.full(6, 4.0))
HOME = SOLVER.flange(HOME_RAD)
OPEN = Cell()


def to(*shift: float, turn=(0.0, 0.0, 0.0), by: By = By.LINE) -> Segment:
    return Segment("there", by, Place("there", HOME @ transform(shift, turn), np.eye(4)))


@pytest.mark.parametrize("by", [By.JOINTS, By.LINE])
def test_speed_and_acceleration_stay_within_the_pace(by: By) -> None:
    made = plan(
        SOLVER, HOME_RAD, [to(0.2, -0.1, 0.05, turn=(0.4, 1.0, 0.8), by=by), to(0.0, 0.1, 0.0, by=by)], PACE, OPEN
    )
    speed, acceleration = made.rates()
    assert (np.abs(speed) <= OVER * PACE.speed_rad_s).all()
    assert (np.abs(acceleration) <= OVER * PACE.acceleration_rad_s2).all()


def test_the_tool_is_slow_where_it_has_to_be() -> None:
    x, y, z = HOME[:3, 3]
    area = SlowArea(Box("fixture", (x - 0.5, y - 0.5, z - 0.5), (x + 0.5, y + 0.5, z + 0.5)), 0.05)
    slow = plan(SOLVER, HOME_RAD, [to(0.2, 0.0, 0.0)], PACE, Cell(slow=(area,)))
    free = plan(SOLVER, HOME_RAD, [to(0.2, 0.0, 0.0)], PACE, OPEN)
    flange = SOLVER.arm.frames(slow.q_rad)[:, -1, :3, 3]
    assert np.linalg.norm(np.gradient(flange, slow.t_s, axis=0), axis=1).max() <= 0.05 * OVER
    assert slow.t_s[-1] > 2.0 * free.t_s[-1]


def test_a_box_in_the_way_is_named() -> None:
    x, y, z = (HOME @ transform((0.15, 0.0, 0.0)))[:3, 3]
    box = Box("operator side", (x - 0.02, y - 0.02, z - 0.02), (x + 0.02, y + 0.02, z + 0.02))
    with pytest.raises(RefusedMotionError, match=r"segment 1 'there' \(line\) at .* keep-out box 'operator side'"):
        plan(SOLVER, HOME_RAD, [to(0.3, 0.0, 0.0)], PACE, Cell(keep_out=(box,)))


def test_out_of_a_box_is_planned_and_back_into_it_is_refused() -> None:
    x, y, z = HOME[:3, 3]
    outwards = HOME[:3, :3] @ np.array([0.0, 0.0, 1.0])
    middle = np.array([x, y, z]) + 0.05 * outwards
    cell = Cell(keep_out=(Box("fixture", tuple(middle - 0.03), tuple(middle + 0.03)),))
    away = plan(SOLVER, HOME_RAD, [to(0.0, 0.0, -0.15)], PACE, cell)
    assert np.linalg.norm(SOLVER.flange(away.q_rad[-1])[:3, 3] - middle) > 0.15
    back = [to(0.0, 0.0, -0.15), to(0.0, 0.0, 0.0)]
    with pytest.raises(RefusedMotionError, match=r"segment 2 'there' \(line\) at .* keep-out box 'fixture'"):
        plan(SOLVER, HOME_RAD, back, PACE, cell)


def test_a_straight_line_through_a_singular_wrist_is_refused_with_its_joint() -> None:
    singular_rad = HOME_RAD * np.array([1.0, 1.0, 1.0, 1.0, 0.0, 1.0])
    beyond_rad = HOME_RAD * np.array([1.0, 1.0, 1.0, 1.0, -1.0, 1.0])
    for target_rad in (singular_rad, beyond_rad):
        segment = Segment("flip", By.LINE, Place("flip", SOLVER.flange(target_rad), np.eye(4)))
        with pytest.raises(RefusedMotionError, match=r"segment 1 'flip' \(line\).*joint \d"):
            plan(SOLVER, HOME_RAD, [segment], PACE, OPEN)


def test_an_area_too_slow_for_the_path_is_named_with_the_segment() -> None:
    x, y, z = HOME[:3, 3]
    area = SlowArea(Box("fixture", (x - 0.5, y - 0.5, z - 0.5), (x + 0.5, y + 0.5, z + 0.5)), 1e-3)
    with pytest.raises(
        RefusedMotionError, match=r"segment 2 'there' \(joint\).*tool in the area 'fixture' is .* limit"
    ):
        plan(SOLVER, HOME_RAD, [to(0.01, 0.0, 0.0), to(0.2, 0.2, 0.0, by=By.JOINTS)], PACE, Cell(slow=(area,)))


def test_a_link_next_to_the_line_between_its_joints_is_part_of_the_body() -> None:
    """The upper arm of a UR5e: its centre of mass is 0.113 m beside the line from shoulder to elbow."""
    cell = cell_of(load_rig(RIG))
    frames = ur5e().frames(HOME_RAD[None])
    plain, off_path = (body_points(frames, cell.tool_m, com)[0] for com in ((), cell.com_m))
    shoulder_m, elbow_m = frames[0, 1, :3, 3], frames[0, 2, :3, 3]
    middle_m = 0.5 * (shoulder_m + elbow_m) + 0.11336 * frames[0, 2, :3, 2]
    assert np.linalg.norm(plain - middle_m, axis=1).min() > 0.1
    assert np.linalg.norm(off_path - middle_m, axis=1).min() < 0.035  # points are 6 cm apart along the link


def test_a_share_of_the_speed_is_one_of_the_turn_as_well() -> None:
    whole, half = (pace_of(load_rig(RIG), share) for share in (1.0, 0.5))
    assert half.line_turn_rad_s == 0.5 * whole.line_turn_rad_s
    assert half.line_speed_m_s == 0.5 * whole.line_speed_m_s


def test_a_joint_that_would_leave_its_range_is_named() -> None:
    edge_rad = HOME_RAD.copy()
    edge_rad[5] = SOLVER.arm.upper_rad[5] - 0.1
    segment = Segment(
        "over", By.LINE, Place("over", SOLVER.flange(edge_rad) @ transform(rotation_rad=(0.0, 0.0, 0.4)), np.eye(4))
    )
    with pytest.raises(RefusedMotionError, match=r"segment 1 'over' \(line\).*joint 6 at .* leaves its range"):
        plan(SOLVER, edge_rad, [segment], PACE, OPEN)


def test_a_curve_is_driven_as_it_is_and_stretched_where_it_is_too_fast() -> None:
    def curve(t_s: float) -> np.ndarray:  # 1 - cos: at rest at both ends; its acceleration there is blended
        return HOME_RAD + 0.1 * (1.0 - np.cos(2.0 * np.pi * t_s / 4.0)) ** 2 * np.array([1.0, 0, 0, 0, 0, 0])

    place = Place("there", HOME, np.eye(4))
    slow = plan(SOLVER, HOME_RAD, [Segment("curve", By.CURVE, place, curve=Curve(curve, 4.0))], PACE, OPEN)
    assert slow.segments[0].slower == 1.0
    begin_s = slow.corners_s[0] + PACE.tacc_s
    inside = (slow.t_s > begin_s) & (slow.t_s < begin_s + 4.0)
    there = np.array([curve(t_s - begin_s) for t_s in slow.t_s[inside]])
    assert slow.q_rad[inside] == pytest.approx(there, abs=1e-9)
    assert slow.q_rad[-1] == pytest.approx(HOME_RAD, abs=1e-9)
    quick = Pace(np.full(6, 0.1), np.full(6, 4.0))
    made = plan(SOLVER, HOME_RAD, [Segment("curve", By.CURVE, place, curve=Curve(curve, 4.0))], quick, OPEN)
    assert made.segments[0].slower > 1.5
    assert np.abs(made.rates()[0]).max() <= OVER * 0.1
