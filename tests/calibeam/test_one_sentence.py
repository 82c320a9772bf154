"""What a file states wrongly ends as one sentence, never as a traceback."""

import re
import shutil
from datetime import UTC, datetime

import pytest

from acquisition.recording import Recording, RecordingError, check, read
from acquisition.recording.check_recording import Problem, Severity
from calibeam.cli import run
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drawn")
    write_case(conceal(Wanted("dual-psd", 5, samples=60)), folder)
    return folder / "recording"


def test_a_twist_of_thousands_of_turns_is_an_error_of_the_rig(drawn, tmp_path, capsys):
    folder = tmp_path / "session"
    shutil.copytree(drawn, folder)
    text = (folder / "rig.toml").read_text()
    (folder / "rig.toml").write_text(re.sub(r"alpha_rad = .*", "alpha_rad = 65536", text, count=3))
    assert run(["identify", str(folder), "--out", str(tmp_path / "m.json")]) == 1
    assert "rig" in capsys.readouterr().err


def test_a_start_that_is_no_time_is_named_with_its_file(drawn):
    source = read(drawn)
    fields = {name: getattr(source, name) for name in Recording.__dataclass_fields__}
    wrong = Recording(**{**fields, "started_utc": "yesterday \x1b[2J"})
    with pytest.raises(RecordingError, match=r"started_utc = 'yesterday .*is no time; write it as") as error:
        _ = wrong.started
    assert str(drawn) in str(error.value)
    assert source.started is None
    without_zone = Recording(**{**fields, "started_utc": "2026-11-24T08:30:00"})
    assert without_zone.started == datetime(2026, 11, 24, 8, 30, tzinfo=UTC)


def test_an_interrupted_recording_of_which_nothing_is_lost_is_a_warning(drawn):
    source = read(drawn)
    fields = {name: getattr(source, name) for name in Recording.__dataclass_fields__}
    severities = {
        damage: [
            f.severity
            for f in check(Recording(**{**fields, "complete": False, "damage": damage}))
            if f.problem is Problem.INCOMPLETE
        ]
        for damage in ((), ("a batch is lost",))
    }
    assert severities == {(): [Severity.WARNING], ("a batch is lost",): [Severity.ERROR]}


def test_too_little_memory_ends_in_one_sentence(drawn, monkeypatch, capsys):
    def full(path):
        raise MemoryError

    monkeypatch.setattr("calibeam.commands.check.read", full)
    assert run(["check", str(drawn)]) == 1
    assert "memory" in capsys.readouterr().err
