"""Copies of rows are found, repeated measurements are not."""

import numpy as np
import pytest

from acquisition.recording.rig import parse_rig
from acquisition.recording.session_folder.tables import parse_csv
from calibrate.fit.gross_errors.bad_rows import duplicated_rows

RIG = """schema = 1
name = "one-joint"
[arm]
model = "dh"
[[arm.joint]]
a_m = 1.0
alpha_rad = 0.0
d_m = 0.0
lower_rad = -3.0
upper_rad = 3.0
"""


def samples(text):
    return parse_csv(text, "samples.csv", parse_rig(RIG, "rig.toml"))


def test_a_copied_row_names_its_original():
    (found,) = duplicated_rows(samples("t_s,q1_rad,x_m,y_m,z_m\n0,0.1,1,2,3\n1,0.2,1,2,4\n2,0.1,1,2,3\n"))
    assert found.rows == (2,)
    assert found.says == "row 3, every column: a copy of row 1, equal in every column; remove the copies"


def test_copies_of_a_row_are_one_finding():
    (found,) = duplicated_rows(samples("t_s,q1_rad,wire_m\n" + "0,0.1,1.5\n" * 3))
    assert found.rows == (1, 2)


@pytest.mark.parametrize(
    "text",
    [
        "t_s,q1_rad,wire_m\n0,0.1,1.50001\n1,0.1,1.50002\n",
        "t_s,q1_rad,seat\n0,0.1,1\n1,0.1,1\n",  # a probe that rests in its cone reads the same counts again
        "t_s,q1_rad,wire_m,repeat\n0,0.1,1.5,1\n1,0.1,1.5,2\n",
    ],
)
def test_repeated_poses_are_measurements(text):
    assert duplicated_rows(samples(text)) == ()


def test_a_seat_row_with_the_same_time_is_a_copy():
    (found,) = duplicated_rows(samples("t_s,q1_rad,seat\n0,0.1,1\n0,0.1,1\n"))
    assert np.array_equal(found.rows, [1])
