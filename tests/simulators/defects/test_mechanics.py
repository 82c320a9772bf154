"""What single mechanisms do, against figures worked out by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

from simulators.arm.kinematics import inverse
from simulators.conceal.case import conceal
from simulators.conceal.readings import spots, stand
from simulators.conceal.rig import DualPsd
from simulators.conceal.wanted import Wanted
from simulators.defects.base import BrieflyShiftedBase, CarriedBase
from simulators.defects.detector import CoverGlass, SpottedFace
from simulators.defects.drive import HystereticSpring, OneSidedSpring, played
from simulators.defects.encoder import EccentricDisc, OvalRing
from simulators.defects.fixture import CarriedCones, KnockedTable
from simulators.defects.link import BendingLink, LaggingLink, WornBearing
from simulators.defects.tracker import DrumOutOfRound

ANY_SCENE = SimpleNamespace()
TURN_RAD = np.linspace(-3.0, 3.0, 25)[:, np.newaxis]


def test_an_eccentric_disc_is_read_from_its_own_centre() -> None:
    e_m, r_m, bearing_rad = 1e-3, 0.02, 0.4  # a thousandfold of what is usual: no small angle hides a mistake
    said = TURN_RAD + EccentricDisc(1, e_m, bearing_rad, r_m).reading_error_rad(TURN_RAD, ANY_SCENE)
    head_m = r_m * np.exp(1j * TURN_RAD)
    centre_m = -e_m * np.exp(1j * bearing_rad)  # the head sees the disc's centre on the far side of the shaft
    from_centre = np.angle((head_m - centre_m) / head_m)
    np.testing.assert_allclose(np.abs(said - TURN_RAD), np.abs(from_centre), atol=1e-12)
    assert np.abs(said - TURN_RAD).max() == pytest.approx(e_m / r_m, rel=0.01)


def test_an_oval_ring_errs_twice_a_turn_and_comes_round() -> None:
    ring = OvalRing(1, 2e-4, 0.3)
    error_rad = ring.reading_error_rad(TURN_RAD, ANY_SCENE)[:, 0]
    np.testing.assert_allclose(error_rad, 1e-4 * np.sin(2.0 * (TURN_RAD[:, 0] - 0.3)), atol=1e-7)
    np.testing.assert_allclose(ring.reading_error_rad(TURN_RAD + 2.0 * np.pi, ANY_SCENE)[:, 0], error_rad, atol=1e-12)


def test_play_keeps_the_side_it_came_from_and_forgets_no_small_move() -> None:
    play_rad = 0.1
    via_rad = np.array([0.0, 0.0, 1.02, 0.5])
    goal_rad = np.array([1.0, 0.98, 1.0, 1.0])
    behind_rad = played(np.stack((via_rad, goal_rad), axis=1), play_rad)
    # up to 1: half the play behind; back to 0, up to 0.98: behind again; up to 1.02 and 0.02 back: still held at 0.97;
    # down to 0.5 and up to 1: behind
    np.testing.assert_allclose(behind_rad, [-0.05, -0.05, -0.03, -0.05], atol=1e-12)


def test_a_bent_beam_has_the_textbook_deflection_and_slope() -> None:
    length_m, force_n, bending = 0.5, 40.0, 1e-5
    end_m = np.array([length_m, 0.0, 0.0])
    weight = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, -force_n]]])
    moment = np.array([[[0.0, 0.0, 0.0], [0.0, length_m * force_n, 0.0]]])  # end x force: no couple at the end
    load = SimpleNamespace(force_n=weight, moment_nm=moment)
    motion = BendingLink(1, bending).link_motion(1, end_m, np.zeros((1, 1)), ANY_SCENE, load)[0]
    end = motion @ np.append(end_m, 1.0)
    assert end[2] == pytest.approx(-bending * force_n * length_m**3 / 3.0, rel=1e-9)
    assert motion[0, 2] == pytest.approx(bending * force_n * length_m**2 / 2.0, rel=1e-6)  # nose down: about +y


def test_a_couple_at_the_end_bends_a_beam_to_an_arc() -> None:
    length_m, couple_nm, bending = 0.5, 3.0, 1e-5
    end_m = np.array([length_m, 0.0, 0.0])
    load = SimpleNamespace(force_n=np.zeros((1, 2, 3)), moment_nm=np.array([[[0.0] * 3, [0.0, couple_nm, 0.0]]]))
    motion = BendingLink(1, bending).link_motion(1, end_m, np.zeros((1, 1)), ANY_SCENE, load)[0]
    assert (motion @ np.append(end_m, 1.0))[2] == pytest.approx(-bending * couple_nm * length_m**2 / 2.0, rel=1e-9)


@pytest.mark.parametrize("cycles", [-3, -2, -1, 2, 3])
def test_a_worn_bearing_leans_in_its_pattern_seen_from_the_housing(cycles: int) -> None:
    lean_rad = 1e-4
    motion = WornBearing(1, lean_rad, cycles, 0.7).link_motion(1, np.zeros(3), TURN_RAD, ANY_SCENE, ANY_SCENE)
    turn = TURN_RAD[:, 0]
    axis_x = np.cos(turn) * motion[:, 0, 2] - np.sin(turn) * motion[:, 1, 2]  # where z points, seen from the housing
    axis_y = np.sin(turn) * motion[:, 0, 2] + np.cos(turn) * motion[:, 1, 2]
    np.testing.assert_allclose(axis_x, lean_rad * np.sin(cycles * turn + 0.7), atol=1e-8)
    np.testing.assert_allclose(axis_y, -lean_rad * np.cos(cycles * turn + 0.7), atol=1e-8)


def test_glass_shifts_a_slanting_beam_as_snells_law_says() -> None:
    slant, thickness_m, index = np.radians(35.0), 1e-3, 1.52
    beam = np.array([np.sin(slant), 0.0, -np.cos(slant)])
    light = SimpleNamespace(direction=np.broadcast_to(beam, (1, 2, 3)))
    seen_m = CoverGlass(1, thickness_m, index).seen_spots_m(np.zeros((1, 2, 2)), light, ANY_SCENE)
    inside = brentq(lambda r: index * np.sin(r) - np.sin(slant), 0.0, 1.0)
    assert seen_m[0, 0, 0] == pytest.approx(-thickness_m * (np.tan(slant) - np.tan(inside)), rel=1e-9)
    assert not seen_m[0, 1].any()


def test_a_drum_comes_round_once_a_circumference() -> None:
    drum = DrumOutOfRound(5e-5, 0.04, 0.3)
    length_m = np.linspace(0.5, 2.5, 60)
    off_m = drum.seen_length_m(length_m, ANY_SCENE) - length_m
    again_m = drum.seen_length_m(length_m + 2.0 * np.pi * 0.04, ANY_SCENE) - length_m - 2.0 * np.pi * 0.04
    np.testing.assert_allclose(again_m, off_m, atol=1e-15)
    assert np.ptp(off_m) == pytest.approx(1e-4, rel=0.01)


def test_a_spot_on_a_face_moves_the_readings_near_it_alone() -> None:
    spot = SpottedFace(1, 2e-5, (1e-3, -2e-3), 1e-3, 0.0)
    own_m = np.array([[1e-3, -2e-3], [2e-3, -2e-3], [8e-3, 5e-3]])
    moved_m = spot.seen_m(own_m, None, ANY_SCENE) - own_m
    np.testing.assert_allclose(moved_m[:, 0], [2e-5, 2e-5 * np.exp(-0.5), 0.0], atol=1e-12)
    np.testing.assert_allclose(moved_m[:, 1], 0.0, atol=1e-18)


def test_what_was_pushed_back_stands_where_it_stood() -> None:
    scene = SimpleNamespace(t_s=np.array([0.0, 10.0, 19.9, 20.0, 30.0]))
    shift = BrieflyShiftedBase(1e-4, (1.0, 0.0, 0.0), 0.5, (0.0, 0.0, 1.0), 10.0, 20.0)
    np.testing.assert_allclose(shift.base_motion(scene, None)[:, 0, 3], [0.0, 1e-4, 1e-4, 0.0, 0.0], atol=1e-15)


def test_a_part_that_is_carried_for_a_while_comes_back() -> None:
    scene = SimpleNamespace(t_s=np.array([0.0, 10.0, 19.9, 20.0, 30.0]), seat=np.array([1, 2, 1, 1, 2]))
    away = ((1e-4, 0.0, 0.0), (0.0, 0.0, 1e-3), (0.0, 0.0, 0.0), "while", 10.0, 10.0)
    foot = CarriedBase(*away).base_motion(scene, None)
    np.testing.assert_allclose(foot[:, 0, 3], [0.0, 1e-4, 1e-4, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(foot[:, 1, 0], [0.0, 1e-3, 1e-3, 0.0, 0.0], atol=1e-8)


@pytest.mark.parametrize(("cone", "moved"), [(0, [True, True, False]), (2, [False, True, False])])
def test_a_plate_carries_all_its_cones_or_one_slides_and_bars_are_held_by_hand(cone: int, moved: list[bool]) -> None:
    scene = SimpleNamespace(t_s=np.zeros(3), seat=np.array([1, 2, 0]))
    plate = CarriedCones((1e-4, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "step", cone=cone)
    np.testing.assert_array_equal(plate.stations_motion(scene)[:, 0, 3] > 0.0, moved)


def test_a_casting_follows_a_ramp_of_its_skin_with_one_time_constant() -> None:
    t_s = np.array([0.0, 100.0, 400.0, 1300.0, 6000.0])
    scene = SimpleNamespace(t_s=t_s, warmed_k=lambda where: 2e-3 * t_s)
    motion = LaggingLink(2, 1e-5, "", 1500.0).link_motion(2, np.array([1.0, 0.0, 0.0]), np.zeros((5, 3)), scene, None)
    law = 2e-3 * (t_s - 1500.0 * (1.0 - np.exp(-t_s / 1500.0)))
    np.testing.assert_allclose(motion[:, 0, 3], 1e-5 * law, atol=1e-15)


def test_a_one_sided_spring_yields_to_each_sense_by_its_own_stiffness() -> None:
    load = SimpleNamespace(torque_nm=np.array([[4.0], [-4.0], [0.0]]))
    turn_rad = OneSidedSpring(1, 1e-5, 0.25).turn_rad(np.zeros((3, 1)), ANY_SCENE, load)
    np.testing.assert_allclose(turn_rad, [4e-5, -1e-5, 0.0], atol=1e-18)


def test_a_hysteretic_spring_trails_the_load_and_closes_its_loop() -> None:
    case = conceal(Wanted("tracker", seed=4, defects=("hysteretic-spring",), samples=45))
    drawn, scene = case.hidden[0].defect, case.table.scene
    assert isinstance(drawn, HystereticSpring)
    joint = drawn.joint - 1
    low, high = np.quantile(scene.goal_rad[:, joint], (0.05, 0.95))
    goal_rad = np.tile(np.median(scene.goal_rad, axis=0), (60, 1))
    goal_rad[:, joint] = np.tile(np.concatenate((np.linspace(low, high, 15), np.linspace(high, low, 15))), 2)
    via_rad = np.concatenate((goal_rad[:1], goal_rad[:-1]))
    to_and_fro = replace(scene, goal_rad=goal_rad, via_rad=via_rad, payload_kg=np.zeros(60), t_s=np.arange(60.0))
    load = stand(case.drawn.true, to_and_fro, [replace(drawn, compliance_rad_nm=0.0)], goal_rad).load
    assert load is not None
    half_nm = 0.1 * float(np.ptp(load.torque_nm[:, joint]))
    turn_rad = replace(drawn, compliance_rad_nm=1e-5, thresholds_nm=(half_nm,)).turn_rad(goal_rad, to_and_fro, load)
    behind_nm = turn_rad / 1e-5 - load.torque_nm[:, joint]
    assert behind_nm.min() == pytest.approx(-half_nm, rel=1e-6)  # on one way
    assert behind_nm.max() == pytest.approx(half_nm, rel=1e-6)  # on the other
    assert turn_rad[59] == pytest.approx(turn_rad[29], abs=1e-15)


def test_a_knocked_table_is_to_every_reading_a_base_that_moved_the_other_way() -> None:
    case = conceal(Wanted("dual-psd", seed=4, defects=("knocked-table",), samples=45, places=2))
    table, scene, true = case.hidden[0].defect, case.table.scene, case.drawn.true
    assert isinstance(table, KnockedTable)
    assert isinstance(true.instrument, DualPsd)
    base = SimpleNamespace(base_motion=lambda scene, load: inverse(table.stations_motion(scene)))
    knocked, carried, at_rest = (
        spots(true, true.instrument, scene, these, stand(true, scene, these, case.posture_rad)).seen_m
        for these in ([table], [base], [])
    )
    assert np.abs(knocked - at_rest).max() > 1e-6
    np.testing.assert_allclose(knocked, carried, atol=1e-10)
    assert len(np.unique(scene.placement[:15])) == 2  # both stations stand there at once
