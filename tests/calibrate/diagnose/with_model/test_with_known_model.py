"""Beside a known model: nothing new on its own recording, changes on a later one, and a refit of its structure.

The later recording is the half of a concealed session that the model has not seen, with what a change does to it.
"""

import csv
import json
import shutil

import numpy as np
import pytest

from acquisition.recording import read
from calibeam.cli import run
from calibrate.diagnose.assess.findings import named
from calibrate.diagnose.new_poses.contests import duel, rival_named
from calibrate.diagnose.new_poses.longer_session import at_new_poses
from calibrate.diagnose.new_poses.next_poses import next_poses, reach_of
from calibrate.diagnose.new_poses.reachable import reachable
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined
from calibrate.diagnose.search.score import scores
from calibrate.diagnose.state.session import session_of
from calibrate.diagnose.with_model.known import known_before
from calibrate.model.model_file import read_model
from tests.support.halves import written_halves
from tests.support.pairs import Pair, all_at_once, device, tool

JOINT, MOVED_RAD = 5, 2e-4


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """A tracker's session of an arm with a soft joint."""
    return Pair(tmp_path_factory.mktemp("soft"), **wanted(4.0))


@pytest.fixture(scope="module")
def soft(pair):
    """Folder, model, hidden defect."""
    return pair.folder, json.loads(pair.model.read_text()), pair.case.hidden[0].defect


def wanted(enr):
    return {"family": "tracker", "seed": 11, "defects": ("soft-joint",), "enr": enr, "samples": 240}


