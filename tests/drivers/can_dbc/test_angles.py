"""Angles of DBC signals against cantools' own decoding: offsets, signs, floats, both byte orders, multiplexed ones."""

import math
from pathlib import Path

import cantools
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.can_dbc.description import JointSignal, joint_signals
from drivers.cia406.codec import ContinuousAngle

HEAD = 'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: one\n\nBO_ 5 AXIS: 8 one\n'
RAD = {"rad": 1.0, "deg": math.pi / 180.0}


def dbc(folder: Path, *lines: str) -> Path:
    path = folder / "axis.dbc"
    path.write_text(HEAD + "".join(f" SG_ {line} one\n" for line in lines if not line.startswith("SIG_")))
    with path.open("a") as file:
        file.writelines(f"\n{line}\n" for line in lines if line.startswith("SIG_"))
    return path


def first_angle(joint: JointSignal, data: bytes) -> float:
    counts = joint.counts(data)
    assert isinstance(counts, int)
    return ContinuousAngle(joint.scale).follow(counts, 0.0)


@pytest.mark.parametrize(
    ("signal", "data", "expected_rad"),
    [
        ('15|16@0+ (0.00038147554741,-12.5) [-12.5|12.5] "rad"', "00 80 00", 0.0001907738),
        ('15|16@0+ (0.00038147554741,-12.5) [-12.5|12.5] "rad"', "00 ff ff", 12.5),
        ('0|16@1+ (0.01,-200) [-200|200] "deg"', "d8 59", math.radians(30.0)),  # 23000
        ('0|16@1+ (0.01,-200) [-200|200] "deg"', "00 00", math.radians(-200.0)),
        ('0|16@1+ (0.1,0) [0|0] "deg"', "ff ff", math.radians(6553.5)),
        ('0|16@1+ (0.1,-180) [-180|180] "deg"', "08 07", 0.0),  # 1800
        ('0|16@1+ (0.1,0) [0|360] "deg"', "ac 0d", math.radians(-10.0)),  # 3500: 350 degrees, the same place
        ('0|16@1- (-0.01,0) [-327.67|327.68] "deg"', "18 fc", math.radians(10.0)),  # -1000
    ],
)
def test_the_offset_is_applied_before_the_angle_wraps(
    signal: str, data: str, expected_rad: float, tmp_path: Path
) -> None:
    (joint,) = joint_signals(dbc(tmp_path, f"Angle : {signal}"), ["AXIS.Angle"], None)
    payload = bytes.fromhex(data).ljust(8, b"\0")
    assert first_angle(joint, payload) == pytest.approx(expected_rad, abs=2e-6)


@pytest.mark.parametrize("ends", ["-12.5|12.5", "-200|200", "0|3.0", "-3.1|3.1"])
def test_a_range_that_is_no_whole_turn_never_begins_again(ends: str, tmp_path: Path) -> None:
    path = dbc(tmp_path, f'Angle : 0|32@1- (0.001,0) [{ends}] "rad"')
    (joint,) = joint_signals(path, ["AXIS.Angle"], None)
    low, high = (float(end) for end in ends.split("|"))
    angle = ContinuousAngle(joint.scale)
    assert angle.follow(round(low / 0.001), 0.0) == pytest.approx(low)
    assert angle.follow(round(high / 0.001), 10.0) == pytest.approx(high)  # not one step back over the ends
    assert angle.wraps == 0


def test_an_offset_circle_is_followed_over_its_end(tmp_path: Path) -> None:
    path = dbc(tmp_path, 'Angle : 0|16@1+ (0.1,-180) [-180|179.9] "deg"')
    (joint,) = joint_signals(path, ["AXIS.Angle"], None)
    angle = ContinuousAngle(joint.scale)
    seen = [math.degrees(angle.follow(counts, 0.1 * k)) for k, counts in enumerate((3590, 3599, 5, 30))]
    assert seen == pytest.approx([179.0, 179.9, 180.5, 183.0])


@st.composite
def layouts(draw: st.DrawFn) -> tuple[str, str, str]:
    """A signal without stated range, or with all that its bits hold, as cantools accepts it."""
    little = draw(st.booleans())
    length = draw(st.integers(2, 32))
    first = draw(st.integers(0, 64 - length))
    start = first if little else 8 * (first // 8) + 7 - first % 8
    sign = draw(st.sampled_from("+-"))
    scale = draw(st.sampled_from(["1", "0.01", "-0.1", "0.00038147554741", "-1e-05"]))
    offset = draw(st.sampled_from(["0", "-12.5", "3.25", "90", "-200"]))
    unit = draw(st.sampled_from(["rad", "deg"]))
    return f"{start}|{length}@{int(little)}{sign}", f"({scale},{offset}) [0|0]", unit


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(layouts(), st.binary(min_size=8, max_size=8))
def test_signals_give_what_cantools_decodes(tmp_path: Path, layout: tuple[str, str, str], data: bytes) -> None:
    place, rest, unit = layout
    path = dbc(tmp_path, f'Angle : {place} {rest} "{unit}"')
    expected = cantools.database.load_file(path).decode_message(5, data)["Angle"] * RAD[unit]
    (joint,) = joint_signals(path, ["AXIS.Angle"], None)
    if abs(expected) > 1e5:
        return  # beyond what an angle may be; tested with the bounds
    off_rad, within_rad = first_angle(joint, data) - expected, 1e-6
    if joint.scale.first_near_zero:  # the bits are whole turns, to half a count
        off_rad, within_rad = math.remainder(off_rad, math.tau), 0.51 * abs(joint.scale.unit_rad)
    assert abs(off_rad) <= within_rad


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from([32, 64]),
    st.booleans(),
    st.floats(-3000.0, 3000.0, width=32),
    st.sampled_from(["(1,0)", "(0.5,-12.5)", "(-2,1)"]),
)
def test_floating_point_signals_give_what_cantools_decodes(
    tmp_path: Path, bits: int, little: bool, value: float, factors: str
) -> None:
    place = f"{0 if little else 7}|{bits}@{int(little)}-"
    valtype = f"SIG_VALTYPE_ 5 Angle : {1 if bits == 32 else 2};"
    path = dbc(tmp_path, f'Angle : {place} {factors} [0|0] "rad"', valtype)
    database = cantools.database.load_file(path)
    scale, offset = (float(part) for part in factors.strip("()").split(","))
    data = database.encode_message(5, {"Angle": scale * value + offset})
    (joint,) = joint_signals(path, ["AXIS.Angle"], None)
    expected = database.decode_message(5, data)["Angle"]
    assert first_angle(joint, bytes(data).ljust(8, b"\0")) == pytest.approx(expected, rel=1e-7, abs=1e-9)


def test_a_multiplexed_signal_with_an_offset_gives_what_cantools_decodes(tmp_path: Path) -> None:
    path = dbc(
        tmp_path, 'Mode M : 0|2@1+ (1,0) [0|3] ""', 'Angle m1 : 15|16@0+ (0.00038147554741,-12.5) [-12.5|12.5] "rad"'
    )
    (joint,) = joint_signals(path, ["AXIS.Angle"], None)
    data = bytes.fromhex("0190000000000000")
    expected = cantools.database.load_file(path).decode_message(5, data)["Angle"]
    assert first_angle(joint, data) == pytest.approx(expected, abs=1e-9)
    assert joint.counts(bytes.fromhex("0290000000000000")) is None
