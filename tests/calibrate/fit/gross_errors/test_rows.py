"""Bad rows are found and named by row, column and cause; honest rows never."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibrate.fit.gross_errors.bad_rows import bad_rows
from calibrate.model.checks.gross_error import GrossErrorKind
from calibrate.model.checks.rough_fit import rows_of_another_session, sessions_apart
from tests.calibrate.fit.gross_errors.conftest import NOISE, POINT, flange


def test_honest_rows_are_left_alone(scene):
    assert bad_rows(scene.shots()) == ()
    assert rows_of_another_session(scene.shots()) == ()


def test_heavy_tails_are_not_gross_errors(scene):
    rng = np.random.default_rng(2)
    scene.position_m += NOISE * rng.standard_t(4, scene.position_m.shape)
    assert bad_rows(scene.shots()) == ()


@pytest.mark.parametrize("column", range(3))
def test_a_typed_digit_in_a_reading_names_row_column_and_what_it_should_be(scene, column):
    meant = scene.position_m[30, column]
    scene.position_m[30, column] += 0.02
    (found,) = bad_rows(scene.shots())
    assert (found.kind, found.rows) == (GrossErrorKind.WRONG_VALUE, (30,))
    assert found.column == ("x_m", "y_m", "z_m")[column]
    assert found.says.startswith(f"row 31, {found.column}: reads")
    assert float(found.what.split("about ")[1].split()[0]) == pytest.approx(meant, abs=1e-4)


@pytest.mark.parametrize("joint", range(1, 7))
@pytest.mark.parametrize("off", [0.05, -1.0])
def test_a_typed_digit_in_an_angle_names_the_joint(scene, joint, off):
    scene.q_rad[64, joint - 1] += off
    (found,) = bad_rows(scene.shots())
    assert (found.kind, found.rows, found.column) == (GrossErrorKind.WRONG_VALUE, (64,), f"q{joint}_rad")


def test_an_angle_whole_turns_off_is_given_back_within_one_turn(scene):
    meant = scene.q_rad[64, 2]
    scene.q_rad[64, 2] = 15.0
    (found,) = bad_rows(scene.shots())
    assert found.column == "q3_rad"
    assert float(found.what.split("about ")[1].split()[0]) == pytest.approx(meant, abs=1e-3)


def test_a_bad_shot_is_said_with_its_distance(scene):
    scene.position_m[12] += [0.004, -0.007, 0.005]
    (found,) = bad_rows(scene.shots())
    assert (found.kind, found.rows) == (GrossErrorKind.BAD_SHOT, (12,))
    assert float(found.what.split(" mm")[0]) == pytest.approx(np.sqrt(90.0), abs=0.1)


def test_readings_in_radians_are_said_in_radians(scene):
    scene.position_m[30, 1] += 0.02
    (typed,) = bad_rows(replace(scene.shots(), columns=("enc1_rad", "enc2_rad", "enc3_rad")))
    assert typed.column == "enc2_rad"
    assert typed.what.endswith(" rad")
    scene.position_m[30] += [0.004, -0.007, 0.005]
    (bad,) = bad_rows(replace(scene.shots(), columns=("enc1_rad", "enc2_rad", "enc3_rad")))
    assert " mrad away" in bad.what


def test_several_bad_rows_are_each_named(scene):
    scene.position_m[[3, 50, 99], [0, 1, 2]] += 0.5
    assert [b.rows for b in bad_rows(scene.shots())] == [(3,), (50,), (99,)]


@pytest.mark.parametrize(("turn", "shift"), [([0, 0, 0], [0.002, 0, 0.001]), ([0.1, 0.2, -0.1], [0.3, 0.1, -0.2])])
def test_a_block_of_another_session_is_named_by_its_frame(scene, turn, shift):
    rows = slice(70, 95)
    scene.position_m[rows] = Rotation.from_rotvec(turn).apply(scene.position_m[rows]) + shift
    (found,) = rows_of_another_session(scene.shots())
    assert found.kind is GrossErrorKind.OTHER_SESSION
    assert found.rows == tuple(range(70, 95))
    assert found.says.startswith("rows 71-95, x_m, y_m, z_m: positions in another device frame")


@pytest.mark.parametrize("rows", [slice(0, 45), slice(60, 100)])
def test_another_session_is_seen_before_any_fit_by_the_arm_as_drawn(scene, rows):
    turned_m = Rotation.from_rotvec([0.4, 0.1, -1.0]).apply(scene.position_m[rows])
    scene.position_m[rows] = turned_m + np.array([0.5, 0.0, 0.1])
    every = np.arange(10, 130)
    (found,) = sessions_apart(flange(scene.q_rad), scene.position_m, POINT, every)
    assert found.kind is GrossErrorKind.OTHER_SESSION
    assert found.rows == tuple(every[rows].tolist())


def test_one_session_is_not_taken_apart(scene):
    assert sessions_apart(flange(scene.q_rad), scene.position_m, None, np.arange(120)) == ()


def test_bad_rows_in_a_line_are_not_a_session_of_their_own(scene):
    rng = np.random.default_rng(8)
    scene.position_m[40:50] += rng.normal(0.0, 0.05, (10, 3))
    assert rows_of_another_session(scene.shots()) == ()
    assert len(bad_rows(scene.shots())) == 10


def of_the_arm(scene, spot, times):
    """An arm that errs by 3 mm about one posture, which it takes again and again; misfit and rows of it."""
    rng = np.random.default_rng(spot)
    rows = np.array(times)
    scene.q_rad[rows] = scene.q_rad[spot] + 0.02 * rng.standard_normal((len(rows), 6))
    scene.position_m[rows] = scene.expect(scene.q_rad[rows]) + np.array([0.002, -0.002, 0.001])
    return rows


def test_rows_whose_neighbours_in_posture_err_alike_at_other_times_are_no_fault(scene):
    of_the_arm(scene, 17, (5, 30, 52, 77, 101))
    assert bad_rows(scene.shots()) == ()
    scene.position_m[90] += [0.004, -0.007, 0.005]
    assert [b.rows for b in bad_rows(scene.shots())] == [(90,)]


def test_one_bad_row_next_to_good_ones_in_its_posture_is_a_fault(scene):
    rows = of_the_arm(scene, 17, (5, 30, 52, 77, 101))
    scene.position_m[rows[1:]] = scene.expect(scene.q_rad[rows[1:]])
    assert [b.rows for b in bad_rows(scene.shots())] == [(5,)]


def test_a_block_that_errs_as_its_postures_do_at_other_times_is_no_other_session(scene):
    """The arm visits one corner for 20 rows, and again, row by row, later."""
    first, again = np.arange(20, 40), np.arange(60, 120, 3)
    scene.q_rad[again] = scene.q_rad[first] + 0.01
    for rows in (first, again):
        scene.position_m[rows] = scene.expect(scene.q_rad[rows]) + np.array([0.002, 0.0, 0.001])
    assert rows_of_another_session(scene.shots()) == ()
    scene.position_m[again] = scene.expect(scene.q_rad[again])
    (found,) = rows_of_another_session(scene.shots())
    assert found.rows == tuple(range(20, 40))
