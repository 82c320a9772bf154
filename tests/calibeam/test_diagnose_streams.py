"""`diagnose` of a recording with streams: what is wrong with them stands beside the physics of the samples."""

import html
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from acquisition.recording import Channel, RecordingWriter, read
from benchmarks.moving_arm import motion, sampled
from benchmarks.stream_cases import JOINT_NOISE_RAD, servo_scene
from benchmarks.stream_devices import devices_of_scene
from calibeam.cli import run
from calibeam.results import diagnosis
from calibrate.diagnose.streams.stream_examinations import STREAM_EXAMINATIONS
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

LATE_S = 4e-3
ROWS, RATE_HZ, BEHIND_S, OFFSET_DEG = 5000, 125.0, 0.010, 17.0
ENCODER_ZERO_RAD = 0.01  # of every second encoder of the scenes
CHANNELS = {"command": "target_q_rad", "joints": "actual_q_rad", "encoders": "position_rad"}


class Standing:
    """Host time that never passes."""

    def now_s(self) -> float:
        return 0.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    where = tmp_path_factory.mktemp("healthy")
    write_case(conceal(Wanted("tracker", 5, defects=(), samples=40, arm="irb120")), where)
    return where / "recording"


def recorded(path, folder, late_s, more_rad=0.0, zero_rad=None):
    """The samples of the folder with streams of a motion; encoders stamped late, that of joint 3 reads more.

    `zero_rad`: as the rig file states it, of all joints.
    """
    source, devices = read(folder), devices_of_scene(servo_scene(3, moves=12), {})
    late = devices["encoders"]
    more = more_rad * (np.arange(6) == 2)
    moved = replace(late.track, time_s=late.track.time_s + late_s, values=late.track.values + more)
    devices["encoders"] = replace(late, track=moved, host_s=late.host_s + late_s)
    stated = "" if zero_rad is None else f"\nencoder_zero_rad = {zero_rad}"
    text = source.rig_text.replace("[[arm.joint]]", f"[[arm.joint]]{stated}")
    with RecordingWriter(path, rig_text=text, software="t", clock=Standing()) as writer:
        for row in source.samples.rows():
            writer.sample(row)
        for name, channel in CHANNELS.items():
            device = devices[name]
            stream = writer.stream(name, (Channel(channel, "rad", (6,)),))
            stream.append(device.host_s, device.track.time_s, device.sequence, {channel: device.track.values})
    return path


@pytest.mark.parametrize("late_s", [LATE_S, 0.0])
def test_encoders_stamped_late_are_a_finding_and_clocks_apart_are_none(folder, tmp_path, late_s):
    path, out = recorded(tmp_path / "recording.mcap", folder, late_s), tmp_path / "diagnosis.json"
    assert run(["diagnose", str(path), "--out", str(out)]) == 0
    said = json.loads(out.read_text())
    found = [one for one in said["findings"] if one["stream"] is not None]
    assert [one["physics"] for one in found] == ["latency"] * bool(late_s)
    assert all(one["where"] == "time" and one["p"] > 0.0 for one in found)
    assert {one["physics"] for one in said["streams"]["usual"]} == {"following-error"}
    (clock,) = said["streams"]["clocks"]
    assert clock["offset_s"] == pytest.approx(15.0 - late_s, abs=1e-4)
    if late_s:
        assert found[0]["parameters"]["latency_s"]["value"] == pytest.approx(late_s, abs=2e-4)
        assert said["verdict"] == "mismatch"
        assert "later than the joints" in out.with_suffix(".html").read_text(encoding="utf-8")
    assert np.isfinite(said["rms_before_m"])


