"""Flange and tip of a model with physics: the effects act, and what a row lacks is named and widens the sigma."""

import json
import re
import warnings

import numpy as np
import pytest

import calibeam
from calibeam.cli import run
from calibeam.notebook import Model
from calibrate.model.model_file import read_model
from calibrate.model.predict import Predictor
from tests.support.halves import diagnosed_and_predicted, numbers, table_of, written_halves


@pytest.fixture(scope="module")
def slack(tmp_path_factory):
    """A tracker's session of an arm with slack in a drive: folder and model."""
    folder = tmp_path_factory.mktemp("slack")
    wanted = {"family": "tracker", "seed": 7, "defects": ("slack-drive",), "enr": 4.0, "samples": 200}
    recording, unseen, _, _ = written_halves(folder, **wanted)
    diagnosed_and_predicted(folder, recording, unseen)
    model = Model(read_model(folder / "model.json"), "with care", "", ())
    return folder, unseen, model


def asked(unseen, model):
    table = table_of(unseen)
    q = np.stack([numbers(table[f"q{j + 1}_rad"]) for j in range(6)], axis=1)
    return q, {name: numbers(table[name]) for name in model.file.needs}, table


def test_the_tip_is_where_the_prediction_has_it(slack):
    """A tracker's prediction is the tip in the frame of the device."""
    folder, unseen, model = slack
    assert model.file.needs
    q, conditions, _ = asked(unseen, model)
    out = folder / "elsewhere.csv"
    assert run(["predict", str(folder / "model.json"), str(unseen), "--out", str(out)]) == 0
    predicted = np.stack([numbers(table_of(out)[c]) for c in ("x_m", "y_m", "z_m")], axis=1)
    T = Predictor.of(model.file).T_base_device
    assert np.allclose((model.tip(q, conditions) - T[:3, 3]) @ T[:3, :3], predicted, atol=1e-12)


def test_the_effects_move_the_flange(slack):
    _, unseen, model = slack
    q, conditions, _ = asked(unseen, model)
    T = model.flange(q, conditions)
    assert T.shape == (len(q), 4, 4)
    apart = np.linalg.norm(T[:, :3, 3] - Predictor.of(model.file).flange(q)[:, :3, 3], axis=1)
    assert np.max(apart) > 1e-6


def test_one_value_holds_for_all_poses(slack):
    _, unseen, model = slack
    q, _, _ = asked(unseen, model)
    one = model.tip(q, dict.fromkeys(model.file.needs, 1.0))
    each = model.tip(q, {name: np.ones(len(q)) for name in model.file.needs})
    assert np.array_equal(one, each)


def test_a_missing_condition_is_named_and_widens_the_sigma(slack):
    _, unseen, model = slack
    q, conditions, _ = asked(unseen, model)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        known = model.tip_sigma(q, conditions)
    with pytest.warns(UserWarning, match=f"{model.file.needs[0]} is missing"):
        unknown = model.tip_sigma(q)
    height = 2  # the other two follow how the base is turned, which a tracker does not show
    assert np.all(unknown[:, height] >= known[:, height])
    assert np.any(unknown[:, height] > known[:, height] + 1e-7)
    with pytest.warns(UserWarning, match="is missing"):
        assert model.flange_sigma(q[0]).shape == (1, 6)


@pytest.mark.usefixtures("bare_figures")
def test_the_report_of_a_model_with_physics_shows_what_is_left(slack, capsys):
    folder, _, model = slack
    out = folder / "report.html"
    arguments = ["report", str(folder / "recording"), "--model", str(folder / "model.json"), "--out", str(out)]
    assert run(arguments) == 0
    assert f"{1e6 * model.file.rms_distance_after_m:.1f} µm" in " ".join(capsys.readouterr().out.split())
    assert out.exists()


def test_a_recording_is_opened_next_to_it(slack):
    """The same samples, predicted in Python: as in the file."""
    folder, _, model = slack
    session = calibeam.open(folder / "recording")
    found = model.predict(session.samples, same_session=True)
    stated = np.sqrt(np.mean([model.file.noise[name] ** 2 for name in ("x_m", "y_m", "z_m")]))
    residual = np.stack([found[f"r_{name}"] for name in ("x_m", "y_m", "z_m")])
    assert np.sqrt(np.mean(residual**2)) < 1.1 * stated


def test_an_exported_arm_states_what_it_cannot_carry(slack, capsys):
    """The distance in the file is that between the exported arm and the model's flange with its effects."""
    folder, unseen, model = slack
    out = folder / "exported.json"
    arguments = ["identify", str(folder / "recording"), "--model", str(folder / "model.json"), "--out", str(out)]
    assert run([*arguments, "--export", "json", "--export", "urdf"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    arm = json.loads((folder / "exported.arm.json").read_text())
    (whole, *each) = arm["not_carried"]
    assert all(" ".join(says.split()) in said for says in arm["not_carried"])
    assert all(says in (folder / "exported.urdf").read_text() for says in arm["not_carried"])
    assert [says.split(": ")[1] for says in each] == [e.name for e in model.file.effects]

    q, conditions, _ = asked(unseen, model)
    tip = np.array([*arm["tool_point_m"], 1.0])
    exported = np.array([carried(arm["parts"], row) @ tip for row in q])[:, :3]
    apart_um = 1e6 * np.linalg.norm(Model(read_model(out), "", "", ()).tip(q, conditions) - exported, axis=1)
    rms_um, largest_um = (float(number) for number in re.findall(r"([\d.]+) µm", whole))
    assert np.sqrt(np.mean(apart_um**2)) == pytest.approx(rms_um, rel=0.25)  # other poses of the same workspace
    assert rms_um > 5.0
    assert largest_um >= rms_um


def carried(parts, q_rad):
    """T_base_flange of the file, as it states its own convention."""
    T = np.array(parts[0])
    for angle, part in zip(q_rad, parts[1:], strict=True):
        c, s = np.cos(angle), np.sin(angle)
        T = T @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) @ np.array(part)
    return T
