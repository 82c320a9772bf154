"""What an exported arm cannot carry of a model's effects stands in the file, in µm over the recorded workspace."""

import csv
import json
from pathlib import Path

import msgspec
import numpy as np
import pytest

from acquisition.recording.rig import parse_rig
from calibeam.notebook import Model
from calibrate.apply.export.export import FORMS, export_model, form_named
from calibrate.apply.export.not_carried import not_carried
from calibrate.model.model_file import read_model
from calibrate.model.predict import Predictor
from tests.calibrate.model.with_effects.two_joints import PLAY_RAD, REACH_M, two_joints

MODELS = Path(__file__).parents[3] / "golden" / "data" / "formats" / "models"
ANY_MAKE = [form for form in FORMS if form.make is None]  # the others are for arms of one make
OFF_UM = 1e6 * REACH_M * PLAY_RAD / 2.0  # half the play either way, at a stretched arm
SAYS = "not carried: joint1-backlash: 250.0 µm rms, at most 250.0 µm"


@pytest.fixture
def model():
    return two_joints()


def exported(path, model, form):
    lost = export_model(path, parse_rig(model.rig.text, "rig.toml"), model, form)
    return path.read_text(encoding="utf-8"), lost


@pytest.mark.parametrize("form", ANY_MAKE, ids=lambda f: f.name)
def test_the_file_states_what_it_cannot_carry(model, form, tmp_path):
    text, lost = exported(tmp_path / "arm", model, form)
    assert pytest.approx(250.0) == OFF_UM
    assert SAYS in lost
    assert all(says in text for says in lost)
    assert [p.name for p in tmp_path.iterdir()] == ["arm"]


def test_the_stated_distance_is_that_of_file_and_model(model, tmp_path):
    """The file's own arm against the flange of the model with its effects."""
    text, _ = exported(tmp_path / "arm", model, form_named("json"))
    parts = np.array(json.loads(text)["parts"])
    q = np.random.default_rng(1).uniform(0.0, 0.3, (20, 2)) * [1.0, 0.0]
    sides = np.tile([1.0, -1.0], 10)
    T = Model(model, "", "", ()).flange(q, {"approach1": sides})
    for angle, true in zip(q, T, strict=True):
        F = parts[0] @ turn(angle[0]) @ parts[1] @ turn(angle[1]) @ parts[2]
        assert 1e6 * np.linalg.norm(F[:3, 3] - true[:3, 3]) == pytest.approx(OFF_UM, rel=1e-6)


def turn(angle_rad):
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def test_a_bent_arm_moves_less_than_a_stretched_one(model):
    """Between the recorded angles of joint 2 the tip is between 0.3 + 0.2 and hypot(0.3, 0.2) m from axis 1."""
    bent = {**model.session.conditions, "q2_rad": (0.0, 0.5, 1.0, np.pi / 2.0)}
    wider = msgspec.structs.replace(model, session=msgspec.structs.replace(model.session, conditions=bent))
    moved = not_carried(wider).each["joint1-backlash"]
    reach = np.sqrt(0.3**2 + 0.2**2 + 2.0 * 0.3 * 0.2 * np.cos(np.linspace(0.0, np.pi / 2.0, 2000)))
    assert moved.rms_m == pytest.approx(PLAY_RAD / 2.0 * np.sqrt(np.mean(reach**2)), rel=0.02)
    assert moved.max_m == pytest.approx(PLAY_RAD / 2.0 * REACH_M, rel=0.01)


def test_an_effect_of_its_session_only_is_named(model):
    (play,) = model.effects
    passing = msgspec.structs.replace(model, effects=(msgspec.structs.replace(play, holds="session"),))
    assert not_carried(passing).sentences == ("not carried: joint1-backlash: true of its own session only",)


def test_a_model_of_geometry_alone_loses_nothing(model, tmp_path):
    plain = msgspec.structs.replace(model, schema=1, effects=(), needs=(), session=None)
    text, lost = exported(tmp_path / "arm", plain, form_named("dh-csv"))
    assert lost == ()
    assert "not carried" not in text
    rows = csv.DictReader(row for row in text.splitlines() if row[0] != "#")
    assert next(rows)["row"] == "base"


def test_a_tool_that_the_model_found_is_exported_where_it_was_found(model, tmp_path):
    found = msgspec.structs.replace(model, about={"tool": (0.01, 0.02, 0.03)}, chain={"tool.x": 1e-3})
    text, _ = exported(tmp_path / "arm", found, form_named("json"))
    assert json.loads(text)["tool_point_m"] == pytest.approx([0.011, 0.02, 0.03])


@pytest.mark.parametrize("path", sorted(MODELS.glob("*.json")), ids=lambda path: path.stem)
def test_a_model_file_of_schema_1_is_exported_as_it_predicts(path, tmp_path):
    """Whatever the model of the arm, flange and tool are where a prediction has them, and nothing is lost."""
    model = read_model(path)
    assert model.schema == 1
    predictor = Predictor.of(model)
    assert export_model(tmp_path / "arm", predictor.rig, model, form_named("json")) == ()
    arm = json.loads((tmp_path / "arm").read_text())
    for q in np.random.default_rng(2).uniform(-2.0, 2.0, (5, predictor.rig.n_joints)):
        T = np.array(arm["parts"][0])
        for angle, part in zip(q, arm["parts"][1:], strict=True):
            T = T @ turn(angle) @ np.array(part)
        np.testing.assert_allclose(T, predictor.flange(q[None])[0], atol=1e-9)
        if arm["tool_point_m"] is not None:
            tip = T @ np.array([*arm["tool_point_m"], 1.0])
            np.testing.assert_allclose(tip[:3], predictor.tip_m(q[None])[0], atol=1e-9)
