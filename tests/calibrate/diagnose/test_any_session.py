"""Whatever machine and session: a diagnosis ends in a verdict, or says in one sentence why there is none."""

import json

import pytest

from acquisition.recording import RecordingError, RigFileError, SamplesError, read
from calibeam.results.diagnosis import diagnose_to_file
from calibrate.diagnose.assess.diagnosis import Verdict
from calibrate.errors import DataError
from tests.calibrate.diagnose.drawn_rigs import drawn

# small and quick ones of the first ten, another in test_stages.py; the 300 are for `make endure`
DAILY, DAILY_ROWS = (2, 8), 40
ENDURING, ROWS = 300, 2000
PIECES = 30  # of the enduring ones, so that one that fails names its neighbourhood
LONGEST = 1500  # characters of a refusal: several faults of a file may stand in it
REFUSALS = (DataError, RecordingError, RigFileError, SamplesError)


def ended(seed, most_rows, folder):
    """How the diagnosis of a drawn session ended: its verdict, or "refused". AssertionError where neither is clear."""
    recording = drawn(seed, most_rows).write(folder / str(seed))
    out = folder / f"{seed}.json"
    refused = ""
    try:
        diagnose_to_file(read(recording), out)
    except REFUSALS as why:
        refused = str(why)
    if refused:
        assert "please report" not in refused, f"seed {seed}: {refused}"
        assert 20 < len(refused) < LONGEST, f"seed {seed}: {refused}"
        return "refused"
    said = json.loads(out.read_text(encoding="utf-8"))
    assert said["incomplete"] == [], f"seed {seed}"
    assert said["verdict"] in {verdict.value for verdict in Verdict}, f"seed {seed}"
    for finding in said["findings"]:
        others = [rival["confidence"] for rival in finding["rivals"]]
        assert finding["confidence"] + sum(others) <= 1.0 + 1e-9, f"seed {seed}: {finding['says']}"
    return said["verdict"]


@pytest.mark.parametrize("seed", DAILY)
def test_a_small_session_of_any_machine_ends_in_a_verdict_or_a_refusal(seed, tmp_path):
    ended(seed, DAILY_ROWS, tmp_path)


@pytest.mark.endure
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("piece", range(PIECES))
def test_a_session_of_any_machine_and_length_ends_in_a_verdict_or_a_refusal(piece, tmp_path):
    share = ENDURING // PIECES
    for seed in range(1000 + piece * share, 1000 + (piece + 1) * share):
        ended(seed, ROWS, tmp_path)
