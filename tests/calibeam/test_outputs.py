"""No result is written over a measurement, an input of the same command, or a result of another kind."""

import errno
import os
import shutil
import stat

import msgspec
import pytest

from acquisition.recording.output import OutputError, command_files, text_output, write_output
from calibeam.cli import run
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

PROGRAM = "DEF part()\nPTP {A1 0, A2 -90, A3 90, A4 0, A5 0, A6 0}\nEND\n"
POSES = "x_m,y_m,z_m,rx_rad,ry_rad,rz_rad\n0.3,0.1,0.4,0,0,0\n"
PAGE = "<!doctype html><html><head><title>notes of the shift</title></head></html>\n"
PLAN = 'schema = 1\nrig = "other"\n[[block]]\n'


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A session as a folder and as a recording, its model, and files of other people."""
    at = tmp_path_factory.mktemp("outputs")
    write_case(conceal(Wanted("tracker", 5, samples=60)), at / "drawn")
    shutil.copytree(at / "drawn" / "recording", at / "session")
    shutil.rmtree(at / "drawn")
    assert run(["import", str(at / "session"), "--out", str(at / "r.mcap")]) == 0
    assert run(["identify", str(at / "r.mcap"), "--out", str(at / "model.json")]) == 0
    (at / "diagnosis.json").write_text('{"schema": 1, "kind": "calibeam-diagnosis"}\n')
    for name, text in (("part.src", PROGRAM), ("poses.csv", POSES), ("notes.html", PAGE), ("hand.toml", PLAN)):
        (at / name).write_text(text)
    (at / "arm.urdf").write_text("<robot name='the maker's own'/>\n")
    return at


CALLS = [
    "identify r.mcap --out r.mcap",
    "identify session --out session/samples.csv",
    "identify session --out session/rig.toml",
    "identify r.mcap --out diagnosis.json",
    "identify r.mcap --model model.json --out model.json",
    "report r.mcap --out r.mcap",
    "report r.mcap --model model.json --out model.json",
    "report r.mcap --out notes.html",
    "diagnose r.mcap --out r.mcap",
    "diagnose r.mcap --out model.json",
    "diagnose r.mcap --out d.json --model-out r.mcap",
    "diagnose r.mcap --out d.json --report r.mcap",
    "diagnose r.mcap --out d.json --plan-out session/rig.toml",
    "design session/rig.toml --out session/rig.toml",
    "design session/rig.toml --out hand.toml",
    "design session/rig.toml --out p.toml --report notes.html",
    "export-model model.json --to urdf --out model.json",
    "export-model model.json --to urdf --out arm.urdf",
    "predict model.json session/samples.csv --out session/samples.csv",
    "predict model.json session/samples.csv --out model.json",
    "predict model.json r.mcap --out poses.csv",
    "compare session r.mcap --out r.mcap",
    "compare session r.mcap --out session/samples.csv",
    "correct model.json poses.csv --out poses.csv",
    "correct model.json poses.csv --out model.json",
    "correct model.json part.src --out part.src",
    "iso9283 plan session/rig.toml --out session/rig.toml",
    "iso9283 evaluate r.mcap --out r.mcap",
    "iso9283 evaluate r.mcap --out model.json",
    "verify r.mcap --model model.json --out model.json",
    "verify r.mcap --model model.json --out v.json --report r.mcap",
    "tool-axes r.mcap --out r.mcap",
    "replay r.mcap --model model.json --out r.mcap",
    "recover r.mcap --out r.mcap",
    "rig new --from ur5e --out session/rig.toml",
    "emulate session/rig.toml --truth session/rig.toml",
    "import session --out r.mcap",
    "export r.mcap --out session",
]


def state(folder):
    return {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.mark.parametrize("call", CALLS)
def test_no_call_destroys_an_input_or_a_result_of_another_kind(call, made, monkeypatch):
    monkeypatch.chdir(made)
    before = state(made)
    assert run(call.split()) == 1
    assert state(made) == before


@pytest.mark.parametrize(
    "call", ["identify r.mcap --out r.mcap", "identify r.mcap --model model.json --out model.json"]
)
def test_force_does_not_reach_recordings_and_inputs(call, made, monkeypatch, capsys):
    monkeypatch.chdir(made)
    before = state(made)
    assert run([*call.split(), "--force"]) == 1
    assert state(made) == before


def test_an_older_result_of_the_same_kind_is_replaced_and_another_one_with_force(made, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    again = ["identify", str(made / "r.mcap"), "--out", "model.json"]
    assert (run(again), run(again)) == (0, 0)
    (tmp_path / "model.json").write_text('{"mine": 1}')
    assert run(again) == 1
    refused = capsys.readouterr().err
    assert "model.json" in refused
    assert "--force" in refused
    assert run([*again, "--force"]) == 0
    assert msgspec.json.decode((tmp_path / "model.json").read_bytes())["kind"] == "calibeam-model"


@pytest.mark.usefixtures("bare_figures")
def test_every_kind_of_result_takes_the_place_of_its_older_self(made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    calls = [
        f"report {made}/r.mcap --model {made}/model.json",
        f"predict {made}/model.json {made}/r.mcap",
        f"export-model {made}/model.json --to urdf --out a.urdf",
        f"export-model {made}/model.json --to table --out a.csv",
        f"export-model {made}/model.json --to json --out a.json",
        f"iso9283 plan {made}/session/rig.toml",
    ]
    for call in calls:
        assert (run(call.split()), run(call.split())) == (0, 0), call


TEXT = text_output("ours", "text")


def test_a_full_disk_leaves_the_older_file_and_nothing_next_to_it(tmp_path, monkeypatch):
    path = write_output(tmp_path / "a.txt", "ours 1", TEXT)

    def full(descriptor):
        raise OSError(errno.ENOSPC, "no space left")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="no space left") as error:
        write_output(path, "ours 2", TEXT)
    assert error.value.filename == str(path)
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("a.txt", "ours 1")]


def test_links_and_devices_are_refused(tmp_path):
    target = write_output(tmp_path / "a.txt", "ours 1", TEXT)
    (tmp_path / "b.txt").symlink_to(target)
    (tmp_path / "gone.txt").symlink_to(tmp_path / "nowhere")
    os.mkfifo(tmp_path / "pipe")
    for name in ("b.txt", "gone.txt", "pipe"):
        with pytest.raises(OutputError, match=name):
            write_output(tmp_path / name, "ours 2", TEXT)
    assert target.read_text() == "ours 1"
    assert not (tmp_path / "nowhere").exists()


def test_an_input_is_known_under_another_name_of_it(tmp_path):
    source = write_output(tmp_path / "a.txt", "ours 1", TEXT)
    os.link(source, tmp_path / "b.txt")
    with command_files([source], force=True), pytest.raises(OutputError, match=r"b\.txt"):
        write_output(tmp_path / "b.txt", "ours 2", TEXT)


def test_names_of_unfinished_files_differ_and_rights_stay(tmp_path, monkeypatch):
    path = write_output(tmp_path / "a.txt", "ours 1", TEXT)
    path.chmod(0o640)
    names = []
    replace = os.replace

    def noted(source, target):
        names.append(os.fspath(source))
        replace(source, target)

    monkeypatch.setattr(os, "replace", noted)
    monkeypatch.setattr("pathlib.Path.replace", lambda self, target: noted(self, target))
    for text in ("ours 2", "ours 3"):
        write_output(path, text, TEXT)
    assert len(set(names)) == 2
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
