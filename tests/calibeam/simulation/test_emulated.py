"""`calibeam emulate --model` and `--hide`: the emulated world has the model's geometry and the mechanisms asked for."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from acquisition.recording.rig import parse_rig
from calibeam.cli import run
from calibeam.simulation.emulated import emulated
from calibeam.simulation.mechanism_by_hand import BY_HAND, by_hand, form, unit_of
from calibrate.errors import DataError
from calibrate.model.model_file import RigIdentity
from calibrate.model.predict import Predictor
from simulators.defects import GIVEN, WrittenError, torque
from simulators.defects.drive import SlackDrive, SoftJoint
from simulators.defects.fixture import BumpedFixture
from simulators.world.world import World
from tests.calibeam.simulation.test_mechanism_laws import bench
from tests.calibeam.simulation.test_replay import SLIPPED, SOFT, WARM, model_of

RIG = Path("rigs/ur5e-dual-psd.toml")
PLAIN = tomllib.loads(RIG.read_text(encoding="utf-8"))


def test_the_emulated_arm_has_the_geometry_of_the_model() -> None:
    text = RIG.read_text(encoding="utf-8")
    rig = parse_rig(text, str(RIG))
    chain = {
        "joint2.zero": 2e-3,
        "link2.length": 4e-4,
        "link3.offset": -3e-4,
        "laser.tilt_u": 1e-3,
        "placement1.x": 2e-3,
    }
    base = model_of(bench("tracker"))

    model = structs.replace(
        base, rig=RigIdentity(rig.name, "", text), arm_model="dh", chain=chain, about={}, session=None, effects=()
    )
    given, mechanisms, notes = emulated(model, rig)
    assert (mechanisms, notes) == ((), ())
    predictor = Predictor.of(model)
    plain = {**PLAIN, "emulation": {}}
    q_rad = np.array(PLAIN["motion"]["home_rad"], dtype=np.float64)
    world = World.from_rig(plain, q_rad=q_rad, given=given)
    np.testing.assert_allclose(world.T_base_flange(), predictor.flange(world.joints().q_rad[np.newaxis])[0], atol=5e-6)
    drawn = World.from_rig(plain, q_rad=q_rad)
    assert np.abs(world.T_base_flange() - drawn.T_base_flange())[:3, 3].max() > 2e-4
    beam, origin = world.beam(), np.array(predictor.rig.tool.laser_origin_m)
    flange = world.T_base_flange()
    np.testing.assert_allclose(beam[:3], flange[:3, :3] @ origin + flange[:3, 3], atol=1e-9)


def test_an_emulated_session_is_another_one() -> None:
    place = bench("dual-psd")
    _, mechanisms, notes = emulated(model_of(place, SOFT, WARM, SLIPPED), place.predictor.rig)
    assert {type(one).KIND for one in mechanisms} == {"soft-joint", "heated-link"}
    assert notes == ("left out, true of its own session only: joint3-encoder-slip",)


TRACKED = Path("rigs/ur5e-tracker.toml")
FOUND = {"joint2.zero": 2e-3, "link2.length": 4e-4, "tool.x": 1.5e-3, "device.x": 3e-3, "device.yaw": 2e-3}


def test_an_emulated_tracker_stands_where_the_model_has_it_and_sees_its_target() -> None:
    text = TRACKED.read_text(encoding="utf-8")
    rig, plain = parse_rig(text, str(TRACKED)), tomllib.loads(text)
    identity = RigIdentity(rig.name, "", text)
    base = structs.replace(model_of(bench("tracker")), rig=identity, arm_model="dh", about={}, session=None, effects=())
    model = structs.replace(base, chain=FOUND)
    given, mechanisms, notes = emulated(model, rig)
    assert (mechanisms, notes) == ((), ())
    world = World.from_rig({**plain, "emulation": {}}, q_rad=plain["motion"]["home_rad"], given=given)
    predictor = Predictor.of(model)
    T, tip_m = predictor.T_base_device, predictor.tip_at(predictor.flange(world.joints().q_rad[np.newaxis]))[0]
    np.testing.assert_allclose(world.target_position_m(), T[:3, :3].T @ (tip_m - T[:3, 3]), atol=5e-6)
    bare, _, _ = emulated(structs.replace(base, chain={}), rig)
    drawn = World.from_rig({**plain, "emulation": {}}, q_rad=plain["motion"]["home_rad"], given=bare)
    assert np.linalg.norm(world.target_position_m() - drawn.target_position_m()) > 2e-3


def test_a_soft_joint_of_a_model_bends_the_arm_under_the_tracker() -> None:
    place = bench("tracker")
    _, mechanisms, notes = emulated(model_of(place, SOFT), place.predictor.rig)
    assert [type(one).KIND for one in mechanisms] == ["soft-joint"]
    assert notes == ()


def test_a_model_without_light_is_none_of_a_rig_with_a_laser() -> None:
    with pytest.raises(DataError, match="has a laser and a fixture, the model has none"):
        emulated(model_of(bench("tracker")), parse_rig(RIG.read_text(encoding="utf-8"), str(RIG)))


def test_mechanisms_by_hand() -> None:
    assert by_hand("soft-joint joint2 8e-6", PLAIN) == SoftJoint(2, 8e-6)
    assert by_hand("slack-drive joint5 1e-4", PLAIN) == SlackDrive(5, 1e-4)
    bumped = by_hand("bumped-fixture place1 3e-5 at_s=120 along=0,0,1", PLAIN)
    assert isinstance(bumped, BumpedFixture)
    assert (bumped.at_s, bumped.along, bumped.place) == (120, (0, 0, 1), 1)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("softjoint joint2 8e-6", "no mechanism of this name"),
        ("soft-joint joint9 8e-6", "joint9 is none of this rig"),
        ("soft-joint 8e-6", "joint missing"),
        ("soft-joint joint2 stiff", "no size and no place"),
        ("soft-joint joint2 8e-6 colour=3", "nothing called colour"),
        ("", "no mechanism of this name"),
        ("coulomb joint3 -4.0", r"coulomb: Expected `float` >= 0.0 - at `\$.coulomb_nm`"),
        ("late-torque joint2 1.0", r"late-torque: Expected `float` <= 0.1"),
        ("stribeck joint4 5.0", "speed_rad_s missing; it takes stribeck jointN SIZE"),
    ],
)
def test_a_wrong_line_says_what_is_wrong(line: str, says: str) -> None:
    with pytest.raises(WrittenError, match=says):
        by_hand(line, PLAIN)


def test_the_page_lists_every_mechanism_of_torque_as_it_is_written() -> None:
    page = Path("docs/simulation.md").read_text(encoding="utf-8")
    made = [by_hand(text, PLAIN) for text in re.findall(r"^\| `(\S+ .+)` \|", page, re.MULTILINE)]
    assert {type(one) for one in made} == {kind for kind in GIVEN if kind.__module__ == torque.__name__}
    assert by_hand("gear-ripple joint5 1.5 order=2", PLAIN) == torque.GearRipple(5, 1.5, 2, 101.0)


def test_a_wrong_name_lists_every_mechanism_with_its_unit() -> None:
    with pytest.raises(WrittenError) as failed:
        by_hand("spring", PLAIN)
    assert "soft-joint jointN SIZE (compliance_rad_nm, rad/Nm)" in str(failed.value)
    assert all(form(kind) in str(failed.value) for kind in BY_HAND)
    assert unit_of("expansion_per_k") == "1/K"
    assert unit_of("hardening_rad_nm3") == "rad/Nm³"


def test_the_command_prints_the_whole_list_and_a_short_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["emulate", str(RIG), "--hide", "spring"]) == 1
    *listed, error = capsys.readouterr().err.strip().splitlines()
    assert [line.strip() for line in listed] == [form(kind) for kind in BY_HAND]
    assert error == "error: --hide 'spring': no mechanism of this name; take one of the list"


def test_a_soft_joint_by_hand_bends_the_emulated_beam() -> None:
    q_rad = np.array(PLAIN["motion"]["home_rad"], dtype=np.float64)
    plain = {**PLAIN, "emulation": {}}
    stiff, soft = (
        World.from_rig(plain, q_rad=q_rad, hidden=hidden)
        for hidden in ((), (by_hand("soft-joint joint2 8e-6", plain),))
    )
    for world in (stiff, soft):
        world.advance(0.2)
    assert 1e-6 < np.abs(np.array(stiff.beam()[:3]) - np.array(soft.beam()[:3])).max() < 1e-3
