"""The command line: exit codes, and one clear sentence for everything that is wrong with the user's world."""

import json
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console

from acquisition.recording import read
from calibeam.cli import EXTRAS, run
from calibeam.devices.recorder import new_recording
from calibeam.emulation import Emulation
from calibeam.outcome import PartialResult
from calibeam.results.session_results import write_session_results
from drivers.clock import SystemClock

ROOT = Path(__file__).parents[2]
RIG = ROOT / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture
def rig_with(tmp_path: Path) -> Callable[..., Path]:
    """The shipped rig with pieces of its text replaced."""

    def made(*pairs: tuple[str, str]) -> Path:
        text = RIG.read_text()
        for old, new in pairs:
            assert old in text
            text = text.replace(old, new, 1)
        path = tmp_path / "rig.toml"
        path.write_text(text)
        return path

    return made


@pytest.fixture
def session_of(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Callable[[Path], tuple[int, str]]:
    def ran(rig: Path) -> tuple[int, str]:
        code = run(["session", str(rig), "--out", str(tmp_path / "out")])
        return code, " ".join(capsys.readouterr().err.split())

    return ran


def test_help_is_good_and_an_unknown_command_is_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0
    said = capsys.readouterr().out
    assert "identify" in said
    assert "Run a whole session on emulated devices" in said
    assert run(["calibrateeverything"]) == 2


@pytest.mark.parametrize("command", ["demo", "session", "emulate", "check", "identify", "report", "export", "import"])
def test_every_command_has_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([command, "--help"]) == 0
    assert f"For example: calibeam {command}" in " ".join(capsys.readouterr().out.split())


def test_a_misspelt_key_names_line_and_nearest_key(rig_with, session_of) -> None:
    code, said = session_of(rig_with(("speed_rad_s =", "sped_rad_s =")))
    assert code == 1
    assert "rig.toml line" in said
    assert "speed_rad_s" in said


def test_a_wrong_unit_is_refused(rig_with, session_of) -> None:
    code, said = session_of(rig_with(("d_m = 0.1625", 'd_m = "9.3 deg"')))
    assert code == 1
    assert "d_m" in said


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("rate_hz = 1000.0", "rate_hz = 1500.5", "rate_hz 1500.5"),
        ("half_size_m = 0.010", "half_size_m = -1.0", "half_size_m"),
        ("home_rad =", "# home_rad =", "home_rad"),
    ],
)
def test_values_that_no_session_can_use_are_refused_before_a_device_is_touched(
    rig_with, session_of, old: str, new: str, named: str
) -> None:
    code, said = session_of(rig_with((old, new)))
    assert code == 1
    assert named in said


def test_a_session_that_could_not_begin_leaves_the_name_of_its_recording_free(rig_with, session_of, tmp_path) -> None:
    session_of(rig_with(("out/emulated/psd", "no/such/port")))
    assert not (tmp_path / "out" / "recording.mcap").exists()


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    assert run(["session", str(RIG), "--out", str(tmp_path / "file")]) == 1
    assert str(tmp_path / "file") in " ".join(capsys.readouterr().err.split())


def test_the_demo_does_not_take_away_the_recording_of_a_session(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "recording.mcap").write_bytes(b"an hour of work")
    assert run(["demo", "--out", str(tmp_path)]) == 1
    assert "choose another" in capsys.readouterr().err
    assert (tmp_path / "recording.mcap").read_bytes() == b"an hour of work"


@pytest.fixture
def unfinished(tmp_path: Path) -> Path:
    """A recording that is closed and holds no sample yet."""
    path = tmp_path / "recording.mcap"
    with new_recording(path, RIG.read_text(), SystemClock(), {}):
        pass
    return path


def test_a_recording_that_cannot_be_identified_is_a_partial_result(unfinished: Path) -> None:
    with pytest.raises(PartialResult, match=r"the recording is whole: .*recording\.mcap"):
        write_session_results(unfinished, Console(quiet=True))


