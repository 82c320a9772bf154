"""`calibrate` keeps the model that predicts unseen rows better: identified geometry, or the physics of a diagnosis."""

import json

import numpy as np
import pytest

from acquisition.recording import read
from calibeam.cli import run
from calibeam.results.diagnosis import diagnose_recording
from calibeam.results.identification import identify_session, session_model
from calibrate.diagnose.record.schema import no_better_with_physics
from calibrate.fit.identify.identify import identify
from calibrate.model.predict import Predictor, predict
from calibrate.report.unseen_by_both import compared_on_unseen_rows
from tests.calibrate.apply.export.tracked import tracked, with_discs

ROWS, LAST = 80, 16  # a fifth of the session
SAME_SHARE = 0.03  # of an rms: weights of a refit are those of the whole session


@pytest.fixture(scope="module")
def discs(tmp_path_factory):
    """Every encoder disc is off centre; the rig file lets an identification find that, a diagnosis names it."""
    return with_discs(tracked(tmp_path_factory.mktemp("discs") / "recording", "ur5e", lengths_m=2e-4, rows=ROWS), 3e-4)


def test_an_identification_that_is_better_than_the_diagnosis_is_kept(discs, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "1000")
    out = tmp_path / "c"
    assert run(["calibrate", str(discs), "--out", str(out)]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("the model ")]
    model, diagnosis = (json.loads((out / name).read_text()) for name in ("model.json", "diagnosis.json"))
    assert len(diagnosis["findings"]) > 2
    assert all(split["removed_low"] > 0.5 for split in diagnosis["splits"])  # against a geometry without discs
    assert model.get("effects", []) == []
    assert any(name.endswith("disc_sine") for name in model["chain"])
    assert line.startswith("the model is the identified geometry alone: on unseen rows it is not better for certain ")
    assert line.count("with the geometry alone, ") == line.count("with the physics;") + 1 == 2


def test_the_identified_geometry_is_proved_as_it_predicts_rows_that_it_has_not_seen(discs):
    recording = read(discs)
    model = session_model(identify_session(recording), recording)
    found, file = diagnose_recording(recording)
    compared = compared_on_unseen_rows(recording, model, found, file, np.random.default_rng(1))
    (split,) = [split for split in compared.splits if split.split == "last block"]
    assert (split.observations, split.wild) == (LAST, 0)
    first = recording.samples.take(np.arange(ROWS - LAST))
    known = identify(recording.rig, first, rng=np.random.default_rng(1), held_out_share=0.0)
    values = dict(zip((p.name for p in known.parameters), known.theta.tolist(), strict=True))
    predictor = Predictor(recording.rig, values, known.about, model.instruments)
    read_there = predict(predictor, recording.samples.take(np.arange(ROWS - LAST, ROWS)))
    missed = np.stack([read_there[f"r_{c}"] for c in ("x_m", "y_m", "z_m")])
    assert split.rms_before_m == pytest.approx(np.sqrt(np.mean(missed**2)), rel=SAME_SHARE)
    assert no_better_with_physics(file) == ""
    assert no_better_with_physics(compared) != ""
