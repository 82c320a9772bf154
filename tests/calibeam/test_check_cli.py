"""`calibeam check`: one line a device, what is wrong and what to do, and an exit code."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from acquisition.recording.rig import plain_rig, rig_text
from calibeam.cli import run
from simulators.process import Emulators

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Iterator[tuple[Path, Emulators]]:
    """A rig file whose devices are there: emulated, on links of their own."""
    folder = tmp_path_factory.mktemp("site")
    text = rig_text(RIG).replace("out/emulated/", f"{folder}/")
    with Emulators(plain_rig(text, "rig.toml")) as emulators:
        path = folder / "rig.toml"
        path.write_text(text.replace('"127.0.0.2"', f'"{emulators.address["robot"]["host"]}"'))
        yield path, emulators


def checked(path: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, dict]]:
    code = run(["check", str(path), "--json"])
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    return code, {line["device"]: line for line in found}


def test_a_good_site(site, capsys) -> None:
    path, emulators = site
    emulators.clear()
    code, found = checked(path, capsys)
    assert code == 0
    assert list(found) == ["psd", "encoders", "robot"]
    assert {line["wrong"] for line in found.values()} == {""}
    assert found["psd"]["firmware"] == "1.0.0"
    assert "CB-0001" in found["psd"]["what"]
    assert found["psd"]["rate_hz"] == pytest.approx(1000.0, rel=0.01)
    assert found["robot"]["what"] == "UR5 20195000001"
    assert found["robot"]["rate_hz"] == pytest.approx(500.0, rel=0.01)
    assert "6 encoders" in found["encoders"]["what"]


def test_what_is_wrong_is_named_with_its_remedy(site, capsys) -> None:
    path, emulators = site
    emulators.inject("psd", "silence")
    emulators.ask("encoders.silence", node=3)
    emulators.ask("robot.protective_stop")
    code, found = checked(path, capsys)
    emulators.clear()
    emulators.ask("encoders.silence", node=3, on=False)
    emulators.ask("robot.unlock")
    assert code == 1
    assert "check power, cable" in found["psd"]["wrong"]
    assert "node 3" in found["encoders"]["wrong"]
    assert "safety is PROTECTIVE_STOP: clear the cause and unlock on the pendant" in found["robot"]["wrong"]


def test_an_encoder_whose_emergency_is_older_than_the_check(site, capsys) -> None:
    path, emulators = site
    emulators.ask("encoders.emergency", node=4, code=0x7320)
    code, found = checked(path, capsys)
    emulators.ask("encoders.emergency", node=4, code=0)
    assert code == 1
    assert "node 4 is at fault, error register 21h" in found["encoders"]["wrong"]


def test_a_device_that_is_not_there(site, tmp_path, capsys) -> None:
    path, _ = site
    wrong = tmp_path / "rig.toml"
    wrong.write_text(path.read_text().replace("/psd", "/nowhere"))
    assert run(["check", str(wrong)]) == 1
    out, err = capsys.readouterr()
    assert "psd       error" in out
    assert "does not exist; check the cable" in out
    assert "robot     ok" in out
    assert "psd: not fit for a session" in " ".join(err.split())


def test_joints_outside_their_range_are_another_arm(site, tmp_path, capsys) -> None:
    path, _ = site
    wrong = tmp_path / "rig.toml"
    text = path.read_text().replace("lower_rad = -3.1416", "lower_rad = 1.7", 1)
    wrong.write_text(text.replace("home_rad = [0.3, -1.4, 1.6,", "home_rad = [0.3, -1.4, 1.8,"))
    code, found = checked(wrong, capsys)
    assert code == 1
    assert "joint 3 reads 1.6" in found["robot"]["wrong"]


def test_a_recording_is_checked_by_the_same_command(capsys) -> None:
    assert run(["check", "no-such.mcap"]) == 1
    assert "no-such.mcap" in " ".join(capsys.readouterr().err.split())


def test_help_has_examples(capsys) -> None:
    assert run(["check", "--help"]) == 0
    assert "For example: calibeam check" in " ".join(capsys.readouterr().out.split())
