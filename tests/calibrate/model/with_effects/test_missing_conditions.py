"""A model with backlash by the approach side: where a row does not say from where it came, sigma says so."""

import msgspec
import numpy as np
import pytest

from acquisition.recording import Samples
from calibrate.apply.predicting import predict_with_physics
from calibrate.errors import DataError
from tests.calibrate.model.with_effects.two_joints import PLAY_RAD, REACH_M, SIGMA_RAD, two_joints


@pytest.fixture
def model():
    return two_joints()


def table(**columns):
    zero = np.zeros(2)
    return Samples({"t_s": np.array([0.0, 1.0]), "q1_rad": zero, "q2_rad": zero, **columns}, 2)


def test_the_play_moves_the_target_to_the_side_it_came_from(model):
    found = predict_with_physics(model, table(approach1=np.array([1.0, -1.0])))
    np.testing.assert_allclose(found.columns["y_m"], REACH_M * PLAY_RAD / 2.0 * np.array([-1.0, 1.0]), rtol=1e-6)
    np.testing.assert_allclose(found.columns["s_y_m"], REACH_M * SIGMA_RAD / 2.0, rtol=1e-6)
    assert found.notes == ()


@pytest.mark.parametrize("columns", [{}, {"approach1": np.array([1.0, np.nan])}])
def test_a_row_without_its_side_has_half_the_play_as_sigma_and_is_named(model, columns):
    found = predict_with_physics(model, table(**columns))
    assert found.columns["y_m"][1] == pytest.approx(0.0, abs=1e-12)
    assert found.columns["s_y_m"][1] == pytest.approx(REACH_M * PLAY_RAD / 2.0, rel=1e-3)
    (note,) = found.notes
    assert note.startswith(f"approach1 is missing in {2 - len(columns)} of 2 rows")
    assert "joint1-backlash" in note


def test_an_effect_at_no_port_of_the_arm_is_refused_by_name(model):
    (play,) = model.effects
    odd = msgspec.structs.replace(model, effects=(msgspec.structs.replace(play, where="joint9.angle"),))
    with pytest.raises(DataError, match=r"joint1-backlash: no backlash at joint9\.angle"):
        predict_with_physics(odd, table(approach1=np.array([1.0, -1.0])))


def test_a_side_that_was_derived_is_found_again_in_the_file(model):
    (play,) = model.effects
    derived = msgspec.structs.replace(model, effects=(msgspec.structs.replace(play, shape="hysteresis"),))
    found = predict_with_physics(derived, table(approach1=np.array([1.0, -1.0])))
    np.testing.assert_allclose(found.columns["y_m"], REACH_M * PLAY_RAD / 2.0 * np.array([-1.0, 1.0]), rtol=1e-6)