def later(folder, name, samples, joint_off_rad=0.0):
    """A recording of the rig in `folder` with these samples; one joint reads otherwise by so much."""
    out = folder / name
    out.mkdir()
    shutil.copy(folder / "recording" / "rig.toml", out)
    header, *rows = list(csv.reader(samples.read_text().splitlines()))
    column = header.index(f"q{JOINT}_rad")
    for row in rows:
        row[column] = repr(float(row[column]) + joint_off_rad)
    with (out / "samples.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([header, *rows])
    return out


def asked(folder, recording, *more):
    """diagnosis.json of a recording beside the model of the folder."""
    out = folder / f"{recording.name}.json"
    assert run(["diagnose", str(recording), "--model", str(folder / "model.json"), "--out", str(out), *more]) == 0
    return json.loads(out.read_text())


def test_its_own_recording_holds_nothing_new(soft, capsys):
    folder, model, _ = soft
    found = asked(folder, folder / "recording")
    assert "Nothing new" in capsys.readouterr().out
    assert (found["verdict"], found["findings"], found["changed"]) == ("consistent", [], [])
    assert found["known"] == {"same_recording": True, "effects": [e["name"] for e in model["effects"]], "left_out": []}


def test_a_later_recording_of_the_same_machine_holds_nothing_new_and_gives_no_model(soft, capsys):
    """Beside a model of another recording only changes are fitted; the remedy is named."""
    folder, _, _ = soft
    recording, diagnosis, out = (
        later(folder, "unchanged", folder / "unseen.csv"),
        folder / "now.json",
        folder / "no.json",
    )
    arguments = ["diagnose", str(recording), "--model", str(folder / "model.json"), "--out", str(diagnosis)]
    assert run([*arguments, "--model-out", str(out)]) == 1
    assert "calibeam identify --model" in " ".join(capsys.readouterr().err.split())
    assert not out.exists()
    found = json.loads(diagnosis.read_text())
    assert (found["verdict"], found["changed"]) == ("consistent", [])
    assert found["known"]["same_recording"] is False


def test_a_joint_zero_that_has_moved_is_named_with_its_size_and_without_alternative(soft, capsys):
    """A joint that reads more than before has its zero moved the other way; a tilt about the axis of a joint is its
    zero under another name, and no alternative: no plan is made.
    """
    folder, _, _ = soft
    plan = folder / "next.toml"
    found = asked(folder, later(folder, "moved", folder / "unseen.csv", MOVED_RAD), "--plan-out", str(plan))
    (finding,) = found["findings"]
    assert (finding["where"], finding["physics"]) == (f"joint{JOINT}.angle", "joint-zero-moved")
    assert finding["rivals"] == []
    assert not plan.exists()
    (changed,) = found["changed"]
    assert changed["parameter"] == f"joint{JOINT}.zero"
    assert changed["by"] == pytest.approx(-MOVED_RAD, abs=4.0 * changed["sigma"])
    assert changed["sigma"] < 0.2 * MOVED_RAD
    printed = " ".join(capsys.readouterr().out.split())
    assert f"changed: joint{JOINT}.zero by" in printed
    assert "no finding has an alternative" in printed


def test_a_tool_that_has_moved_is_named_wherever_the_tracker_stands_now(soft, pair):
    """Tool and last link trade decimetres for nothing: by their curvature they could hide it (Assumed.held_near)."""
    folder, _, _ = soft
    moved_m = np.array([80e-6, -60e-6, 50e-6])
    change = all_at_once(tool(moved_m), device(np.array([1e-3, 2e-3, -1e-3]), np.array([1e-3, 0.0, 2e-3])))
    found = asked(folder, pair.later("tool", change))
    assert [(f["where"], f["physics"]) for f in found["findings"]] == [("tool.point", "tool-moved")]
    by, sigma = ([c[k] for c in found["changed"]] for k in ("by", "sigma"))
    assert np.all(np.abs(by - moved_m) < 3.0 * np.array(sigma))
    assert max(sigma) < 5e-6


def test_a_joint_that_has_become_softer_is_named_with_its_size(soft, tmp_path):
    folder, model, before = soft
    _, unseen, case, _ = written_halves(tmp_path, **wanted(6.0))
    after = case.hidden[0].defect
    found = asked(folder, later(folder, "softer", unseen))
    (changed,) = found["changed"]
    (effect,) = model["effects"]
    assert changed["parameter"] == f"{effect['name']}.compliance_rad_nm"
    truth = after.compliance_rad_nm - before.compliance_rad_nm
    assert changed["by"] == pytest.approx(truth, abs=4.0 * changed["sigma"])
    assert changed["known"] == effect["parameters"]["compliance_rad_nm"]["value"]


# Daily: beside a later recording.
@pytest.mark.parametrize("moved_rad", [pytest.param(None, marks=pytest.mark.endure), MOVED_RAD])
def test_poses_that_tell_rivals_apart_are_chosen_with_a_model(soft, moved_rad):
    """On its own recording, and on a later one: what the model holds is there at new poses, too."""
    folder, _, _ = soft
    name = "recording" if moved_rad is None else "moved-for-poses"
    source = read(later(folder, name, folder / "unseen.csv", moved_rad) if moved_rad else folder / name)
    session = session_of(source.rig, source.samples)
    state = known_before(read_model(folder / "model.json"), source.samples).begin(session)
    physics = "joint-zero-moved" if moved_rad else "backlash"
    state = best_of(state, physics, f"joint{JOINT}.angle")
    offered = reachable(state, np.random.default_rng(1), 60)
    there = at_new_poses(state, offered)
    assert len(there.brought) == len(state.brought) == 1
    carried, _ = there.added(there.brought[0])
    assert np.max(np.abs(carried)) > 0.0
    if not moved_rad:  # beside a later recording it is known as the file states it, at no other rows
        as_fitted, _ = there.added(state.brought[0])
        np.testing.assert_allclose(carried, as_fitted, atol=1e-6 * np.max(np.abs(carried)))
    rival = next(r for r in rivals_of(state) if there.carried(r) is not None)
    found = duel(there, 0, rival)
    assert reach_of(found) > 0.0
    assert np.all(np.diff(next_poses([found], 10).separation) >= 0.0)


def best_of(state, physics, where):
    """The state with the best term of a name, its drivers at its own values, as a diagnosis hands it over."""
    bench = Bench(state)
    gain = bench.scores.gain
    terms = [bench.menu.terms[entry.term] for entry in bench.menu.entries]
    mine = [e for e, term in enumerate(terms) if (term.physics, term.port.where) == (physics, where)]
    best = max(mine, key=lambda e: gain[e])
    return state.refitted([refined(bench, terms[best], bench.menu.entries[best].inner)]).renewed()


def rivals_of(state):
    """Of another place or physics, the nearest first."""
    bench, own = Bench(state), state.accepted[0].term
    for entry in np.argsort(-scores(bench.menu, bench.gone[0]).gain):
        term = bench.menu.terms[bench.menu.entries[entry].term]
        if (term.physics, term.port.where) != (own.physics, own.port.where):
            yield rival_named(state, 0, named(term))


def test_a_known_structure_is_refitted_to_another_recording(soft, capsys):
    folder, model, defect = soft
    recording, out = later(folder, "refit", folder / "unseen.csv"), folder / "refit.json"
    assert run(["identify", str(recording), "--model", str(folder / "model.json"), "--out", str(out)]) == 0
    assert "1 effect refitted" in capsys.readouterr().out
    refitted = json.loads(out.read_text())
    assert refitted["schema"] == 2
    assert refitted["readings_sha256"] != model["readings_sha256"]
    (effect,) = refitted["effects"]
    size = effect["parameters"]["compliance_rad_nm"]
    assert effect["name"] == model["effects"][0]["name"]
    assert size["value"] == pytest.approx(defect.compliance_rad_nm, abs=4.0 * size["sigma"])
    predicted = folder / "refit.csv"
    assert run(["predict", str(out), str(recording / "samples.csv"), "--out", str(predicted)]) == 0


def test_a_plan_next_to_a_known_structure_is_refused(soft, tmp_path, capsys):
    folder, _, _ = soft
    (tmp_path / "fit.toml").write_text("schema = 1\n")
    arguments = ["identify", str(folder / "recording"), "--model", str(folder / "model.json")]
    assert run([*arguments, "--plan", str(tmp_path / "fit.toml"), "--out", str(tmp_path / "m.json")]) == 1
    assert "without --plan" in " ".join(capsys.readouterr().err.split())


def test_a_model_without_covariance_cannot_tell_what_has_changed(soft, capsys):
    folder, model, _ = soft
    bare = folder / "bare.json"
    bare.write_text(json.dumps(model | {"covariance": None}))
    recording = later(folder, "asked-of-bare", folder / "unseen.csv")
    assert run(["diagnose", str(recording), "--model", str(bare), "--out", str(folder / "none.json")]) == 1
    assert "no covariance" in " ".join(capsys.readouterr().err.split())
