"""`calibeam session` of a measuring arm: what is refused before any encoder is opened."""

from pathlib import Path

import msgspec
import pytest

from acquisition.recording.rig import load_rig
from acquisition.recording.rig.devices import Devices
from calibeam.cli import run
from calibeam.guided.recorded import is_guided

RIG_FILE = Path(__file__).parents[3] / "rigs" / "arm-cmm-reference.toml"
TEXT = RIG_FILE.read_text()


def edited(folder: Path, old: str, new: str) -> Path:
    assert old in TEXT
    path = folder / "rig.toml"
    path.write_text(TEXT.replace(old, new))
    return path


def test_a_rig_of_encoders_and_artefacts_is_guided_and_no_other() -> None:
    rig = load_rig(RIG_FILE)
    assert is_guided(rig)
    assert not is_guided(msgspec.structs.replace(rig, devices=Devices()))
    assert not is_guided(msgspec.structs.replace(rig, seat_list=(), bar_position_list=(), sphere_list=()))
    assert not is_guided(load_rig(RIG_FILE.with_name("ur5e-dual-psd.toml")))


def test_without_a_bar_the_session_is_refused_and_leaves_nothing(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    head, rest = TEXT.split("[[bar_position]]", 1)
    rig = tmp_path / "rig.toml"
    rig.write_text(head + rest[rest.index("[[sphere]]") :])
    assert run(["session", str(rig), "--out", str(tmp_path / "out")]) == 1
    assert "cones alone show no length" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_plan_is_not_for_verifying_and_a_robot_is_not_verified(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    out = ["--verify", "--out", str(tmp_path / "out")]
    assert run(["session", str(RIG_FILE), "--plan", "plan.toml", *out]) == 1
    assert "give one of them" in " ".join(capsys.readouterr().err.split())
    assert run(["session", str(RIG_FILE.with_name("ur5e-dual-psd.toml")), *out]) == 1
    assert "--verify is of a measuring arm" in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("file", "options"),
    [
        (RIG_FILE.name, ["--live-port", "0"]),
        (RIG_FILE.name, ["--continue", "--yes", "--accuracy-um", "5"]),
        ("ur5e-dual-psd.toml", ["--postures", "10", "--lengths", "2"]),
    ],
)
def test_what_would_be_ignored_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture, file: str, options: list[str]
) -> None:
    assert run(["session", str(RIG_FILE.with_name(file)), "--out", str(tmp_path / "out"), *options]) == 1
    said = " ".join(capsys.readouterr().err.split())
    named = ["--live"] if "--live-port" in options else [word for word in options if word.startswith("--")]
    assert all(word in said for word in [*named, "leave these options out"])
    assert not (tmp_path / "out").exists()


def test_an_adapter_that_is_not_there_is_named_and_no_recording_is_left(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    rig = edited(tmp_path, "out/emulated/arm-cmm-can", str(tmp_path / "no-adapter"))
    assert run(["session", str(rig), "--out", str(tmp_path / "out")]) == 1
    assert "encoders" in capsys.readouterr().err
    assert not (tmp_path / "out" / "recording.mcap").exists()
