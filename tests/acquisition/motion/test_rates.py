"""The worked numbers of the source: what joints leave a straight track by, and how far a belt is overshot."""

import numpy as np
import pytest

from acquisition.motion.cell import Cell
from acquisition.motion.inverse.closed_form import closed_form
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.kinematics import inverse, transform
from acquisition.motion.paths.path import BeltState, Path
from acquisition.motion.paths.segments import By, Pace, Place, Segment
from acquisition.motion.plan import plan
from acquisition.motion.setpoints import SERVO_PER_STRUCTURAL, LookAhead, deviation, rates_text, solve_rate_hz
from tests.acquisition.motion.conftest import ur5e

SOLVER = Solver(ur5e(), closed_form(ur5e()))
POSTURE_RAD = np.radians([0.0, -60.0, 70.0, -100.0, -90.0, 0.0])
PACE = Pace(np.full(6, 1.0), np.full(6, 5.0))
V_M_S, SOLVE_HZ = 0.10, 50.0


def leaves_the_track_m(radius_m: float, step_m: float) -> float:
    """Deviation midway between two solutions of a line square to the radius, their steps even about it."""
    T = SOLVER.flange(POSTURE_RAD)
    outwards = T[:3, 3] * np.array([1.0, 1.0, 0.0]) / np.hypot(T[0, 3], T[1, 3])
    across = np.array([-outwards[1], outwards[0], 0.0])
    tip_m = outwards * radius_m + np.array([0.0, 0.0, T[2, 3]])
    tool = np.append(T[:3, :3].T @ (tip_m - T[:3, 3]), 1.0)  # the tool reaches as far as the source's arm

    def posture(way_m: float) -> np.ndarray:
        """Turned with the track's direction, as an arm does that turns about its first axis."""
        turn = transform(rotation_rad=(0.0, 0.0, np.arctan2(way_m, radius_m)))
        goal = turn @ T
        goal[:3, 3] += tip_m + across * way_m - (goal @ tool)[:3]
        return SOLVER.kept(goal, POSTURE_RAD)

    middle_rad = 0.5 * (posture(0.5 * step_m) + posture(-0.5 * step_m))
    return abs(float(((SOLVER.flange(middle_rad) @ tool)[:3] - tip_m) @ outwards))


def test_joint_interpolation_leaves_a_straight_track_by_y2_over_8R() -> None:
    step_m = V_M_S / SOLVE_HZ
    assert leaves_the_track_m(1.0, step_m) == pytest.approx(step_m**2 / 8.0, rel=1e-3)
    assert leaves_the_track_m(1.0, step_m) == pytest.approx(5e-7, rel=1e-3)  # 5e-4 mm
    assert leaves_the_track_m(1.0, 2.0 * step_m) == pytest.approx(4.0 * leaves_the_track_m(1.0, step_m), rel=1e-3)


def test_a_belt_that_stops_dead_is_overshot_by_two_periods_of_its_way() -> None:
    T = SOLVER.flange(POSTURE_RAD)
    base = transform(T[:3, 3])

    def coord(s_m: float) -> np.ndarray:
        moved = base.copy()
        moved[1, 3] += s_m
        return moved

    place = Place("part", inverse(base) @ T, np.eye(4), coord)
    clock = {"t_s": 0.0}
    stop_s = 2.0 + 1e-6  # just after the belt was read, and read as running

    def belt() -> BeltState:
        t_s = clock["t_s"]
        return BeltState(V_M_S * min(t_s, stop_s), V_M_S if t_s < stop_s else 0.0)

    points = LookAhead(
        Path(SOLVER, POSTURE_RAD, [Segment("on belt", By.LINE, place)], PACE), SOLVE_HZ, belt, POSTURE_RAD
    )
    over_m = []
    for n in range(int(3.0 * 500)):
        clock["t_s"] = n / 500.0
        tip_m = SOLVER.flange(points.at(clock["t_s"]))[1, 3] - T[1, 3]
        if clock["t_s"] > 1.5:
            over_m.append(tip_m - V_M_S * min(clock["t_s"], stop_s))
    assert max(over_m[: int(0.4 * 500)]) < 1e-5  # until then it is with the belt, to its interpolation
    # 4 mm
    assert max(over_m) == pytest.approx(2.0 * V_M_S / SOLVE_HZ, rel=1e-3)
    assert abs(over_m[-1]) < 1e-6


