"""A D-H table as CSV says its convention and its units, and is read by them."""

import numpy as np
import pytest

from acquisition.recording.rig import ArmModel, parse_rig
from calibeam.new_rig.from_dh import dh_table_text
from calibrate.errors import DataError

GERMAN = """# iiwa
modified;a [mm];alpha [deg];d [mm];theta [deg];lower [deg];upper [deg]
1;0;0;340;0;-170;170
2;0;-90;0;0;-120;120
3;12,5;90;400;-90;-170;170
"""


@pytest.fixture
def file(tmp_path):
    return tmp_path / "table.csv"


def written(file, text):
    file.write_text(text, encoding="utf-8-sig")
    return parse_rig(dh_table_text(file, "table"), "rig.toml")


def test_semicolons_commas_millimetres_and_degrees(file):
    rig = written(file, GERMAN)
    third = rig.arm.joints[2]
    assert rig.arm.model is ArmModel.MDH
    assert (third.a_m, third.d_m) == (0.0125, 0.4)
    assert third.theta_offset_rad == pytest.approx(-np.pi / 2)
    assert rig.arm.joints[0].upper_rad == pytest.approx(np.radians(170))


def test_units_as_suffixes_and_no_limits(file):
    rig = written(file, "standard,a_m,alpha_rad,d_m,theta_rad\n1,0.1,1.5,0.2,0\n")
    assert rig.arm.model is ArmModel.DH
    assert (rig.arm.joints[0].a_m, rig.arm.joints[0].alpha_rad) == (0.1, 1.5)
    assert rig.arm.joints[0].upper_rad == pytest.approx(2 * np.pi)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (GERMAN.replace("modified", "joint"), "begins with standard or modified"),
        (GERMAN.replace("a [mm]", "a"), "needs its unit"),
        (GERMAN.replace("a [mm]", "a [deg]"), "needs its unit"),
        (GERMAN.replace("alpha [deg]", "twist [deg]"), "is not one of"),
        (GERMAN.replace("d [mm]", "a [mm]"), "stands twice"),
        (GERMAN.replace("12,5", "a lot"), "row 3: a lot is no number"),
        (GERMAN.replace("1;0;0;340", "1;0;340"), "row 1: 6 cells"),
        (GERMAN.replace("12,5", "nan"), "not finite"),
        ("modified;a [mm]\n", "one row a joint"),
    ],
)
def test_a_table_that_leaves_something_open_is_refused(file, text, says):
    with pytest.raises(DataError, match=says):
        written(file, text)
