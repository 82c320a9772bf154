"""A stage that fails loses nothing of what was known before it, and no verdict rests on what was not looked at."""

import json
from dataclasses import replace

import numpy as np
import pytest

from acquisition.recording import read
from calibeam.results.diagnosis import diagnose_to_file
from calibrate.diagnose import from_recording
from calibrate.diagnose.assess import assessment
from calibrate.diagnose.assess.diagnosis import Verdict
from calibrate.diagnose.diagnose import diagnose
from calibrate.diagnose.search.bench import Bench, recent_menu
from calibrate.diagnose.search.port_process import processes
from calibrate.diagnose.search.score import Removed
from calibrate.diagnose.search.search import search
from calibrate.diagnose.stages import NOT_YET, Stage, Stages
from calibrate.errors import DataError
from tests.calibrate.diagnose.drawn_rigs import drawn

SMALL = 4  # a drawn session with nothing in it that a diagnosis ends in a second


def broken(*_args, **_kwargs):
    raise np.linalg.LinAlgError("singular matrix")


def effect(world, rng):
    return world.session(rng, [(world.at_joint(2, lambda d: np.sin(d.q_rad[:, 1] + 0.4)), 2.0)])


def test_what_fails_is_kept_with_its_stage_and_the_place_in_the_program():
    stages = Stages()
    assert stages.attempt(Stage.FLOORS, lambda: 3, 4) == 3
    assert stages.attempt(Stage.PROOFS, broken, 4) == 4
    assert not stages.undecided
    assert stages.attempt(Stage.SEARCH, broken, None) is None
    assert stages.undecided
    assert [one.stage for one in stages.failed] == [Stage.PROOFS, Stage.SEARCH]
    assert "LinAlgError: singular matrix (test_stages.py, line" in stages.failed[0].reason
    later = stages.not_yet(Stage.FLOORS)[2:]
    assert {one.reason for one in later} == {NOT_YET}
    assert later[0].stage is Stage.REJECTED


def test_a_stage_that_refuses_says_what_is_wrong_with_the_data():
    def refused():
        raise DataError("too few poses")

    stages = Stages()
    with pytest.raises(DataError, match="too few"):
        stages.attempt(Stage.GEOMETRY, refused, None, refuses=True)
    assert stages.attempt(Stage.GEOMETRY, broken, None, refuses=True) is None


def test_causes_are_known_before_sizes_and_stay_when_everything_after_them_fails(world, monkeypatch):
    names = ("rivals_of", "unrecorded", "lack_of_fit", "findings_of")
    for name in names:
        monkeypatch.setattr(assessment, name, broken)
    monkeypatch.setattr("calibrate.diagnose.diagnose.proofs", broken)
    rng, early = np.random.default_rng(3), []
    said = diagnose(effect(world, rng), rng, known=early.append)
    assert said.verdict is Verdict.MISMATCH
    assert [(f.name.where, f.name.physics) for f in said.findings] == [("joint2.angle", "encoder-eccentricity")]
    assert [f.parameters for f in said.findings] == [{}]
    assert said.findings[0].confidence <= 0.5
    failed = {one.stage for one in said.incomplete}
    assert failed == {Stage.ALTERNATIVES, Stage.SCATTER, Stage.REPEATS, Stage.SIZES, Stage.PROOFS}
    assert [f.name for f in early[0].findings] == [f.name for f in said.findings]
    assert {one.reason for one in early[0].incomplete} == {NOT_YET}


def test_causes_stay_when_the_last_refit_fails(world, monkeypatch):
    monkeypatch.setattr("tests.calibrate.diagnose.conftest.LinearSession.renewed", broken)
    rng = np.random.default_rng(3)
    said = diagnose(effect(world, rng), rng)
    assert [(f.name.where, f.name.physics) for f in said.findings] == [("joint2.angle", "encoder-eccentricity")]
    assert [one.stage for one in said.incomplete] == [Stage.ALTERNATIVES]
    assert recent_menu.cache_info().currsize == 0  # nothing of a session outlives its diagnosis


def test_a_session_that_could_not_be_searched_is_not_consistent(world, monkeypatch):
    monkeypatch.setattr(assessment, "search", broken)
    rng = np.random.default_rng(4)
    said = diagnose(world.session(rng), rng)
    assert said.verdict is Verdict.UNDECIDABLE
    assert Stage.SEARCH in {one.stage for one in said.incomplete}


@pytest.mark.parametrize(
    ("name", "stage"), [("free_space_change", "tool error over the workspace"), ("begin", "geometry")]
)
def test_the_file_names_the_stage(tmp_path, monkeypatch, name, stage):
    out, session = tmp_path / "diagnosis.json", read(drawn(SMALL, 40).write(tmp_path / "session"))
    if name == "begin":
        monkeypatch.setattr(from_recording, "session_of", broken)
        with pytest.raises(DataError, match="geometry: LinAlgError"):
            diagnose_to_file(session, out)
    else:
        monkeypatch.setattr(from_recording, name, broken)
        diagnose_to_file(session, out)
    said = json.loads(out.read_text(encoding="utf-8"))
    assert [one["stage"] for one in said["incomplete"]] == [stage]
    assert said["verdict"] == ("undecidable" if name == "begin" else "consistent")


def test_pairs_of_joints_of_an_arm_that_has_one_offer_nothing(world):
    rng = np.random.default_rng(5)
    found = search(effect(world, rng), rng)
    none = processes(Bench(found.state), (), 2)
    rows = len(found.bench.sight.residual)
    gone = Removed(np.zeros((rows, 2)), np.zeros(2), 2)
    assert none.best(found.bench.sight.residual, np.zeros(0, dtype=bool), gone) is None
    assert replace(none, rows=1).best(found.bench.sight.residual, np.zeros(0, dtype=bool)) is None
