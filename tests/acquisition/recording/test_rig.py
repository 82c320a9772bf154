"""The rig file: what is accepted, what it becomes, and that every mistake is told with line, key and remedy."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from acquisition.recording.errors import RigFileError
from acquisition.recording.rig import ArmModel, load_rig, parse_rig, plain_rig

Edit = Callable[[str, str], str]

LOCAL_POE = """\
schema = 1
name = "poe"
[arm]
model = "local-poe"
flange.origin_m = [0, 0, 0.1]
[[arm.joint]]
origin_m = [0, 0, "290 mm"]
rotation_rad = [0, 0, 0]
lower_rad = "-165 deg"
upper_rad = "165 deg"
gear_ratio = 121.0
encoder_counts = 131072
"""


@pytest.fixture
def edited(rig_source: str) -> Edit:
    """The small rig with one piece of text exchanged, at its first place."""

    def edit(old: str, new: str) -> str:
        assert old in rig_source
        return rig_source.replace(old, new, 1)

    return edit


def refusal(text: str) -> str:
    with pytest.raises(RigFileError) as refused:
        parse_rig(text, "rigs/x.toml")
    return str(refused.value)


def test_the_shipped_rig_is_accepted_with_all_its_sections(root: Path) -> None:
    rig = load_rig(root / "rigs" / "ur5e-dual-psd.toml")
    assert rig.n_joints == 6
    assert rig.arm.model is ArmModel.DH
    assert rig.arm.joints[1].a_m == -0.425
    assert list(rig.placements) == [1, 2, 3]
    assert rig.placements[2].psd1_in_base.origin_m == (0.45, -0.25, 0.30)
    assert rig.devices.encoders is not None
    assert rig.devices.encoders.nodes == (1, 2, 3, 4, 5, 6)
    assert rig.devices.psd is not None
    assert rig.devices.robot is not None
    assert rig.motion.step_limit_rad == 0.2
    assert rig.tolerance is not None
    assert rig.tolerance.angle_rad == 5e-4
    assert rig.noise.joint_rad == 3e-6
    assert rig.emulation is not None
    assert rig.emulation["psd_noise_m"] == 2e-6


@pytest.mark.parametrize("name", ["ur5-tracker", "ur10-leica-a", "ur10-leica-b", "ur10-leica-d"])
def test_rigs_of_real_recordings_are_accepted(root: Path, name: str) -> None:
    path = root.parent / "shared" / "data" / name / "rig.toml"
    if not path.is_file():
        pytest.skip("the real recordings are not beside this checkout (../shared/data)")
    rig = load_rig(path)
    assert (rig.name, rig.n_joints) == (name, 6)
    assert rig.tool.point_m is not None
    assert (rig.device is None) == name.startswith("ur10")


def test_a_local_poe_arm_has_origins_and_quantities_with_units() -> None:
    rig = parse_rig(LOCAL_POE, "poe.toml")
    assert rig.arm.joints[0].origin_m == (0.0, 0.0, 0.29)
    assert rig.arm.joints[0].lower_rad == pytest.approx(-2.879793265790644, rel=1e-15)
    assert rig.arm.joints[0].theta_offset_rad is None
    assert rig.arm.flange.origin_m == (0.0, 0.0, 0.1)


def test_a_missing_theta_offset_is_zero_and_the_beam_gets_length_one(rig_source: str) -> None:
    rig = parse_rig(rig_source, "rig.toml")
    assert [joint.theta_offset_rad for joint in rig.arm.joints] == [0.0, 0.1]
    assert rig.tool.laser_direction == (0.0, 1.0, 0.0)
    assert rig.bars[3].length_m == 0.600012
    assert rig.known_distances[0].to_placement == 7


def test_emulators_get_the_same_numbers_as_a_plain_mapping(edited: Edit) -> None:
    plain = plain_rig(edited("half_size_m = 0.010", 'half_size_m = "10 mm"'), "rig.toml")
    assert plain["fixture"]["half_size_m"] == 0.010
    assert plain["emulation"] == {"seed": 4}


@pytest.mark.parametrize(
    ("old", "new", "line", "says"),
    [
        ("alpha_rad = 1.5", "alhpa_rad = 1.5", 17, r"'alhpa_rad' in \[\[arm.joint\]\]; did you mean 'alpha_rad'"),
        ("a_m = 0.2", "a_mm = 200", 16, r"'a_mm' .* SI units: write 'a_m' in m"),
        ("lower_rad = -2.0", "lower_deg = -120", 20, r"'lower_deg' .* SI units: write 'lower_rad' in rad"),
        ("[tool]", "[tol]", 23, r"unknown key 'tol' in the file; did you mean 'tool'"),
        ("[devices.psd]", "[devices.pds]", 52, r"unknown key 'pds' in \[devices\]; did you mean 'psd'"),
        ("seed = 4", "sed = 4", 63, r"unknown key 'sed' in \[emulation\]; did you mean 'seed'"),
        ("seed = 4", 'seed = "four"', 63, r"seed = 'four' in \[emulation\]: expected a number"),
        ("a_m = 0.2", 'a_m = "200 deg"', 16, r"unit 'deg' of '200 deg' does not fit 'a_m', .* in m; use m, cm, mm"),
        ("a_m = 0.2", 'a_m = "200 mmm"', 16, r"unit 'mmm' .* unknown; .* did you mean 'mm'"),
        ("a_m = 0.2", 'a_m = "200"', 16, r"'200' has no unit; write it as a number in m"),
        ("a_m = 0.2", 'a_m = "long"', 16, r"'long' is no quantity; write a number in m"),
        ("a_m = 0.2", "a_m = true", 16, r"a_m = True in .*: expected float \| null, got bool; write it in m"),
        ("a_m = 0.2", "a_m = nan", 16, r"a_m = nan is not a finite number"),
        ("a_m = 0.2\n", "", 15, r"\[\[arm.joint\]\] needs the key 'a_m' in an arm of model \"dh\""),
        ("a_m = 0.2", "origin_m = [0, 0, 0]\na_m = 0.2", 16, r"'origin_m' does not belong to an arm of model \"dh\""),
        ("gravity_m_s2 = [0, 0, -9.81]", "gravity_m_s2 = [0, -9.81]", 6, r"expected array of length 3, got 2"),
        ("upper_rad = 2.0", "upper_rad = -2.0", 20, r"lower_rad = -2.0 is not below upper_rad = -2.0"),
        ("upper_rad = 2.0\n", "", 15, r"\[\[arm.joint\]\] needs the key 'upper_rad'; add it"),
        ('model = "dh"', 'model = "mhd"', 5, r"unknown value 'mhd'; known are dh, mdh, local-poe; did you mean 'mdh'"),
        ("schema = 1", "schema = 2", 1, r"schema = 2 .* this version reads schema 1"),
        ("half_size_m = 0.010", "half_size_m = 0.0", 28, r"half_size_m = 0.0 in \[fixture\]: expected float >= 1e-09"),
        ("id = 7", "id = 1", 36, r"id = 1 is used twice in \[\[placement\]\]"),
        ("to = 7", "to = 8", 41, r"to = 8 is no placement of this rig \(it has \[1, 7\]\)"),
        ("to = 7", "to = 1", 41, r"from and to are the same placement 1"),
        ("laser_direction = [0.0, 2.0, 0.0]", "laser_direction = [0, 0, 0]", 25, r"points nowhere"),
        ("laser_direction = [0.0, 2.0, 0.0]\n", "", 23, r"half a laser: add 'laser_direction'"),
        ('driver = "cia406"', 'driver = "cia405"', 57, r"unknown value 'cia405'; known are cia406, can-dbc; did"),
        ("nodes = [1, 2]", "nodes = [1]", 60, r"nodes = \[1\] names 1 encoders, the arm has 2 joints"),
        ("nodes = [1, 2]", "nodes = [5, 5]", 60, r"names one twice"),
        ("nodes = [1, 2]", "nodes = [1,\n 200]", 61, r"nodes = 200 in \[devices.encoders\]: expected int <= 127"),
        ('port = "tty"', 'port = "tty"\nserial_number = "C1"', 52, r"either 'port' .* or 'serial_number'"),
        ("[fixture]", "[fixture", 27, r"not TOML"),
        ("a_m = 0.2", "a_m = 0.2\na_m = 0.2", 17, r"not TOML: Cannot overwrite a value"),
    ],
)  # fmt: skip
def test_a_mistake_is_reported_with_line_key_and_remedy(edited: Edit, old: str, new: str, line: int, says: str) -> None:
    text = refusal(edited(old, new))
    assert re.match(rf"rigs/x.toml line {line}[:,] ", text), text
    assert re.search(says, text), text


def test_placements_without_a_fixture_are_refused(rig_source: str) -> None:
    start, end = rig_source.index("[fixture]"), rig_source.index("[[placement]]")
    assert "there is no [fixture]" in refusal(rig_source[:start] + rig_source[end:])


@pytest.mark.parametrize(
    ("content", "says"),
    [(None, "cannot read the rig file"), (b"schema = 1\nname = '\xff'\n", "line 2: byte 19 is not UTF-8")],
)
def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, content: bytes | None, says: str) -> None:
    path = tmp_path / "rig.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(RigFileError, match=says) as refused:
        load_rig(path)
    assert str(path) in str(refused.value)


def test_pages_come_and_go_unless_the_rig_says_otherwise(rig_source: str) -> None:
    assert parse_rig(rig_source, "rig.toml").live.stop_without_page_s is None
    strict = parse_rig(f"{rig_source}\n[live]\nstop_without_page_s = 5.0\n", "rig.toml")
    assert strict.live.stop_without_page_s == 5.0
    with pytest.raises(RigFileError, match="stop_without_page_s"):
        parse_rig(f"{rig_source}\n[live]\nstop_without_page_s = 0.0\n", "rig.toml")
