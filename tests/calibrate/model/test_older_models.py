"""A model.json of an earlier version says the same by its present names."""

import json
from math import sqrt
from pathlib import Path

import pytest

from calibrate.model.model_file import read_model
from calibrate.model.older_models import with_present_names
from calibrate.report.evidence.model_tests import proofs

MODELS = Path(__file__).parents[2] / "golden" / "data" / "formats" / "models"
COORDINATES = {"position-mdh": 3, "full-pose": 3, "wire": 1, "seat-bar": 3, "spots-bar": 4}


@pytest.mark.parametrize("name", COORDINATES)
def test_an_rms_was_that_of_distances(name):
    old, model = json.loads((MODELS / f"{name}.json").read_text()), read_model(MODELS / f"{name}.json")
    assert model.rms_distance_after_m == old["rms_after_m"]
    assert model.rms_distance_before_m == old["rms_before_m"]
    assert model.rms_coordinate_after_m == pytest.approx(old["rms_after_m"] / sqrt(COORDINATES[name]))
    assert [p.rms_distance_after_m for p in proofs(model)] == [p["rms_after"] for p in old["proofs"]]


def test_of_spots_alone_it_was_that_of_coordinates():
    old, model = json.loads((MODELS / "spots.json").read_text()), read_model(MODELS / "spots.json")
    assert model.rms_coordinate_after_m == old["rms_after_m"]
    assert model.rms_distance_after_m == pytest.approx(2.0 * old["rms_after_m"])
    assert model.noise["joint"] == old["noise"]["joint_rad"]
    assert model.noise["psd_believed"] == old["noise"]["psd_believed_m"]
    assert model.held_out["dual-psd_rms_distance_after_m"] == pytest.approx(2.0 * old["held_out"]["rms_after_m"])
    assert model.held_out["dual-psd_observations"] == old["held_out"]["poses"]


def test_present_names_stay_as_they_are():
    content = {"rms_distance_after_m": 1e-6, "proofs": [{"rms_before": 1.0}]}
    assert with_present_names(content) is content
