"""What single mechanisms do, against figures worked out by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

from simulators.defects.detector import CoverGlass
from simulators.defects.drive import played
from simulators.defects.encoder import EccentricDisc, OvalRing
from simulators.defects.link import BendingLink, WornBearing
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
    behind_rad = played(via_rad, goal_rad, play_rad)
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
