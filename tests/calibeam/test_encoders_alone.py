"""A rig of encoders alone over a real wire: checked, logged, exported, imported, compared; commands of an arm."""

import json
from collections.abc import Iterator
from pathlib import Path

import can
import numpy as np
import pytest

from acquisition.recording import Recording, read
from acquisition.recording.errors import RigFileError
from acquisition.recording.rig import load_rig
from calibeam.cli import run
from calibeam.emulation import Emulation
from calibeam.live.composer import Composer
from calibeam.live.health import Latest
from drivers.clock import SystemClock

RIG = Path(__file__).parents[2] / "rigs" / "encoders.toml"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with rig.toml of emulated encoders, truth.json and a log."""
    folder = tmp_path_factory.mktemp("encoders")
    with Emulation(RIG, seed=3, time_scale=2.0, truth=folder / "truth.json") as running:
        (folder / "rig.toml").write_text(RIG.read_text().replace("out/emulated/can", running.address["can"]["channel"]))
        run(["log", "encoders", str(folder / "rig.toml"), "--out", str(folder / "log"), "--for-s", "6"])
        yield folder


def log_of(site: Path) -> Path:
    return site / "log" / "segment-0001.mcap"


def test_they_are_checked_and_logged(site: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(["check", str(site / "rig.toml")])  # a busy machine may fall short of the rate
    assert "3 encoders on slcan" in capsys.readouterr().out
    assert run(["check", str(site / "log")]) == 0
    shown = capsys.readouterr().out
    assert "encoders: period " in shown
    assert "settled samples" not in shown
    recording = read(log_of(site))
    angles = recording.streams["encoders"].values["position_rad"]
    assert angles.shape[1] == 3
    apart = np.diff(angles, axis=1)  # all discs sit on one shaft
    spread = np.nanmax(apart, axis=0) - np.nanmin(apart, axis=0)
    assert np.nanmax(angles) - np.nanmin(angles) > 1.0
    assert 0.0 < spread.max() < 0.1


def test_rows_and_frames_have_the_time_of_the_adapter_that_stamps_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    signals = 'signals = ["ENCODER1.Angle", "ENCODER2.Angle", "ENCODER3.Angle"]'
    plain = f'driver = "can-dbc"\nstamp = "hardware"\ndbc = "{RIG.parent / "encoders-plain.dbc"}"\n{signals}'
    text = RIG.read_text().replace('driver = "cia406"', plain).replace("nodes = [1, 2, 3]", "")
    (tmp_path / "rig.toml").write_text(text)
    with Emulation(tmp_path / "rig.toml", seed=3, time_scale=2.0, truth=tmp_path / "truth.json") as running:
        (tmp_path / "rig.toml").write_text(text.replace("out/emulated/can", running.address["can"]["channel"]))
        arguments = ["log", "encoders", str(tmp_path / "rig.toml"), "--out", str(tmp_path / "log"), "--for-s", "1"]
        assert run(arguments) == 0
    assert run(["check", str(tmp_path / "log")]) == 0
    assert capsys.readouterr().out.count("time stamp: hardware") == 2
    streams = read(log_of(tmp_path)).streams
    assert {name: stream.stamps for name, stream in streams.items()} == {"can": "hardware", "encoders": "hardware"}
    device_s, sequence = streams["encoders"].device_s, streams["encoders"].sequence
    np.testing.assert_allclose(device_s - device_s[0], 0.01 * (sequence - sequence[0]), atol=0.0021)
    assert np.isfinite(streams["can"].device_s).all()


@pytest.mark.parametrize(("name", "reader"), [("bus.blf", can.BLFReader), ("bus.log", can.CanutilsLogReader)])
def test_frames_go_out_and_come_back(site: Path, tmp_path: Path, name: str, reader: type) -> None:
    assert run(["export", str(log_of(site)), "--out", str(tmp_path / name)]) == 0
    frames = len(read(log_of(site)).streams["can"].host_s)
    assert len(list(reader(str(tmp_path / name)))) == frames
    arguments = ["import", str(tmp_path / name), "--rig", str(site / "rig.toml"), "--out", str(tmp_path / "back.mcap")]
    assert run(arguments) == 0
    (stream,) = (s for n, s in read(tmp_path / "back.mcap").streams.items() if n.startswith("can"))
    assert len(stream.host_s) == frames


def imported(log: Path, rig: Path, out: Path) -> Recording:
    assert run(["import", str(log), "--rig", str(rig), "--out", str(out)]) == 0
    return read(out)


def test_angles_are_read_from_a_can_log_by_the_set_up_in_it(site: Path, tmp_path: Path) -> None:
    run(["export", str(log_of(site)), "--out", str(tmp_path / "bus.blf")])
    found = imported(tmp_path / "bus.blf", site / "rig.toml", tmp_path / "back.mcap").streams["encoders"]
    logged = read(log_of(site)).streams["encoders"]
    assert same_angles(logged.values["position_rad"], found.values["position_rad"]) > 0.9 * len(logged.host_s)


def same_angles(logged: np.ndarray, found: np.ndarray) -> int:
    """Rows of the one that are rows of the other: an answer that comes late is in one of them only."""
    known = {tuple(row) for row in np.round(logged, 9).tolist()}
    return sum(tuple(row) in known for row in np.round(found, 9).tolist())


def test_without_the_set_up_the_rig_file_states_the_size_of_a_count(
    site: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(["export", str(log_of(site)), "--out", str(tmp_path / "bus.blf")])
    with can.BLFReader(tmp_path / "bus.blf") as whole, can.BLFWriter(tmp_path / "late.blf") as late:
        for message in whole:
            if message.arbitration_id in (0x080, 0x281, 0x282, 0x283):
                late.on_message_received(message)
    assert "encoders" not in imported(tmp_path / "late.blf", site / "rig.toml", tmp_path / "raw.mcap").streams
    assert "no angles: " in (out := capsys.readouterr().out)
    assert "give 'units_per_turn'" in out
    (site / "counts.toml").write_text(
        (site / "rig.toml").read_text().replace("nodes =", "units_per_turn = 1048576\nnodes =")
    )
    found = imported(tmp_path / "late.blf", site / "counts.toml", tmp_path / "back.mcap").streams["encoders"]
    logged = read(log_of(site)).streams["encoders"].values["position_rad"]
    turned, here = (a[np.isfinite(a).all(axis=1)] for a in (found.values["position_rad"], logged))
    first = here[0] - turned[0]
    np.testing.assert_allclose(np.sin(0.5 * first), 0.0, atol=1e-9)  # the same place, whole turns apart
    assert same_angles(here, turned + first) > 0.9 * len(here)


def test_angles_go_out_as_a_table_and_come_back(site: Path, tmp_path: Path) -> None:
    assert run(["export", str(log_of(site)), "--out", str(tmp_path / "tables")]) == 0
    assert run(["import", str(tmp_path / "tables"), "--out", str(tmp_path / "back.mcap")]) == 0
    here, back = (read(path).streams["encoders"] for path in (log_of(site), tmp_path / "back.mcap"))
    np.testing.assert_array_equal(here.values["position_rad"], back.values["position_rad"])


def test_two_logs_of_one_motion_are_compared(site: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "compare.json"
    assert run(["compare", str(log_of(site)), str(log_of(site)), "--out", str(out)]) == 0
    assert json.loads(out.read_text())["verdict"] == "consistent"
    tables = tmp_path / "tables"
    run(["export", str(log_of(site)), "--out", str(tables)])
    lines = (tables / "streams" / "encoders.csv").read_text().splitlines()
    column = lines[0].split(",").index('"position_rad_2"')
    rows = [line.split(",") for line in lines[1:]]
    for row in rows:  # the second encoder of the other log reads 30 % more
        row[column] = str(1.3 * float(row[column])) if row[column] else ""
    (tables / "streams" / "encoders.csv").write_text("\n".join([lines[0], *(",".join(row) for row in rows)]) + "\n")
    run(["import", str(tables), "--out", str(tmp_path / "other.mcap")])
    assert run(["compare", str(log_of(site)), str(tmp_path / "other.mcap"), "--out", str(out), "--force"]) == 0
    assert json.loads(out.read_text())["verdict"] == "mismatch"


@pytest.mark.parametrize("command", [["session", "--out", "s"], ["design", "--out", "p.toml"], ["centre"]])
def test_commands_of_an_arm_say_so(site: Path, command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run([command[0], str(site / "rig.toml"), *command[1:]]) == 1
    assert "needs an arm, and the file has none; add [arm]" in capsys.readouterr().err


def test_a_fit_of_a_log_is_refused(site: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["identify", str(log_of(site)), "--out", str(tmp_path / "m.json")]) == 1
    assert "has no arm: a log of encoders alone holds no poses to fit" in capsys.readouterr().err


def test_the_live_page_shows_as_many_strips_and_no_arm() -> None:
    page = Composer(load_rig(RIG, needs_arm=False), Latest(SystemClock()), "watch")
    shown = json.loads(page.rig())
    assert (len(shown["lower_rad"]), shown["reach_m"]) == (3, 0.0)
    assert json.loads(page.now())["points_m"] is None


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("\n[devices.robot]\ndriver = 'ur-rtde'\nhost = '127.0.0.1'\n", r"\[devices.robot\] needs an arm: add \[arm\]"),
        ("\n[camera]\n", r"needs the key 'source'"),
        ("\n[[placement]]\nid = 1\npsd1_in_base = {}\n", r"there is no \[fixture\]; add it"),
    ],
)
def test_what_sits_on_an_arm_needs_one(tmp_path: Path, change: str, says: str) -> None:
    (tmp_path / "rig.toml").write_text(RIG.read_text() + change)
    with pytest.raises(RigFileError, match=says):
        load_rig(tmp_path / "rig.toml", needs_arm=False)


def test_a_rig_of_nothing_needs_an_arm(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text('schema = 1\nname = "x"\n')
    with pytest.raises(RigFileError, match=r"needs the key 'arm'; add it \(only a rig of \[devices.encoders\]"):
        load_rig(tmp_path / "rig.toml", needs_arm=False)
    (tmp_path / "rig.toml").write_text(RIG.read_text().replace("[1, 2, 3]", "[]"))
    with pytest.raises(RigFileError, match="names no encoder; give 'nodes'"):
        load_rig(tmp_path / "rig.toml", needs_arm=False)


def test_a_diagnosis_of_encoders_alone_points_to_check_and_compare(
    site: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["diagnose", str(log_of(site)), "--out", str(tmp_path / "found.json")]) == 0
    shown = capsys.readouterr().out
    assert "settled samples" not in shown
    assert "calibeam check LOG" in " ".join(shown.split())
    assert "calibeam compare ONE TWO" in " ".join(shown.split())


def test_a_table_of_encoders_is_imported_and_checked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    time_s = np.arange(0.0, 2.0, 0.01)
    rows = [",".join(map(repr, (t, t, 2.0 * t, 3.0 * t))) for t in time_s.tolist()]
    (tmp_path / "log.csv").write_text("\n".join(["time [s],enc1 [rad],enc2 [rad],enc3 [rad]", *rows]))
    arguments = ["import", str(tmp_path / "log.csv"), "--streams", "--rig", str(RIG), "--yes"]
    assert run([*arguments, "--out", str(tmp_path / "log.mcap")]) == 0
    (stream,) = read(tmp_path / "log.mcap").streams.values()
    np.testing.assert_allclose(stream.values["position_rad"], np.outer(time_s, [1.0, 2.0, 3.0]))
    assert run(["check", str(tmp_path / "log.mcap")]) == 0
    shown = capsys.readouterr().out
    assert "not examined: encoders against each other (encoder 2, encoder 3): fewer than 800 rows" in shown
    assert "nothing wrong in what was examined: " in shown
    assert run([*arguments, "--out", str(tmp_path / "two.mcap"), "--columns", "enc1..enc3 [rad] = q"]) == 1
    assert "q needs an arm, and the rig file has none; state enc" in capsys.readouterr().err
