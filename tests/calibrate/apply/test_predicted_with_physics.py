"""A model carries what a diagnosis found: unseen rows are predicted within what the noise and the covariance say."""

import json

import numpy as np
import pytest
from msgspec import structs

from acquisition.recording.rig import parse_rig
from acquisition.recording.session_folder import read_csv
from calibeam.cli import run
from calibrate.apply.predicting import predict_with_physics
from calibrate.model.model_file import read_model
from tests.support.halves import OBSERVED, diagnosed_and_predicted, inside_95, judged, numbers, table_of, written_halves


@pytest.fixture(scope="module")
def slipped(tmp_path_factory):
    """A tracker's session in which an encoder slips: folder, unseen rows, model, prediction, case, which rows."""
    folder = tmp_path_factory.mktemp("slipped")
    wanted = {"family": "tracker", "seed": 2001, "defects": ("any",), "enr": 2.0, "samples": 160}
    recording, unseen, case, rows = written_halves(folder, **wanted)
    return folder, unseen, *diagnosed_and_predicted(folder, recording, unseen), case, rows


def test_what_was_found_is_in_the_model_with_its_kind(slipped):
    _, _, model, _, case, _ = slipped
    (hidden,) = case.hidden
    assert model["schema"] == 2
    effect, left = model["effects"]
    assert (effect["physics"], effect["where"]) == (hidden.defect.PHYSICS, hidden.defect.port)
    assert effect["holds"] == "session"
    assert set(effect["coefficients"]) <= set(model["covariance"]["names"])
    assert all(p["unit"] for p in effect["parameters"].values())
    assert (left["after"], left["holds"], left["depends_on"]) == (effect["name"], "always", "")


def test_the_file_says_how_the_fit_was_made(slipped):
    fit = slipped[2]["fit"]
    assert (fit["method"], fit["loss"]) == ("levenberg-marquardt", "student-t")
    assert fit["iterations"] > 0
    assert fit["ended_by"] in ("LIKELIHOOD", "ROUNDS")
    assert np.isfinite(fit["minus_2_log_likelihood"])
    assert fit["law"] == "student-t"


def test_unseen_rows_are_predicted_to_the_noise(slipped):
    _, _, model, table, case, rows = slipped
    residual, sigma = judged(model, table, "tracker")
    noise = (case.values_m - case.exact.values_m)[rows]
    assert np.sqrt(np.mean(residual**2)) < 1.15 * np.sqrt(np.mean(noise**2))
    assert inside_95(residual, sigma) > 0.9


def test_an_effect_of_a_session_is_left_out_and_named_at_another_place(slipped, capsys):
    folder, unseen, model, table, _, _ = slipped
    out = folder / "elsewhere.csv"
    assert run(["predict", str(folder / "model.json"), str(unseen), "--out", str(out)]) == 0
    assert f"left out, true of its own session only: {model['effects'][0]['name']}" in capsys.readouterr().out
    without, _ = judged(model, table_of(out), "tracker")
    with_it, _ = judged(model, table, "tracker")
    late = numbers(table["t_s"]) >= model["effects"][0]["inner"]["time_s"]
    assert np.sqrt(np.mean(without[~late] ** 2)) > 1.5 * np.sqrt(np.mean(with_it[~late] ** 2))
    # What the slip left behind holds on.
    assert np.allclose(without[late], with_it[late], atol=1e-9)


def test_what_the_model_was_given_is_predicted_as_the_fit_has_it(slipped):
    """The rows of the fit itself leave the noise that the model states."""
    folder, _, model, _, _, _ = slipped
    out = folder / "own.csv"
    own = folder / "recording" / "samples.csv"
    assert run(["predict", str(folder / "model.json"), str(own), "--out", str(out), "--same-session"]) == 0
    residual, _ = judged(model, table_of(out), "tracker")
    stated = np.sqrt(np.mean([model["noise"][name] ** 2 for name in OBSERVED["tracker"]]))
    assert 0.75 * stated < np.sqrt(np.mean(residual**2)) < 1.1 * stated


def test_rows_beyond_the_recorded_range_name_the_driver(slipped):
    folder, unseen, _, _, _, _ = slipped
    header, *rows = unseen.read_text().splitlines()
    late = folder / "late.csv"
    late.write_text("\n".join([header, *(",".join(["1e6", *row.split(",")[1:]]) for row in rows)]) + "\n")
    out = folder / "late-predicted.csv"
    assert run(["predict", str(folder / "model.json"), str(late), "--out", str(out), "--same-session"]) == 0
    assert set(table_of(out)["outside"]) == {"t"}


