"""The emulated hand: the probe stays where it is put, encoders see what their discs make of it."""

import math
import tomllib
from pathlib import Path

import msgspec
import numpy as np
import pytest

from simulators.errors import WorldError
from simulators.hand.hand_rig import HandTruth, is_hand_held, write_hand_truth
from simulators.hand.held_arm import CannotReachError
from simulators.hand.world import HandWorld

RIG = Path(__file__).parents[3] / "rigs" / "arm-cmm-reference.toml"
QUIET = {"seed": 3}
ARM = tomllib.loads(RIG.read_text())["arm"]
POSTURE = [0.3, 0.5, 0.2, 1.2, -0.4, 0.3]


def rig(**emulation: float) -> dict:
    """The shipped rig with what the emulation says instead of its own, in SI."""
    whole = tomllib.loads(RIG.read_text())
    seats = [{"id": 1, "origin_m": [0.55, 0.15, 0.05]}]
    bars = {"bar": [{"id": 1, "length_m": 0.6}], "bar_position": whole["bar_position"][:1]}
    tool = {"point_m": [0.0, 0.0, 0.0], "probe_diameter_m": 0.006}
    devices = {"encoders": whole["devices"]["encoders"]}
    spheres = [{"id": 1, "origin_m": [0.6, -0.15, 0.2], "diameter_m": 0.025}]
    return {
        "arm": ARM,
        "tool": tool,
        "seat": seats,
        "sphere": spheres,
        "devices": devices,
        **bars,
        "emulation": {**QUIET, **emulation},
    }


def held(world: HandWorld, **wish) -> HandWorld:
    world.put(posture_rad=POSTURE, **wish)
    world.advance(world.time_s + 30.0)
    return world


