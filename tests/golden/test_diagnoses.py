"""Twelve concealed sessions of every instrument: what is found in them, where, and how large."""

import json

import pytest

from . import answers
from .agreement import finding_differences, findings

# Of cones, 6-D targets and wires one session each, and one of spots in which nothing is hidden; the others are for
# `make endure`. Daily stand for them: for several instruments tests/calibrate/diagnose/test_mixed_sessions.py, for a
# tracker tests/calibrate/diagnose/test_from_recording.py.
DAILY = {
    "cones-oval-ring",
    "pose-worn-bearing",
    "spots-nothing",
    "wire-gear",
}
SESSIONS = sorted(path.name for path in answers.SESSIONS.iterdir())


def marked(name):
    return pytest.param(name, marks=() if name in DAILY else pytest.mark.endure)


@pytest.mark.parametrize("name", [marked(name) for name in SESSIONS])
def test_the_findings_are_as_frozen_and_no_key_of_the_file_is_lost(frozen, tmp_path, name):
    now = answers.diagnosis(name, tmp_path)
    assert finding_differences(findings(now), frozen("diagnoses")[name]) == []
    before = json.loads((answers.FORMATS / "diagnosis.json").read_text(encoding="utf-8"))
    assert before.keys() - now.keys() == set()
    for finding in now["findings"]:
        assert before["findings"][0].keys() - finding.keys() == set()


@pytest.mark.parametrize("name", SESSIONS)
def test_what_is_frozen_is_what_was_hidden(frozen, name):
    """So that nobody freezes a wrong finding: physics and place of the sealed truth, and of no other."""
    hidden = json.loads((answers.DATA / "truths" / f"{name}.json").read_text(encoding="utf-8"))["defects"]
    found = frozen("diagnoses")[name]["findings"]
    assert {(one["physics"], one["where"]) for one in found} == {(one["physics"], one["port"]) for one in hidden}
