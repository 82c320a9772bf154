"""Beam, faces, mirror: cases that can be done by hand."""

import math

import numpy as np
import pytest

from simulators.world.optics import REFLECTIVITY, Face, Ray, place_faces, trace
from simulators.world.rig import Fixture, Pose
from simulators.world.world import World

HALF_M = 0.010
# A flat face in the xy plane looking up, and a wall at y = 0.1 looking back at it along -y.
FLOOR = Face((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), HALF_M)
WALL = Face((0.0, 0.1, 0.1), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0), HALF_M)
ROOT = math.sqrt(0.5)


def test_beam_at_45_degrees_goes_from_the_floor_to_the_wall():
    """Down to the origin along (0, 1, -1), up again along (0, 1, 1): meets y = 0.1 at z = 0.1, the wall's centre."""
    spots = trace(Ray(0.0, -0.2, 0.2, 0.0, ROOT, -ROOT), (FLOOR, WALL))
    assert spots.first == 1
    assert spots.psd1 == pytest.approx((0.0, 0.0, 1.0 - REFLECTIVITY), abs=1e-15)
    assert spots.psd2 == pytest.approx((0.0, 0.0, REFLECTIVITY * (1.0 - REFLECTIVITY)), abs=1e-15)


def test_spot_on_the_floor_shifts_the_one_on_the_wall_against_it():
    """3 mm further along y on the floor: the reflected ray reaches the wall 3 mm lower; 2 mm of x stay 2 mm."""
    spots = trace(Ray(0.002, -0.197, 0.2, 0.0, ROOT, -ROOT), (FLOOR, WALL))
    assert spots.psd1[:2] == pytest.approx((0.002, 0.003), abs=1e-15)
    assert spots.psd2[:2] == pytest.approx((0.002, -0.003), abs=1e-15)


def test_the_other_way_round_the_wall_is_struck_first():
    """The same path backwards: in along (0, 1, -1) is out along (0, -1, 1) from the wall's side."""
    spots = trace(Ray(0.0, -0.1, 0.3, 0.0, ROOT, -ROOT), (FLOOR, WALL))
    assert spots.first == 2
    assert spots.psd2 == pytest.approx((0.0, 0.0, 1.0 - REFLECTIVITY), abs=1e-15)
    assert spots.psd1 == pytest.approx((0.0, 0.0, REFLECTIVITY * (1.0 - REFLECTIVITY)), abs=1e-15)


def test_beam_off_a_face_gives_no_light():
    spots = trace(Ray(0.0101, -0.2, 0.2, 0.0, ROOT, -ROOT), (FLOOR, WALL))
    assert (spots.psd1, spots.psd2, spots.first) == (None, None, 0)


def test_reflected_beam_that_misses_the_second_face_leaves_it_dark():
    spots = trace(Ray(0.0, 0.0, 0.2, 0.0, 0.0, -1.0), (FLOOR, WALL))
    assert spots.first == 1
    assert spots.psd1 == pytest.approx((0.0, 0.0, 1.0 - REFLECTIVITY), abs=1e-15)
    assert spots.psd2 is None


def test_back_of_a_face_stops_the_beam():
    """From below, and from behind the wall: a housing, not a window."""
    assert trace(Ray(0.0, 0.0, -0.2, 0.0, 0.0, 1.0), (FLOOR, WALL)).first == 0
    assert trace(Ray(0.0, 0.3, 0.3, 0.0, -ROOT, -ROOT), (FLOOR, WALL)).first == 0


def test_face_behind_the_laser_is_not_lit():
    assert trace(Ray(0.0, 0.0, 0.2, 0.0, 0.0, 1.0), (FLOOR, WALL)).first == 0


def test_fixture_is_placed_by_its_two_poses():
    """PSD 1 turned by 90 deg about z; PSD 2 stands 0.1 m along PSD 1's y, turned by 90 deg about its x."""
    fixture = Fixture(HALF_M, Pose((0.0, 0.1, 0.0), (math.pi / 2, 0.0, 0.0)))
    first, second = place_faces(fixture, Pose((1.0, 2.0, 3.0), (0.0, 0.0, math.pi / 2)))
    np.testing.assert_allclose(first.axis_x, (0.0, 1.0, 0.0), atol=1e-15)
    np.testing.assert_allclose(second.centre_m, (0.9, 2.0, 3.0), atol=1e-15)
    np.testing.assert_allclose(second.normal, (1.0, 0.0, 0.0), atol=1e-15)
    np.testing.assert_allclose(second.axis_x, (0.0, 1.0, 0.0), atol=1e-15)


def test_fixture_taken_away_leaves_the_dark_and_an_unknown_place_is_refused(ur5e):
    world = World.from_rig(ur5e())
    world.place_fixture(0)
    assert world.spots().first == 0
    with pytest.raises(ValueError, match="no placement 9; the rig has 1, 2"):
        world.place_fixture(9)
