"""What is assumed of an arm: errors of their own sizes, or the covariance of a calibrated model."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from calibrate.errors import DataError
from calibrate.model.model_file import (
    Covariance,
    ModelFile,
    ModelParameter,
    RigIdentity,
)
from calibrate.model.parameters import index_of
from calibrate.tool_axes.arm_prior import ArmErrors, assumed_prior, prior_of_model
from tests.calibrate.tool_axes.drawn_arms import UR5, nominal


def model(values, covariance, undetermined=()):
    """A model file that states these values and their covariance, and for some a reason instead."""
    stated = tuple(
        ModelParameter(n, "rad", None if n in undetermined else v, None if n in undetermined else 1e-5, None)
        for n, v in values.items()
    )
    return ModelFile(
        schema=1,
        kind="calibeam-model",
        software="test",
        rig=RigIdentity("ur5", "none"),
        arm_model="dh",
        status="CONVERGED",
        says="",
        poses=1,
        rank=1,
        free=1,
        condition=None,
        singular_values=(),
        unseen=(),
        parameters=stated,
        chain=values,
        covariance=Covariance(tuple(values), tuple(map(tuple, covariance))),
        noise={},
        repeats=None,
        held_out=None,
        rms_coordinate_before_m=1e-3,
        rms_distance_before_m=1e-3,
        rms_coordinate_after_m=5e-5,
        rms_distance_after_m=5e-5,
    )


def sigma_of(prior, arm, name):
    column = index_of(arm.parameters)[name]
    place = prior.columns.tolist()
    return np.sqrt(prior.covariance[place.index(column), place.index(column)]) if column in place else 0.0


def test_every_zero_length_and_angle_has_its_stated_sigma():
    errors = ArmErrors(2e-3, 1e-4, 5e-4)
    arm = nominal(UR5, errors.links)
    prior = assumed_prior(arm, errors.zero_sigma_rad)
    assert sigma_of(prior, arm, "joint6.zero") == pytest.approx(2e-3)
    assert sigma_of(prior, arm, "link6.offset") == pytest.approx(1e-4)
    assert sigma_of(prior, arm, "link5.twist") == pytest.approx(5e-4)
    assert sigma_of(prior, arm, "link1.tilt") == 0.0  # between crossing axes it is another name of a zero


def test_a_calibrated_model_replaces_what_it_determines_and_nothing_else():
    arm = nominal(UR5, ArmErrors().links)
    values = {"joint5.zero": 1e-3, "link5.twist": -2e-4, "joint6.zero": 0.0}
    covariance = [[4e-10, 1e-10, 0.0], [1e-10, 9e-10, 0.0], [0.0, 0.0, 1e-12]]
    prior = prior_of_model(arm, model(values, covariance, ["joint6.zero"]), assumed_prior(arm))
    assert sigma_of(prior, arm, "joint5.zero") == pytest.approx(2e-5)
    assert sigma_of(prior, arm, "link5.twist") == pytest.approx(3e-5)
    assert sigma_of(prior, arm, "joint6.zero") == pytest.approx(3e-3)
    assert sigma_of(prior, arm, "link6.offset") == pytest.approx(3e-4)
    columns = [prior.columns.tolist().index(index_of(arm.parameters)[n]) for n in ("joint5.zero", "link5.twist")]
    assert prior.covariance[columns[0], columns[1]] == pytest.approx(1e-10)
    assert_allclose(prior.mean[index_of(arm.parameters)["joint5.zero"]], 1e-3)


@pytest.mark.parametrize("size", [-1e-3, float("inf"), float("nan")])
def test_what_is_no_sigma_is_refused(size):
    with pytest.raises(DataError, match="length_sigma_m"):
        ArmErrors(length_sigma_m=size)
