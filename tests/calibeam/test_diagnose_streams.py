"""`diagnose` of a recording with streams: what is wrong with them stands beside the physics of the samples."""

import json
from dataclasses import replace

import numpy as np
import pytest

from acquisition.recording import Channel, RecordingWriter, read
from benchmarks.stream_cases import servo_scene
from benchmarks.stream_devices import devices_of_scene
from calibeam.cli import run
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

LATE_S = 4e-3
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


def recorded(path, folder, late_s):
    """The samples of the folder with streams of a motion; encoders stamped late."""
    source, devices = read(folder), devices_of_scene(servo_scene(3, moves=12), {})
    late = devices["encoders"]
    moved = replace(late.track, time_s=late.track.time_s + late_s)
    devices["encoders"] = replace(late, track=moved, host_s=late.host_s + late_s)
    with RecordingWriter(path, rig_text=source.rig_text, software="t", clock=Standing()) as writer:
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
