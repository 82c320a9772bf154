"""A model with backlash by the approach side: where a row does not say from where it came, sigma says so."""

import msgspec
import numpy as np
import pytest

from acquisition.recording import Samples
from calibrate.errors import DataError
from calibrate.model_file import Covariance, ModelFile, RigIdentity
from calibrate.physics.predicting import predict_with_physics
from calibrate.physics.records import Effect, EffectParameter, SessionRecord

RIG = """schema = 1
name = "two-joints"
[arm]
model = "dh"
[[arm.joint]]
a_m = 0.3
alpha_rad = 0.0
d_m = 0.0
lower_rad = -3.2
upper_rad = 3.2
[[arm.joint]]
a_m = 0.2
alpha_rad = 0.0
d_m = 0.0
lower_rad = -3.2
upper_rad = 3.2
[tool]
point_m = [0.0, 0.0, 0.0]
[device]
origin_m = [0.0, 0.0, 0.0]
rotation_rad = [0.0, 0.0, 0.0]
"""
PLAY_RAD, SIGMA_RAD = 1e-3, 1e-5
REACH_M = 0.5  # of the stretched arm: what one radian of joint 1 moves the target along y
SIDES = [1.0, -1.0, 1.0, -1.0]


@pytest.fixture
def model():
    play = Effect(
        name="joint1-backlash",
        where="joint1.angle",
        physics="backlash",
        depends_on="approach1",
        shape="sign",
        order=None,
        variant="",
        parameters={"backlash_rad": EffectParameter(PLAY_RAD, SIGMA_RAD, "rad")},
        coefficients={"joint1-backlash.c0": PLAY_RAD},
        inner={},
        about={},
        holds="always",
        range={},
    )
    conditions = {"t_s": [0.0, 1.0, 2.0, 3.0], "q1_rad": [0.0, 0.1, 0.2, 0.3], "q2_rad": [0.0] * 4, "approach1": SIDES}
    return ModelFile(
        schema=2,
        kind="calibeam-model",
        software="",
        rig=RigIdentity("two-joints", "0" * 64, RIG),
        arm_model="dh",
        status="CONVERGED",
        says="",
        poses=4,
        rank=1,
        free=1,
        condition=1.0,
        singular_values=(1.0,),
        unseen=(),
        parameters=(),
        chain={},
        covariance=Covariance(("joint1-backlash.c0",), ((SIGMA_RAD**2,),)),
        noise={},
        repeats=None,
        held_out=None,
        rms_coordinate_before_m=0.0,
        rms_distance_before_m=0.0,
        rms_coordinate_after_m=0.0,
        rms_distance_after_m=0.0,
        instruments=("position",),
        effects=(play,),
        needs=("approach1",),
        session=SessionRecord("", 0.0, 3.0, "0" * 64, {c: tuple(v) for c, v in conditions.items()}),
    )


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