def swinging(world: HandWorld, times: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Tips and shafts while the hand trembles."""
    tips, shafts = [], []
    for _ in range(times):
        world.advance(world.time_s + 0.037)
        tips.append(world.tip_m())
        shafts.append(world.shaft_at_rad(world.time_s))
    return np.array(tips), np.array(shafts)


def test_a_ball_in_its_cone_stays_while_the_joints_tremble():
    world = held(HandWorld.from_rig(rig(tremor_rad=3e-4)), what="seat", id=1)
    tips, shafts = swinging(world)
    np.testing.assert_allclose(tips, np.tile([0.55, 0.15, 0.05], (20, 1)), atol=1e-9)
    assert np.ptp(shafts, axis=0).max() > 1e-4


def test_every_time_in_the_cone_scatters_by_the_contact():
    world = HandWorld.from_rig(rig(contact_m=2e-6))
    tips = np.array([held(world, what="seat", id=1).tip_m() for _ in range(40)])
    scatter = (tips - [0.55, 0.15, 0.05]).std()
    assert 1.4e-6 < scatter < 2.7e-6


def test_a_perfect_arm_shows_its_shafts():
    world = held(HandWorld.from_rig(rig()), what="seat", id=1)
    np.testing.assert_array_equal(world.link_encoders_rad(), world.shaft_at_rad(world.time_s))


def test_a_disc_off_its_shaft_is_read_wrong_once_a_turn_by_its_share_of_the_radius():
    world = HandWorld.from_rig(rig(disc_eccentricity_m=2e-6))
    turn = np.linspace(-math.pi, math.pi, 400)[:, None] * np.ones((1, 6))
    error = world.arm.discs.off_centre_rad(turn)
    sizes = [disc.eccentricity_m / 0.02 for disc in world.truth.discs]
    np.testing.assert_allclose(np.abs(error).max(axis=0), sizes, rtol=1e-3)
    np.testing.assert_allclose(error[0], error[-1], atol=1e-15)


def test_graduation_errors_come_back_with_every_turn_and_do_not_jump():
    world = HandWorld.from_rig(rig(graduation_rad=3e-6))
    angle = np.linspace(-1.0, 1.0, 20_001)[:, None] * np.ones((1, 6))
    error = world.arm.discs.graduation_rad(angle)
    np.testing.assert_allclose(world.arm.discs.graduation_rad(angle + 2.0 * math.pi), error, atol=1e-12)
    assert 1.5e-6 < error.std() < 3.5e-6
    assert np.abs(np.diff(error, axis=0)).max() < 1e-7


def test_a_leaning_axis_and_a_yielding_joint_move_the_probe_but_not_the_shafts():
    plain = HandWorld.from_rig(rig())
    q = np.array([POSTURE])
    for more in ({"axis_wobble_rad": 1e-4}, {"hand_force_n": 5.0, "joint_compliance_rad_nm": 1e-5}):
        moved = HandWorld.from_rig(rig(**more)).arm.tip_m(q) - plain.arm.tip_m(q)
        assert 1e-6 < np.linalg.norm(moved) < 1e-3


def test_a_bearing_runs_out_as_far_as_it_is_said_and_comes_back_with_the_turn():
    """Joint 6 alone turns: the probe is off by its runout, sideways and along, whatever the posture before."""
    plain, worn = HandWorld.from_rig(rig()), HandWorld.from_rig(rig(radial_runout_m=2e-6, axial_runout_m=1e-6))
    q = np.array(POSTURE) * np.ones((400, 1))
    q[:, 5] = np.linspace(-math.pi, math.pi, 400)
    off_m = worn.arm.tip_m(q) - plain.arm.tip_m(q)
    np.testing.assert_allclose(off_m[0], off_m[-1], atol=1e-12)
    last = worn.truth.runouts[5]
    axis = np.linalg.svd(np.diff(plain.arm.tip_m(q), axis=0))[2][2]
    along_m, aside_m = off_m @ axis, off_m - np.outer(off_m @ axis, axis)
    others_m = aside_m.mean(axis=0)
    assert 0.5 * np.ptp(along_m) == pytest.approx(last.axial_m, rel=1e-3)
    np.testing.assert_allclose(np.linalg.norm(aside_m - others_m, axis=1), last.radial_m, rtol=1e-2)


def test_one_deviation_switched_off_leaves_the_others():
    whole = HandWorld.from_rig(rig(length_sigma_m=1e-4, disc_eccentricity_m=2e-6)).truth
    without = HandWorld.from_rig(rig(length_sigma_m=1e-4)).truth
    assert whole.parts == without.parts
    assert whole.discs != without.discs


def test_bars_keep_their_length_wherever_they_stand():
    (bar,) = HandWorld.from_rig(rig(artefact_sigma_m=5e-3)).truth.bars
    assert np.linalg.norm(np.subtract(bar.b_m, bar.a_m)) == pytest.approx(0.6, abs=1e-12)


def test_a_ball_on_the_rim_is_off_until_it_slips():
    world = HandWorld.from_rig(rig(slip_share=1.0))
    off = [np.linalg.norm(held(world, what="seat", id=1).tip_m() - [0.55, 0.15, 0.05]) for _ in range(30)]
    stays = np.array(off) > 1e-4
    assert 5 < stays.sum() < 25
    assert np.max(np.array(off)[~stays]) < 1e-9


def test_a_probe_that_slides_on_a_sphere_stays_on_its_surface():
    world = held(HandWorld.from_rig(rig(slip_share=1.0)), what="sphere", id=1, direction=[0.0, 0.0, 2.0])
    assert np.linalg.norm(world.tip_m() - [0.6, -0.15, 0.2]) == pytest.approx(0.0155, abs=1e-9)


def test_what_is_out_of_reach_or_not_there_is_refused():
    world = HandWorld.from_rig(rig())
    with pytest.raises(CannotReachError, match="ask for another"):
        world.carry(np.array([3.0, 0.0, 0.0]), POSTURE)
    with pytest.raises(WorldError, match="no seat 4; there are 1"):
        world.put("seat", 4, POSTURE)
    with pytest.raises(WorldError, match="has 6 joints"):
        world.put("seat", 1, [0.0])
    with pytest.raises(WorldError, match="ask for a seat"):
        world.put("bar", 1, POSTURE)


def test_the_truth_comes_back_from_its_file(tmp_path):
    truth = HandWorld.from_rig(rig(disc_eccentricity_m=2e-6)).truth
    write_hand_truth(truth, tmp_path / "truth.json")
    assert msgspec.json.decode((tmp_path / "truth.json").read_bytes(), type=HandTruth) == truth


def test_a_rig_with_a_robot_or_without_artefacts_is_not_hand_held():
    whole = rig()
    assert is_hand_held(whole)
    assert not is_hand_held({**whole, "devices": {**whole["devices"], "robot": {}}})
    assert not is_hand_held({"arm": ARM, "devices": whole["devices"]})
