"""Sessions on a world in trouble, recorded stream by stream and diagnosed: each fault in its place, and no other."""

import json
from pathlib import Path

import pytest

from benchmarks.disturbed import Trouble
from benchmarks.tapped import PSD_S, Clocks, recorded
from calibeam.cli import run

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"


def diagnosed(folder, trouble, clocks):
    """Of `calibeam diagnose`: by (physics, where, stream), and the file."""
    path, out = folder / "recording.mcap", folder / "diagnosis.json"
    recorded(RIG, path, trouble, clocks)
    assert run(["diagnose", str(path), "--out", str(out)]) == 0
    file = json.loads(out.read_bytes())
    by_name = {(f["physics"], f["where"], f["stream"]): f for f in file["findings"] if f["stream"] is not None}
    return by_name, file


def size(finding, name):
    return finding["parameters"][name]["value"]


@pytest.mark.endure  # daily: streams/test_examine.py, and tests/calibeam/test_diagnose_streams.py
def test_healthy_devices_are_left_in_peace_and_their_clocks_known_to_a_tenth_of_a_millisecond(tmp_path):
    by_name, file = diagnosed(tmp_path, Trouble(), Clocks())
    assert by_name == {}
    clocks = {one["stream"]: one for one in file["streams"]["clocks"]}
    assert clocks["spots"]["offset_s"] == pytest.approx(20.0 - PSD_S, abs=1e-4)
    assert clocks["encoders"]["offset_s"] == pytest.approx(20.0 - 1000.0, abs=1e-4)


@pytest.mark.endure  # daily: streams/test_examine.py, and tests/calibeam/test_diagnose_streams.py
def test_a_late_encoder_a_slip_a_drifting_clock_and_lost_frames_in_one_session(tmp_path):
    trouble = Trouble(slip_joint=5, slip_rad=4e-4, slip_s=18.0, lag_joint=3, lag_s=8e-3)
    by_name, file = diagnosed(tmp_path, trouble, Clocks(drift=4e-4, lost_at_s=9.0, lost_samples=30, doubled_at_s=11.0))
    assert set(by_name) == {
        ("reading-lag", "joint3.angle", "encoders"),
        ("encoder-slip", "joint5.angle", "encoders"),
        ("latency", "time", "spots"),
    }
    assert size(by_name["reading-lag", "joint3.angle", "encoders"], "behind_s") == pytest.approx(8e-3, abs=1e-4)
    slip = by_name["encoder-slip", "joint5.angle", "encoders"]
    assert size(slip, "slip_rad") == pytest.approx(4e-4, abs=1e-5)
    assert slip["from_s"] < 20.0 + 18.0 < slip["to_s"]  # on the clock of the joints
    assert size(by_name["latency", "time", "spots"], "drift_s_per_s") == pytest.approx(-4e-4, abs=1e-5)
    clocks = {one["stream"]: one for one in file["streams"]["clocks"]}
    assert clocks["encoders"]["offset_s"] == pytest.approx(20.0 - 1000.0, abs=1e-4)
    usual = {one["physics"]: one for one in file["streams"]["usual"] if one["stream"] == "spots"}
    assert size(usual["missing-samples"], "samples_count") == 30
    assert size(usual["duplicated-samples"], "samples_count") == 1


@pytest.mark.endure  # the longest of three
def test_a_swinging_column_and_a_clock_that_was_set(tmp_path):
    trouble = Trouble(swing_hz=7.0, swing_damping=0.03, swing_rad=6e-5)
    by_name, file = diagnosed(tmp_path, trouble, Clocks(step_s=0.25, step_at_s=15.0))
    for stream in ("encoders", "spots"):
        ringing = by_name["ringing", "joint1.angle", stream]
        assert size(ringing, "frequency_hz") == pytest.approx(7.0, rel=0.02)
        assert size(ringing, "damping_share") == pytest.approx(0.03, rel=0.2)
    step = by_name["clock-step", "time", "spots"]
    assert size(step, "jump_s") == pytest.approx(0.25, abs=1e-3)
    assert step["from_s"] == pytest.approx(PSD_S + 15.0, abs=2e-3)
    assert set(by_name) - {("not-settled", "time", "spots")} == {
        ("ringing", "joint1.angle", "encoders"),
        ("ringing", "joint1.angle", "spots"),
        ("clock-step", "time", "spots"),
    }
    clocks = {one["stream"]: one for one in file["streams"]["clocks"]}
    assert clocks["spots"]["offset_s"] == pytest.approx(20.0 - PSD_S, abs=1e-4)
