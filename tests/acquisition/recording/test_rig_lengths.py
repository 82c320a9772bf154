"""Lengths of tens or hundreds of metres in a rig file are millimetres: refused with line, key, value and remedy."""

from pathlib import Path

import pytest

from acquisition.recording.errors import MESSAGE_LENGTH, RigFileError, SamplesError
from acquisition.recording.files.bounds import ARM_M, PART_M, ROOM_M
from acquisition.recording.rig import load_rig, parse_rig
from acquisition.recording.session_folder.tables import parse_csv

RIG = """schema = 1
name = "kuka-tracker"
[arm]
model = "dh"
[[arm.joint]]
a_m = 0.025
alpha_rad = -1.5708
d_m = 0.400
lower_rad = -2.9
upper_rad = 2.9
com_m = [0.0, 0.1, 0.0]
[arm.flange]
origin_m = [0.0, 0.0, 0.08]
[tool]
point_m = [0.03, 0.0, 0.08]
probe_diameter_m = 0.006
[fixture]
half_size_m = 0.010
psd2_in_psd1 = { origin_m = [0.0, 0.12, 0.12], rotation_rad = [2.356, 0, 0] }
[[placement]]
id = 1
psd1_in_base = { origin_m = [0.45, 0.0, 0.2], rotation_rad = [0, 0, 0] }
[device]
origin_m = [2.0, 0.5, 0.3]
[[bar]]
id = 1
length_m = 0.600012
"""


def refusal(old: str, new: str) -> str:
    assert old in RIG
    with pytest.raises(RigFileError) as refused:
        parse_rig(RIG.replace(old, new, 1), "rig.toml")
    assert len(str(refused.value)) <= MESSAGE_LENGTH
    return str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "line", "key", "metres"),
    [
        ("a_m = 0.025", "a_m = 25.0", 6, "a_m = 25.0 in [[arm.joint]]", "0.025"),
        ("d_m = 0.400", "d_m = 290", 8, "d_m = 290 in [[arm.joint]]", "0.29"),
        ("d_m = 0.400", "d_m = -400.0", 8, "d_m = -400.0 in [[arm.joint]]", "-0.4"),
        ("[0.0, 0.1, 0.0]", "[0.0, 100.0, 0.0]", 11, "com_m = 100.0 in [[arm.joint]]", "0.1"),
        ("[0.0, 0.0, 0.08]", "[0.0, 0.0, 80.0]", 13, "origin_m = 80.0 in [arm.flange]", "0.08"),
        ("[0.03, 0.0, 0.08]", "[30.0, 0.0, 80.0]", 15, "point_m = 30.0 in [tool]", "0.03"),
        ("= 0.006", "= 6.0", 16, "probe_diameter_m = 6.0 in [tool]", "0.006"),
        ("= 0.010", "= 10.0", 18, "half_size_m = 10.0 in [fixture]", "0.01"),
        ("[0.0, 0.12, 0.12]", "[0.0, 120.0, 120.0]", 19, "origin_m = 120.0 in [fixture.psd2_in_psd1]", "0.12"),
        ("[0.45, 0.0, 0.2]", "[450.0, 0.0, 200.0]", 22, "origin_m = 450.0 in [placement.psd1_in_base]", "0.45"),
        ("[2.0, 0.5, 0.3]", "[2000.0, 500.0, 300.0]", 24, "origin_m = 2000.0 in [device]", "2"),
        ("= 0.600012", "= 600.012", 27, "length_m = 600.012 in [[bar]]", "0.600012"),
    ],
)
def test_millimetres_are_refused_with_what_to_write(old: str, new: str, line: int, key: str, metres: str) -> None:
    lines = refusal(old, new)
    assert lines.startswith(f"rig.toml line {line}: {key}")
    assert f"probably in millimetres: divide by 1000 ({metres})" in lines


def test_a_value_that_is_no_millimetres_either_is_asked_for_in_metres() -> None:
    assert refusal("d_m = 0.400", "d_m = 4e7").endswith("expected float <= 20.0; write it in m")


def test_a_negative_size_is_not_taken_for_millimetres() -> None:
    assert "millimetres" not in refusal("= 0.010", "= -10.0")


def test_a_quantity_in_millimetres_is_read_as_such() -> None:
    rig = parse_rig(RIG.replace("d_m = 0.400", 'd_m = "400 mm"'), "rig.toml")
    assert rig.arm.joints[0].d_m == 0.4


def test_the_largest_machines_are_within_the_bounds() -> None:
    assert PART_M < ARM_M < ROOM_M
    text = RIG.replace("d_m = 0.400", "d_m = 17.6").replace("[2.0, 0.5, 0.3]", "[160.0, 0.5, 0.3]")
    rig = parse_rig(text, "rig.toml")  # Canadarm2 stretched out, and a laser tracker at its full range
    assert rig.arm.joints[0].d_m == 17.6


@pytest.mark.parametrize("name", sorted(path.name for path in (Path(__file__).parents[3] / "rigs").glob("*.toml")))
def test_every_shipped_rig_is_within_the_bounds(name: str) -> None:
    rig = load_rig(Path(__file__).parents[3] / "rigs" / name, needs_arm=False)
    assert rig.n_joints >= 6 or name == "encoders.toml"


def test_a_position_beyond_a_kilometre_is_refused_with_the_same_remedy() -> None:
    header = "t_s,q1_rad,x_m,y_m,z_m\n"
    with pytest.raises(SamplesError, match=r"row 1 .*column 'x_m': 1234.5 is beyond 1000.*divided by 1000"):
        parse_csv(f"{header}0,0,1234.5,10,20\n", "samples.csv", parse_rig(RIG, "rig.toml"))


def test_counts_a_turn_that_no_encoder_of_cia_406_has() -> None:
    text = (Path(__file__).parents[3] / "rigs" / "encoders.toml").read_text()
    with pytest.raises(RigFileError, match=r"line 12: units_per_turn = 0.3: encoders of CiA 406 .*; correct it"):
        parse_rig(text.replace("sync_hz = 100.0", "sync_hz = 100.0\nunits_per_turn = 0.3"), "rig.toml")