def test_ctrl_c_while_identifying_says_that_the_recording_is_whole(
    unfinished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(recording: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("calibeam.results.session_results.identify_session", interrupted)
    with pytest.raises(PartialResult, match=r"^Ctrl-C; the recording is whole"):
        write_session_results(unfinished, Console(quiet=True))
    assert read(unfinished).complete


def test_ctrl_c_before_anything_is_recorded_fails_with_one_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(path: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("calibeam.commands.session.load_rig", interrupted)
    assert run(["session", str(RIG)]) == 1
    assert "stopped by Ctrl-C" in capsys.readouterr().err


def test_ctrl_c_while_connecting_leaves_a_readable_recording(tmp_path: Path) -> None:
    path = tmp_path / "recording.mcap"
    with pytest.raises(KeyboardInterrupt), new_recording(path, RIG.read_text(), SystemClock(), {}):
        raise KeyboardInterrupt
    assert not read(path).complete


def test_a_missing_port_is_named(rig_with, session_of) -> None:
    code, said = session_of(rig_with(("out/emulated/psd", "no/such/port")))
    assert code == 1
    assert "no/such/port" in said


def test_no_controller_at_the_address_is_named(rig_with, session_of) -> None:
    with Emulation(RIG, seed=1) as emulation:
        psd, can = emulation.address["psd"]["port"], emulation.address["can"]["channel"]
        changed = rig_with(
            ("out/emulated/psd", psd), ("out/emulated/can", can), ('host = "127.0.0.2"', 'host = "127.255.0.9"')
        )
        code, said = session_of(changed)
    assert code == 1
    assert "127.255.0.9" in said


def test_the_wrong_device_on_the_port_is_distinguished(rig_with, session_of) -> None:
    with Emulation(RIG, seed=1) as emulation:
        code, said = session_of(rig_with(("out/emulated/psd", emulation.address["can"]["channel"])))
    assert code == 1
    assert "not a PSD box" in said


def test_a_busy_port_is_named(rig_with, session_of) -> None:
    from drivers.psd_daq.device import BAUD
    from drivers.transports.serial_port import SerialAddress, open_serial

    with Emulation(RIG, seed=1) as emulation:
        port = emulation.address["psd"]["port"]
        line = open_serial(SerialAddress(port=port), BAUD)
        try:
            code, said = session_of(rig_with(("out/emulated/psd", port)))
        finally:
            line.close()
    assert code == 1
    assert port in said


def test_a_file_that_is_no_recording_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(b"not a recording")
    assert run(["identify", str(path)]) == 1
    assert "x.mcap" in capsys.readouterr().err


def test_a_missing_input_is_not_answered_with_another_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    missing = tmp_path / "points.csv"
    assert run(["psd-check", str(RIG), "--points", str(missing), "--no-wait"]) == 1
    said = capsys.readouterr().err
    assert str(missing) in said
    assert "check the path" in said
    assert "--out" not in said


WITHOUT = """
import importlib, json, sys
blocked = json.loads(sys.argv[1])
sys.modules.update(dict.fromkeys(blocked))
from calibeam.cli import run
from calibeam.command_list import COMMANDS
for place in COMMANDS.values():
    importlib.import_module("calibeam.commands." + place.partition(":")[0])
for place in ("acquisition.session.session", "calibeam.devices.recorder", "calibeam.live.outlets"):
    importlib.import_module(place)
sys.exit(run(sys.argv[2:]))
"""


def _without_extras(*arguments: str | Path) -> tuple[int, str]:
    """Exit code and standard error of a command line in a process that has no library of an extra."""
    command = [sys.executable, "-c", WITHOUT, json.dumps(sorted(EXTRAS)), *map(str, arguments)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60)
    return done.returncode, " ".join(done.stderr.split())


@pytest.mark.parametrize("command", ["emulate --json --no-links", "camera --yes --out"])
def test_a_camera_without_opencv_names_the_extra_and_nothing_else_loads_it(command: str, tmp_path: Path) -> None:
    rig = ROOT / "rigs" / "ur5e-dual-psd-camera.toml"
    name, *options = command.split()
    more = [tmp_path / "out"] if options[-1] == "--out" else []
    code, said = _without_extras(name, rig, *options, *more)
    needs = 'this needs the library cv2, which is not installed; pip install "calibeam[camera]", which brings it'
    assert (code, said) == (1, f"error: {needs}")


@pytest.fixture
def bag_import(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """An import of a ROS 2 bag where its reader is not installed."""
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "metadata.yaml").touch()
    return ["import", str(tmp_path / "bag"), "--streams", "--rig", str(RIG), "--out", str(tmp_path / "x.mcap"), "--yes"]


def test_a_bag_without_its_reader_names_the_extra(bag_import: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(bag_import) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert said.endswith('the library rosbags, which is not installed; pip install "calibeam[ros]", which brings it')


def test_a_library_that_no_extra_brings_is_a_fault_of_ours(
    bag_import: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(EXTRAS, "rosbags")
    with pytest.raises(ModuleNotFoundError):
        run(bag_import)


def test_every_library_of_an_extra_is_in_the_installation_of_that_name() -> None:
    packages = {"cv2": "opencv-python-headless", "distributed": "distributed", "foxglove": "foxglove-sdk"}
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    for library, extra in EXTRAS.items():
        assert any(entry.startswith(packages.get(library, library)) for entry in extras[extra])
