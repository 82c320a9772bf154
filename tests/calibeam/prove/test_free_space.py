"""Error over the workspace: blind to where the frame stands, not to the shape of the arm."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibeam.prove.record import FreeSpace
from calibeam.prove.scoring import errors_m
from calibeam.prove.unseen import LaserBeam

RNG = np.random.default_rng(5)
TIPS_M = RNG.uniform(-0.8, 0.8, (60, 3))
WAYS = RNG.standard_normal((60, 3)) / np.sqrt(3.0)
TURN = Rotation.from_rotvec([2e-3, -1e-3, 3e-3])
SHIFT_M = np.array([1e-3, -2e-3, 5e-4])


def _tips() -> FreeSpace:
    return FreeSpace(tip_m=TIPS_M.tolist())


def _beams() -> FreeSpace:
    return FreeSpace(beam_origin_m=TIPS_M.tolist(), beam_direction=WAYS.tolist())


def test_a_moved_frame_is_no_error_of_tips() -> None:
    assert errors_m(TURN.apply(TIPS_M) + SHIFT_M, _tips()) == pytest.approx(0.0, abs=1e-12)


def test_a_moved_frame_is_no_error_of_beams() -> None:
    moved = LaserBeam(TURN.apply(TIPS_M) + SHIFT_M, TURN.apply(WAYS))
    assert errors_m(moved, _beams()) == pytest.approx(0.0, abs=1e-12)


def test_where_on_its_beam_a_laser_sits_is_no_error() -> None:
    along = RNG.uniform(-0.2, 0.2, (60, 1)) * WAYS
    assert errors_m(LaserBeam(TIPS_M + along, 3.0 * WAYS), _beams()) == pytest.approx(0.0, abs=1e-12)


def test_noise_of_tips_is_its_own_size() -> None:
    away_m = 1e-4 * RNG.standard_normal((60, 3))
    expected = 1e-4 * np.sqrt(3.0 * (1.0 - 6.0 / 180.0))  # six of 180 are taken up by the frame
    assert errors_m(TIPS_M + away_m, _tips()) == pytest.approx(expected, rel=0.15)


def test_a_beam_off_to_the_side_counts() -> None:
    side_m = 1e-4 * np.cross(WAYS, RNG.standard_normal((60, 3)))
    said = errors_m(LaserBeam(TIPS_M + side_m, WAYS), _beams())
    assert said == pytest.approx(float(np.sqrt(np.mean(np.sum(side_m**2, axis=1)))), rel=0.15)


def test_a_model_that_says_nothing_has_no_error() -> None:
    assert errors_m(None, _tips()) is None
    assert errors_m(TIPS_M, _beams()) is None
