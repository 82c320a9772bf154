"""A file that today's version has written is read by every later one, and says the same."""

import json
import shutil

import pytest

from calibeam.cli import run

from . import answers
from .agreement import column_differences
from .program import columns, run_program, write_session

FOLDERS = {
    "spots": answers.SESSIONS / "spots-backlash",
    "position": answers.SESSIONS / "tracker-heated-link",
    "full-pose": answers.SESSIONS / "pose-worn-bearing",
    "wire": answers.SESSIONS / "wire-drum",
    "seats-and-bars": answers.SESSIONS / "cones-oval-ring",
    "spots-and-bar": answers.SESSIONS / "spots-and-bar-gear-ratio",
    "guided": answers.FORMATS / "guided",
}


@pytest.mark.parametrize("name", FOLDERS)
def test_a_session_folder_goes_into_a_recording_and_out_again(tmp_path, name):
    again = answers.round_trip(FOLDERS[name], tmp_path)
    assert (again / "rig.toml").read_bytes() == (FOLDERS[name] / "rig.toml").read_bytes()
    assert columns(again / "samples.csv") == columns(FOLDERS[name] / "samples.csv")


def test_a_rig_with_devices_and_session_keys_is_read_and_kept_to_the_letter(tmp_path):
    table = (answers.DATA / "zeros" / "00.csv").read_text(encoding="utf-8").splitlines()
    session = write_session(tmp_path / "made", answers.FORMATS / "ur.toml", table)
    again = answers.round_trip(session, tmp_path)
    assert (again / "rig.toml").read_bytes() == (answers.FORMATS / "ur.toml").read_bytes()


def test_samples_as_parquet_are_those_of_the_csv(tmp_path):
    again = answers.round_trip(answers.FORMATS / "columns", tmp_path)
    assert columns(again / "samples.csv") == columns(answers.FORMATS / "tracker" / "samples.csv")


def test_the_demo_recording_holds_the_samples_that_were_taken(frozen, tmp_path):
    assert answers.exported_demo(tmp_path) == frozen("formats")["demo"]


def test_a_recording_with_streams_frames_and_events_is_read_whole(frozen, tmp_path):
    assert answers.streams(tmp_path) == frozen("formats")["streams"]


@pytest.mark.parametrize("name", answers.PREDICTED)
def test_a_model_of_schema_1_predicts_as_frozen(frozen, tmp_path, name):
    """Columns that a later version adds, such as a sigma, take nothing away from who reads by name."""
    expected = frozen("predicted")[name]
    now = {column: values for column, values in answers.prediction(name, tmp_path).items() if column in expected}
    assert column_differences(now, expected) == []


@pytest.mark.usefixtures("bare_figures")
def test_model_and_diagnosis_of_schema_1_go_into_a_report(tmp_path):
    files = ("--model", answers.MODELS / "wire.json", "--diagnosis", answers.FORMATS / "diagnosis.json")
    page = tmp_path / "report.html"
    run_program("report", answers.recording("wire-gear"), *files, "--out", page)
    text = page.read_text(encoding="utf-8")
    [finding] = json.loads((answers.FORMATS / "diagnosis.json").read_text(encoding="utf-8"))["findings"]
    assert finding["where"] in text
    assert finding["physics"] in text


@pytest.mark.usefixtures("bare_figures")
def test_an_earlier_result_of_schema_1_is_compared_with(tmp_path):
    earlier, page = tmp_path / "earlier", tmp_path / "report.html"
    earlier.mkdir()
    shutil.copy(answers.MODELS / "wire.json", earlier / "model.json")
    shutil.copy(answers.FORMATS / "diagnosis.json", earlier)
    now = ("--model", answers.MODELS / "wire.json", "--json")
    printed = run_program("report", answers.recording("wire-gear"), *now, "--against", earlier, "--out", page)
    assert json.loads(printed)["drift"]


def test_a_pose_plan_is_accepted_by_a_session_and_a_wrong_one_is_not(tmp_path, capsys):
    """No device is where this rig looks for it: what is wrong with a plan is told before, the devices after."""
    for name in ("ur.toml", "next.toml", "encoders.dbc", "psd1.json"):
        shutil.copy(answers.FORMATS / name, tmp_path)
    session = ["session", str(tmp_path / "ur.toml"), "--out", str(tmp_path / "made"), "--yes", "--plan"]
    assert run([*session, str(tmp_path / "next.toml")]) == 1
    assert "away/psd: does not exist" in " ".join(capsys.readouterr().err.split())
    wrong = tmp_path / "wrong.toml"
    wrong.write_text((tmp_path / "next.toml").read_text().replace("approach", "aproach"))
    assert run([*session, str(wrong)]) == 1
    assert "wrong.toml line 9: unknown key 'aproach'" in " ".join(capsys.readouterr().err.split())
