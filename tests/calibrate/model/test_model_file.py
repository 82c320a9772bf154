"""model.json: read back as written, silent where nothing is known, and refused when it is something else."""

import json

import numpy as np
import pytest

from acquisition.recording.rig import load_rig, rig_sha256, rig_text
from calibrate.errors import DataError
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.record import record_of
from calibrate.model.assumed_rig import AssumedRig
from calibrate.model.model_file import (
    RigIdentity,
    corrections,
    read_model,
    write_model,
)
from tests.calibrate.conftest import spot_samples


@pytest.fixture(scope="module")
def rig_path(request):
    return request.config.rootpath / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture(scope="module")
def identified(rig_path, sessions):
    session, rig = sessions(41, n=60, repeats=6), load_rig(rig_path)
    result = identify(rig, spot_samples(session), rng=np.random.default_rng(0))
    return session, rig, result


@pytest.fixture
def written(identified, rig_path, tmp_path):
    _, rig, result = identified
    model = record_of(result, RigIdentity(rig.name, rig_sha256(rig_text(rig_path))), rig.arm.model.value)
    path = tmp_path / "model.json"
    write_model(path, model)
    return path, model


def test_a_model_is_read_back_as_written(written):
    path, model = written
    assert read_model(path) == model
    assert [p.name for p in path.parent.iterdir()] == ["model.json"]


def test_undetermined_parameters_carry_no_number_but_a_reason(written):
    parameters = {p["name"]: p for p in json.loads(written[0].read_text())["parameters"]}
    for name in ("joint1.zero", "joint6.zero", "placement2.yaw"):
        assert parameters[name]["value"] is None
        assert parameters[name]["sigma"] is None
        assert "only in combination" in parameters[name]["undetermined"]
    assert parameters["joint2.zero"]["sigma"] < 1e-5
    assert parameters["joint2.zero"]["undetermined"] is None


def test_the_file_names_rig_software_rank_noise_and_proof(written):
    content = json.loads(written[0].read_text())
    assert content["rig"]["name"] == "ur5e-dual-psd"
    assert len(content["rig"]["sha256"]) == 64
    assert content["software"].startswith("calibeam ")
    assert content["free"] - content["rank"] == len(content["unseen"]) == 2
    assert content["noise"]["joint"] > 0.0
    assert content["held_out"]["dual-psd_rms_distance_after_m"] < content["held_out"]["dual-psd_rms_distance_before_m"]
    assert len(content["covariance"]["rows"]) == len(content["covariance"]["names"]) == 47


def test_corrections_of_the_file_predict_the_spots(identified, written):
    session, rig, _ = identified
    assumed = AssumedRig(rig, corrections(read_model(written[0])))
    rows = zip(session.q_rad, session.placement, session.first_psd, strict=True)
    predicted = np.array([assumed.spots(q, int(place), int(first)) for q, place, first in rows])
    assert np.sqrt(np.mean((predicted - session.spots_m) ** 2)) < 5e-6


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{", "not a model.json"),
        ('{"schema": 3, "kind": "calibeam-model"}', "schema 3; expected 'calibeam-model', schema 1 or 2"),
        ('{"schema": 1, "kind": "else"}', "kind 'else'"),
        ('{"schema": 1, "kind": "calibeam-model"}', "damaged model.json"),
    ],
)
def test_another_file_is_refused_by_name(tmp_path, text, says):
    path = tmp_path / "model.json"
    path.write_text(text)
    with pytest.raises(DataError, match=says) as caught:
        read_model(path)
    assert str(path) in str(caught.value)


def test_a_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(DataError, match="cannot be read"):
        read_model(tmp_path / "none.json")