def test_between_the_rows_where_it_stepped_both_are_possible(slipped, capsys):
    """Just behind the last row before it the step is unlikely to have been; in the middle of the gap sigma is most."""
    folder, unseen, model, _, _, _ = slipped
    dated = model["effects"][0]["parameters"]["time_s"]
    gap_s = np.sqrt(12.0) * dated["sigma"]
    first_s = dated["value"] - gap_s / 2.0
    header, row, *_ = unseen.read_text().splitlines()
    times_s = first_s + gap_s * np.array([-0.1, 0.1, 0.499, 0.501, 0.9, 1.1])
    asked, out = folder / "gap.csv", folder / "gap-predicted.csv"
    asked.write_text("\n".join([header, *(",".join([repr(t), *row.split(",")[1:]]) for t in times_s.tolist())]) + "\n")
    assert run(["predict", str(folder / "model.json"), str(asked), "--out", str(out), "--same-session"]) == 0
    assert f"4 of 6 rows lie between the recorded rows where {model['effects'][0]['name']} stepped" in (
        capsys.readouterr().out
    )
    predicted = table_of(out)
    assert predicted["outside"] == ["", "t", "t", "t", "t", ""]
    read, sigma = ([numbers(predicted[f"{k}{c}"]) for c in OBSERVED["tracker"]] for k in ("", "s_"))
    step = np.linalg.norm(np.array(read)[:, -1] - np.array(read)[:, 0])
    more = np.sqrt(np.maximum(np.sum(np.square(sigma), axis=0) - np.sum(np.square(sigma), axis=0)[0], 0.0)) / step
    assert np.allclose(more[1:5], np.sqrt([0.1, 0.5, 0.5, 0.1]), rtol=0.05)


def test_a_command_for_geometry_names_what_it_leaves_out(slipped, capsys):
    folder, _, model, _, _, _ = slipped
    run(["verify", str(folder / "recording"), "--model", str(folder / "model.json"), "--out", str(folder / "v.json")])
    lines = capsys.readouterr().err
    assert f"its effects are left out: {model['effects'][0]['name']}" in lines


def test_a_file_whose_effects_contradict_each_other_is_refused(slipped, tmp_path, capsys):
    folder, unseen, _, _, _, _ = slipped
    content = json.loads((folder / "model.json").read_text())
    for change, says in FAULTS:
        faulty = json.loads(json.dumps(content))
        change(faulty)
        path = tmp_path / "model.json"
        path.write_text(json.dumps(faulty))
        assert run(["predict", str(path), str(unseen), "--out", str(tmp_path / "p.csv"), "--same-session"]) == 1
        assert says in " ".join(capsys.readouterr().err.split())


def test_the_written_model_is_read_as_it_was_written(slipped):
    model = read_model(slipped[0] / "model.json")
    assert model.session is not None
    assert len({len(v) for v in model.session.conditions.values()}) == 1
    assert np.all(np.isfinite(numbers(slipped[3]["s_x_m"])))


def _named_twice(content):
    content["effects"].append(content["effects"][0])


def _without_session(content):
    content["session"] = None


def _first_schema(content):
    content["schema"] = 1


def _short_column(content):
    content["session"]["conditions"]["t_s"] = [0.0]


def _more_coefficients(content):
    content["effects"][0]["coefficients"] |= {"x": 1.0, "y": 1.0}


def _no_joint(content):
    del content["session"]["conditions"]["q1_rad"]


def _unknown_place(content):
    content["effects"][0]["where"] = "joint77.angle"


FAULTS = [
    (_named_twice, "effects: two are named"),
    (_without_session, "effects without session"),
    (_first_schema, "schema 1 holds no effects"),
    (_short_column, "session.conditions.t_s holds 1 values"),
    (_more_coefficients, "coefficients where its form has"),
    (_no_joint, "session.conditions.q1_rad: missing or empty"),
    (_unknown_place, "joint77.angle"),
]


def test_what_unseen_rows_showed_is_in_every_sigma_of_a_position(slipped):
    folder, unseen, *_ = slipped
    model = read_model(folder / "model.json")
    rows = read_csv(unseen, parse_rig(model.rig.text, "rig.toml"))
    assert model.left_m is not None
    sure, unsure = (predict_with_physics(structs.replace(model, left_m=left_m), rows) for left_m in (0.0, 2e-5))
    for name in ("s_x_m", "s_y_m", "s_z_m"):
        assert unsure.columns[name] == pytest.approx(np.hypot(sure.columns[name], 2e-5))
    assert len(unsure.notes) == len(sure.notes) + 1