def test_an_offset_in_an_imported_table_is_printed_and_in_the_file(folder, tmp_path, capsys):
    """Set-points and readings in degrees; joint 3 reads 17 degrees more, and all of them come 10 ms later."""
    rng, time_s = np.random.default_rng(1), 0.1 + np.arange(ROWS) / RATE_HZ
    path = motion(rng, 40)
    command = sampled(path.time_s, path.command_rad, time_s)
    read_rad = sampled(path.time_s, path.command_rad, time_s - BEHIND_S) + rng.normal(0.0, JOINT_NOISE_RAD, (ROWS, 6))
    read_deg = np.degrees(read_rad) + OFFSET_DEG * (np.arange(6) == 2)
    names = ["time", *(f"q{j}" for j in range(1, 7)), *(f"c{j}" for j in range(1, 7))]
    table = np.column_stack([time_s, read_deg, np.degrees(command)])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header=",".join(names), comments="", fmt="%.9f")
    (tmp_path / "rig.toml").write_text(read(folder).rig_text, encoding="utf-8")
    log, out = tmp_path / "log.mcap", tmp_path / "diagnosis.json"
    columns = "time [s] = t, q1..q6 [deg] = q, c1..c6 [deg] = cmd"
    arguments = ["--streams", "--rig", str(tmp_path / "rig.toml"), "--columns", columns, "--yes", "--out", str(log)]
    assert run(["import", str(tmp_path / "log.csv"), *arguments]) == 0
    capsys.readouterr()
    assert run(["diagnose", str(log), "--out", str(out)]) == 0
    shown, said = " ".join(capsys.readouterr().out.split()), json.loads(out.read_text())
    (found,) = said["findings"]
    assert (found["physics"], found["where"], found["stream"]) == ("angle-offset", "joint3.angle", "joints")
    size = found["parameters"]["offset_rad"]
    assert abs(size["value"] - np.radians(OFFSET_DEG)) < min(5.0 * size["sigma"], np.radians(0.01))
    assert found["says"].replace("\N{NO-BREAK SPACE}", " ") in shown
    assert said["verdict"] == "mismatch"
    endings = {one["where"]: one for one in said["examinations"] if one["what"] == "offset from the set-point"}
    assert {where for where, one in endings.items() if one["outcome"] == "found"} == {"joint3"}
    assert all(one["limit"] > 0.0 for where, one in endings.items() if where != "joint3")


def test_a_second_encoder_off_the_zero_of_the_rig_file_is_found(folder, tmp_path):
    more_rad, out = np.radians(2.0), tmp_path / "diagnosis.json"
    path = recorded(tmp_path / "recording.mcap", folder, 0.0, more_rad, ENCODER_ZERO_RAD)
    assert run(["diagnose", str(path), "--out", str(out)]) == 0
    (found,) = (one for one in json.loads(out.read_text())["findings"] if one["stream"] is not None)
    assert (found["physics"], found["where"], found["stream"]) == ("angle-offset", "joint3.angle", "encoders")
    assert found["parameters"]["offset_rad"]["value"] == pytest.approx(more_rad, abs=1e-5)


def test_without_a_stated_zero_a_comparison_finds_that_it_moved(folder, tmp_path, capsys):
    more_rad, out = np.radians(2.0), tmp_path / "compare.json"
    later = recorded(tmp_path / "later.mcap", folder, 0.0, more_rad)
    assert run(["diagnose", str(later), "--out", str(tmp_path / "diagnosis.json"), "--verbose"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "not examined: offset of the second encoders: against the zero" in shown
    assert "state `encoder_zero_rad` of the joints in the rig file, or compare with an earlier recording" in shown
    earlier = recorded(tmp_path / "earlier.mcap", folder, 0.0)
    assert run(["compare", str(later), str(earlier), "--no-diagnose", "--out", str(out)]) == 0
    said = json.loads(out.read_text())
    (found,) = (one for one in said["differences"] if one["physics"] == "encoder-zero-moved")
    assert (found["where"], found["level"], said["verdict"]) == ("joint3.angle", "encoder-zeros", "mismatch")
    assert found["sizes"]["zero_rad"]["value"] == pytest.approx(more_rad, abs=1e-5)
    assert found["says"].replace("\N{NO-BREAK SPACE}", " ") in " ".join(capsys.readouterr().out.split())


def test_streams_whose_examination_failed_are_in_the_file_on_the_screen_and_on_the_page(
    folder, tmp_path, capsys, monkeypatch
):
    def broken(*_args):
        raise np.linalg.LinAlgError("singular matrix")

    monkeypatch.setattr(diagnosis, "streams_of", broken)
    path, out = recorded(tmp_path / "recording.mcap", folder, LATE_S), tmp_path / "diagnosis.json"
    assert run(["diagnose", str(path), "--out", str(out), "--verbose"]) == 0
    said = json.loads(out.read_text())
    endings = [one for one in said["examinations"] if one["reason"].startswith("the stage failed: LinAlgError")]
    assert {one["what"] for one in endings} == {one.what for one, _ in STREAM_EXAMINATIONS}
    assert all(one["outcome"] == "not examined" and one["expected"] and "report" in one["remedy"] for one in endings)
    assert [one["stage"] for one in said["incomplete"]] == ["streams"]
    shown = " ".join(capsys.readouterr().out.split())
    page = " ".join(html.unescape(re.sub("<[^>]+>", " ", out.with_suffix(".html").read_text(encoding="utf-8"))).split())
    for text in (shown, page):
        assert "streams: LinAlgError: singular matrix" in text
        assert "following error: the stage failed: LinAlgError: singular matrix" in text
    assert "Not examined" in page
