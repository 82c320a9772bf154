"""Encoder discs that the geometry has found stay where they are when effects act beside them."""

from dataclasses import replace

import numpy as np
from msgspec import structs

from acquisition.recording import Samples
from calibrate.apply.predicting import flange_with_physics
from calibrate.model.effects.ports import Perturbation
from calibrate.model.predict import Predictor
from calibrate.model.with_effects.acting import frames_under
from tests.calibrate.model.with_effects.two_joints import RIG, two_joints

DISC_RAD = 2e-3
Q_RAD = np.array([[0.3, -0.7], [1.1, 0.4], [-2.0, 1.5]])
TOLERANCE = """[tolerance]
length_m = 0.001
angle_rad = 0.001
eccentricity_rad = 0.001
"""


def model():
    return structs.replace(two_joints(), rig=structs.replace(two_joints().rig, text=RIG + TOLERANCE))


def with_disc():
    predictor = Predictor.of(model())
    return replace(predictor, values={**predictor.values, "joint2.disc_sine": DISC_RAD})


def test_frames_without_effects_are_those_of_the_geometry():
    predictor, nothing = with_disc(), Perturbation.none(len(Q_RAD), 2)
    frames = frames_under(predictor, Q_RAD, nothing)
    assert np.allclose(frames[:, -1], predictor.flange(Q_RAD), atol=1e-12)
    drawn = replace(predictor, values={})
    assert np.max(np.abs(frames[:, -1] - drawn.flange(Q_RAD))) > 1e-4


def test_discs_act_next_to_an_effect(monkeypatch):
    """Play of joint 1 turns the arm as a whole: apart from that turn the flange is that of the discs."""
    predictor = with_disc()
    monkeypatch.setattr(Predictor, "of", classmethod(lambda cls, file: predictor))
    samples = Samples(
        {"t_s": np.arange(3.0), "q1_rad": Q_RAD[:, 0], "q2_rad": Q_RAD[:, 1], "approach1": np.ones(3)}, n_joints=2
    )
    found, _ = flange_with_physics(model(), samples)
    distance_m = np.linalg.norm(found[:, :2, 3], axis=1)
    assert np.allclose(distance_m, np.linalg.norm(predictor.flange(Q_RAD)[:, :2, 3], axis=1), atol=1e-12)
    undone = np.linalg.norm(replace(predictor, values={}).flange(Q_RAD)[:, :2, 3], axis=1)
    assert np.max(np.abs(distance_m - undone)) > 1e-5
