"""One seed, one world: the same numbers however time is cut; truth kept apart; requests without sense refused."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simulators.errors import WorldError
from simulators.world.truth import read_truth, truth_of, write_truth
from simulators.world.world import World

BENT = np.array([0.3, -1.4, 1.3, -1.2, -1.5, 0.4])


def lit_world(ur5e, **emulation) -> World:
    """A world whose beam strikes PSD 1's centre from 0.12 m: the fixture is put in front of the laser."""
    rig = ur5e(**emulation)
    beam = World.from_rig(ur5e(), q_rad=BENT).beam()
    along = np.array(beam[3:])
    across = np.cross(along, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    axes = np.column_stack([across, np.cross(-along, across), -along])  # z against the beam
    place = {
        "origin_m": (np.array(beam[:3]) + 0.12 * along).tolist(),
        "rotation_rad": Rotation.from_matrix(axes).as_rotvec().tolist(),
    }
    rig["placement"] = [{"id": 1, "psd1_in_base": place}]
    return World.from_rig(rig, q_rad=BENT)


def run(world: World, cuts_ms: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """The same commands every 10 ms and samples at 2 kHz, with the time between commands cut differently."""
    rng = np.random.default_rng(0)
    currents_a, joints_rad = [], []
    for block in range(60):
        if block % 10 < 5:  # half of the time a small motion, then a rest in which the arm comes to stand
            world.command(BENT + 2e-4 * rng.standard_normal(6))
        start_s = 0.010 * block
        for from_ms, to_ms in pairwise([0, *cuts_ms]):
            world.advance(start_s + 0.001 * to_ms)
            times_s = start_s + 0.0005 * np.arange(2 * from_ms + 1, 2 * to_ms + 1)
            currents_a.append(world.photocurrents_a(times_s))
        joints_rad.append(world.joints().q_rad)
    return np.concatenate(currents_a), np.array(joints_rad)


def test_same_seed_gives_the_same_numbers_however_time_is_cut(ur5e):
    emulation = {"joint_repeatability_rad": 3e-6, "psd_noise_m": 2e-6}
    whole_a, whole_rad = run(lit_world(ur5e, **emulation), [10])
    for cut in ([2, 4, 6, 8, 10], [1, 3, 10], [5, 10]):
        currents_a, joints_rad = run(lit_world(ur5e, **emulation), cut)
        np.testing.assert_allclose(currents_a, whole_a, rtol=0, atol=1e-18)
        np.testing.assert_array_equal(joints_rad, whole_rad)
    assert (whole_a[:, 0] > 1e-5).all()  # the beam was on the face all the time


def test_samples_between_two_steps_lie_between_them(ur5e):
    world = lit_world(ur5e)
    world.advance(0.1)
    world.command(np.add(BENT, [0.0, 0.0, 0.0, 0.0, 0.002, 0.0]))
    world.advance(0.110)
    x_a = world.photocurrents_a(np.linspace(0.1005, 0.110, 20))[:, :2]
    x_m = 0.010 * (x_a[:, 1] - x_a[:, 0]) / x_a.sum(axis=1)
    ends = np.abs(np.diff(x_m))
    assert np.abs(x_m[-1] - x_m[0]) > 1e-5
    np.testing.assert_allclose(x_m[2:-1:2], 0.5 * (x_m[1:-2:2] + x_m[3::2]), atol=1e-9)
    assert ends.max() < 1e-4


def test_samples_outside_the_last_advance_are_refused(ur5e):
    world = World.from_rig(ur5e())
    world.advance(0.010)
    world.advance(0.012)
    with pytest.raises(WorldError, match="not within the last advance"):
        world.photocurrents_a([0.005])
    with pytest.raises(WorldError, match="not within the last advance"):
        world.photocurrents_a([0.0125])
    assert world.photocurrents_a([]).shape == (0, 8)


def test_fixture_moved_in_the_light_is_dark_from_then_on(ur5e):
    world = lit_world(ur5e)
    world.advance(0.010)
    assert world.spots().first == 1
    assert world.photocurrents_a([0.010])[0, 0] > 1e-5
    world.place_fixture(0)
    world.advance(0.012)
    assert np.abs(world.photocurrents_a([0.011, 0.012])).max() < 1e-7
    world.place_fixture(1)
    world.advance(0.014)
    assert world.photocurrents_a([0.014])[0, 0] > 1e-5


def test_two_seeds_are_two_worlds_and_one_seed_is_one(ur5e, no_deviation):
    rig = ur5e(**no_deviation)
    assert truth_of(rig, 1) == truth_of(rig, 1)
    assert truth_of(rig, 1).joint_zero_rad != truth_of(rig, 2).joint_zero_rad
    assert World.from_rig(rig).truth == truth_of(rig, 7)
    assert World.from_rig(rig, seed=8).truth == truth_of(rig, 8)


def test_seed_below_zero_is_refused(ur5e):
    with pytest.raises(WorldError, match="seed -1; give a whole number from 0 on"):
        World.from_rig(ur5e(), seed=-1)


def test_switching_one_deviation_off_leaves_the_others(ur5e, no_deviation):
    whole = truth_of(ur5e(**no_deviation), 1)
    straight = truth_of(ur5e(**{**no_deviation, "angle_sigma_rad": 0.0}), 1)
    assert [link.beta_rad for link in straight.links] == [0.0] * 6
    assert [link.a_m for link in straight.links] == [link.a_m for link in whole.links]
    assert (straight.joint_zero_rad, straight.placements) == (whole.joint_zero_rad, whole.placements)


def test_without_deviations_the_truth_is_the_drawing(ur5e):
    rig = ur5e()
    truth = truth_of(rig, 1)
    assert truth.joint_zero_rad == (0.0,) * 6
    assert truth.laser_direction == pytest.approx((0.0, 1.0, 0.0))
    for link, drawn in zip(truth.links, rig["arm"]["joint"], strict=True):
        assert (link.a_m, link.d_m, link.alpha_rad, link.beta_rad) == (
            drawn["a_m"],
            drawn["d_m"],
            drawn["alpha_rad"],
            0.0,
        )
    for place, drawn in zip(truth.placements, rig["placement"], strict=True):
        assert place.psd1_in_base.origin_m == pytest.approx(drawn["psd1_in_base"]["origin_m"])
        assert place.psd1_in_base.rotation_rad == pytest.approx(drawn["psd1_in_base"]["rotation_rad"])


def test_deviations_have_the_sizes_that_the_rig_states(ur5e, no_deviation):
    rig = ur5e(**no_deviation)
    truths = [truth_of(rig, seed) for seed in range(300)]
    a_m = np.array([[link.a_m for link in t.links] for t in truths]) - [j["a_m"] for j in rig["arm"]["joint"]]
    assert a_m.std() == pytest.approx(3e-4, rel=4 / np.sqrt(2 * a_m.size))
    beta_rad = np.array([[t.links[i].beta_rad for i in (1, 2, 5)] for t in truths])  # behind parallel axes
    assert beta_rad.std() == pytest.approx(5e-4, rel=4 / np.sqrt(2 * beta_rad.size))
    zeros_rad = np.array([t.joint_zero_rad for t in truths])
    assert 0.95 * 0.035 < np.abs(zeros_rad).max() <= 0.035
    tilts = np.array([t.laser_direction for t in truths])[:, [0, 2]]
    assert tilts.std() == pytest.approx(2e-3, rel=4 / np.sqrt(2 * tilts.size))
    shift_m = np.array([t.placements[1].psd1_in_base.origin_m for t in truths]) - [0.45, -0.25, 0.30]
    assert shift_m.std() == pytest.approx(3e-3, rel=4 / np.sqrt(2 * shift_m.size))


def test_truth_survives_its_file(ur5e, no_deviation, tmp_path: Path):
    truth = truth_of(ur5e(**no_deviation), 4)
    write_truth(truth, tmp_path / "aside" / "truth.json")
    assert read_truth(tmp_path / "aside" / "truth.json") == truth


def test_truth_file_that_is_none_is_named(tmp_path: Path):
    path = tmp_path / "truth.json"
    path.write_text('{"seed": 1}')
    with pytest.raises(WorldError, match=r"truth\.json: not a truth file"):
        read_truth(path)


@pytest.mark.parametrize("q_rad", [[0.0] * 5, [0.0] * 5 + [float("nan")], 0.0])
def test_set_point_without_sense_is_refused(ur5e, q_rad):
    with pytest.raises(WorldError, match="the arm takes 6 finite numbers"):
        World.from_rig(ur5e()).command(q_rad)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda rig: rig["arm"]["joint"][2].pop("a_m"), r"a_m.*joint\[2\]"),
        (lambda rig: rig["arm"].update(model="mdh"), 'arm.model = "mdh" cannot be emulated'),
        (lambda rig: rig["tool"].update(laser_direction=[0, 0, 0]), "points nowhere"),
        (lambda rig: rig["placement"][1].update(id=1), "placement id 1 stands twice"),
        (lambda rig: rig["emulation"].update(psd_noise_m=-1.0), "psd_noise_m"),
        (lambda rig: rig.pop("fixture"), "fixture"),
    ],
)
def test_rig_that_cannot_be_emulated_is_refused_by_name(ur5e, spoil, message):
    rig = ur5e()
    spoil(rig)
    with pytest.raises(WorldError, match=message):
        World.from_rig(rig)


def test_psd_rate_sets_the_noise_of_the_currents(ur5e):
    def spread_a(rate_hz: float) -> float:
        world = lit_world(ur5e, psd_noise_m=2e-6)
        world.psd_rate(rate_hz)
        world.advance(4.0)
        return float(world.photocurrents_a(np.linspace(0.001, 4.0, 4000))[:, 0].std())

    assert spread_a(4000.0) == pytest.approx(2.0 * spread_a(1000.0), rel=1e-9)
    with pytest.raises(WorldError, match="positive"):
        World.from_rig(ur5e()).psd_rate(0.0)


def test_rig_warms_up_slowly_from_the_air_around_it(ur5e):
    world = World.from_rig(ur5e())
    cold = world.joints().temperature_degC[0], world.psd_temperature_degC
    world.advance(3600.0)
    warm = world.joints().temperature_degC[0], world.psd_temperature_degC
    assert cold == pytest.approx((22.0, 22.0))
    assert 30.0 < warm[0] < 35.0
    assert 25.0 < warm[1] < 27.0