@pytest.mark.parametrize(("lag_s", "known"), [(0.03, True), (0.03, False)])
def test_a_lag_of_the_arm_that_is_known_does_not_leave_it_behind_a_belt(lag_s: float, known: bool) -> None:
    T = SOLVER.flange(POSTURE_RAD)
    base = transform(T[:3, 3])
    place = Place("part", inverse(base) @ T, np.eye(4), lambda s_m: transform((0.0, s_m, 0.0)) @ base)
    now = {"t_s": 0.0}
    path = Path(SOLVER, POSTURE_RAD, [Segment("on belt", By.LINE, place)], PACE)
    belt = lambda: BeltState(V_M_S * now["t_s"], V_M_S)  # noqa: E731
    points = LookAhead(path, SOLVE_HZ, belt, POSTURE_RAD, lag_s if known else 0.0)
    sent = []
    for n in range(int(2.5 * 500)):
        now["t_s"] = n / 500.0
        sent.append(points.at(now["t_s"]))
    arm_rad = sent[-1 - round(lag_s * 500)]  # the arm stands where it was told to be lag_s ago
    behind_m = V_M_S * now["t_s"] - (SOLVER.flange(arm_rad)[1, 3] - T[1, 3])
    assert behind_m == pytest.approx(0.0 if known else V_M_S * lag_s, abs=1e-5)


def test_solutions_come_ten_times_as_fast_as_the_structure_shakes() -> None:
    assert solve_rate_hz(10.0, 500.0) == 100.0
    assert solve_rate_hz(80.0, 500.0) == 500.0


def test_example_5_1_as_far_as_its_numbers_survive() -> None:
    """Track and belt at 50 Hz are the tests above; the servo's 300 Hz are those of a structure of 20 Hz."""
    assert SERVO_PER_STRUCTURAL * 20.0 == 300.0
    assert solve_rate_hz(20.0, 300.0) == 200.0
    assert solve_rate_hz(5.0, 300.0) == SOLVE_HZ  # the rule, for which 50 Hz are enough
    assert "solved at 200 Hz (10 x" in rates_text(20.0, 300.0)
    assert "(15 x: 300 Hz, enough)" in rates_text(20.0, 300.0)
    assert "TOO SLOW" in rates_text(20.0, 299.0)
    assert "all that the stream takes" in rates_text(40.0, 300.0)


def test_how_far_off_its_plan_an_arm_was_is_square_to_its_way() -> None:
    T = SOLVER.flange(POSTURE_RAD)
    goal = T.copy()
    goal[1, 3] += 0.1
    made = plan(SOLVER, POSTURE_RAD, [Segment("aside", By.LINE, Place("aside", goal, np.eye(4)))], PACE, Cell())
    on_it, aside = made.q_rad[5:30], transform((3e-4, 0.0, 4e-4))
    off_path = [SOLVER.kept(aside @ SOLVER.flange(q_rad), q_rad) for q_rad in on_it]
    exact = deviation([(made, on_it)])
    off = deviation([(made, np.array(off_path))])
    assert exact is not None
    assert exact.largest_m < 1e-8
    assert off is not None
    assert (off.largest_m, off.rms_m) == pytest.approx((5e-4, 5e-4), rel=1e-3)
    half = deviation([(made, np.concatenate([on_it, off_path]))])
    assert half is not None
    assert (half.largest_m, half.rms_m) == pytest.approx((5e-4, 5e-4 / np.sqrt(2.0)), rel=1e-3)
    assert deviation([(made, np.empty((0, 6)))]) is None
