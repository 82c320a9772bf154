"""The verdict of `check` beside what it could not examine: no "no errors" where something expected is left."""

import json
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import Channel, Finding, RecordingWriter
from acquisition.recording.check_recording import Problem
from acquisition.recording.examination import Examination
from acquisition.recording.rig import rig_text
from calibeam.cli import run
from calibeam.results.check_examinations import CHECK_EXAMINATIONS, verdict_lines

RIG = Path(__file__).parents[2] / "rigs" / "encoders.toml"
ROWS, RATE_HZ = 2000, 100.0
LAG, SLIPS = Examination("following error", (), "record set-points"), Examination("slips", (), "record ten stands")
FOUND, NOTHING = LAG.found("joint 1 is late"), LAG.nothing(1e-5, "s")
LEFT, OUT_OF_PLACE = SLIPS.not_examined("too few stands"), SLIPS.not_examined("no encoders", expected=False)
LEFT_LINE = "not examined: slips: too few stands; record ten stands"
ERROR = Finding(Problem.GAP, "stream psd", "3 samples missing")


class Standing:
    def now_s(self) -> float:
        return 1000.0


@pytest.mark.parametrize(
    ("findings", "records", "lines"),
    [
        ((), (NOTHING,), ["no errors"]),
        ((), (NOTHING, FOUND), ["no errors; see above what was found"]),
        ((), (NOTHING, LEFT), [LEFT_LINE, "nothing wrong in what was examined: following error"]),
        ((), (LEFT,), [LEFT_LINE, "nothing was examined: the reasons are above"]),
        ((ERROR,), (NOTHING, LEFT), [LEFT_LINE, "not fit for use: errors above"]),
        ((), (NOTHING, OUT_OF_PLACE), ["not examined: slips: no encoders; record ten stands", "no errors"]),
    ],
)
def test_the_verdict_is_no_more_than_what_was_examined(findings, records, lines):
    assert list(verdict_lines(findings, records)) == lines


@pytest.fixture
def log(tmp_path):
    """A log of three encoders on one shaft that turns to and fro; `value`: what each reading is replaced by."""

    def made(rows=ROWS, value=None, slip_rad=0.0, disc_rad=0.0):
        rng, time_s = np.random.default_rng(1), 1000.0 + np.arange(rows) / RATE_HZ
        angle = 4.0 * np.sin(0.5 * time_s)[:, None] + np.arange(3) + rng.normal(0.0, 6e-6, (rows, 3))
        angle[rows // 2 :, 1] += slip_rad
        angle[:, 1] += disc_rad * np.cos(angle[:, 0])
        angle = angle if value is None else np.full_like(angle, value)
        path = tmp_path / "log.mcap"
        notes = {"segment": "1"}
        with RecordingWriter(path, rig_text=rig_text(RIG), software="t", clock=Standing(), notes=notes) as writer:
            stream = writer.stream("encoders", (Channel("position_rad", "rad", (3,)),))
            if rows:
                stream.append(time_s, time_s, np.arange(rows), {"position_rad": angle})
        return path

    return made


def checked(path, capsys, code=0):
    """What is printed, and the endings by name and place."""
    assert run(["check", str(path)]) == code
    shown = capsys.readouterr().out
    assert run(["check", str(path), "--json"]) == code
    said = json.loads(capsys.readouterr().out)["examinations"]
    assert {one["what"] for one in said} == {one.what for one in CHECK_EXAMINATIONS}
    return shown, {(one["what"], one["where"]): one for one in said}


PAIR = "encoders against each other", "encoder 2"


def test_a_whole_log_has_no_errors_and_states_the_eccentricity_that_it_would_show(log, capsys):
    shown, said = checked(log(), capsys)
    assert shown.rstrip().endswith("no errors")
    assert said[PAIR]["outcome"] == "nothing found"
    assert 0.0 < said[PAIR]["limit"] < 1e-5


@pytest.mark.parametrize(("fault", "says"), [({"slip_rad": 1e-3}, "slip of 99"), ({"disc_rad": 1e-4}, "once a turn")])
def test_what_is_found_between_two_encoders_is_no_ending_without_a_finding(log, capsys, fault, says):
    shown, said = checked(log(**fault), capsys)
    assert said[PAIR]["outcome"] == "found"
    assert says in said[PAIR]["says"]
    assert said["encoders against each other", "encoder 3"]["outcome"] == "nothing found"
    assert "no errors; see above what was found" in shown


def test_a_short_log_is_not_without_errors(log, capsys):
    shown, said = checked(log(rows=300), capsys)
    assert said[PAIR]["outcome"] == "not examined"
    assert "not examined: encoders against each other (encoder 2, encoder 3): fewer than 800 rows" in shown
    assert "record all encoders of a shaft while it turns" in shown
    assert "nothing wrong in what was examined: gaps and order of the streams" in shown
    assert "no errors" not in shown


@pytest.mark.parametrize("value", [np.nan, 1.0])
def test_encoders_that_show_nothing_are_not_without_errors(log, capsys, value):
    shown, said = checked(log(value=value), capsys)
    assert said[("readings of the encoders", "stream encoders")]["outcome"] == "not examined"
    assert "not examined: readings of the encoders (stream encoders)" in shown
    assert "no errors" not in shown


def test_a_stream_that_was_declared_and_never_came_is_an_error_and_no_traceback(log, capsys):
    shown, said = checked(log(rows=0), capsys, code=1)
    assert "silent: stream encoders: declared, but not one sample came" in shown
    assert "not fit for use" in shown
    assert said[("readings of the encoders", "stream encoders")]["reason"] == "not one valid reading came"
