"""All finders together over the streams of one session: each fault is told as what it is, and nothing else is."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.stream_cases import servo_scene, sway_rad
from benchmarks.stream_devices import EPOCHS_S, delivered, devices_of_scene
from calibrate.diagnose.streams.examine import examine
from calibrate.diagnose.streams.settling import Window, stands_of
from calibrate.diagnose.streams.streams_of_recording import USUAL
from calibrate.diagnose.streams.track import Track


@pytest.fixture(scope="module")
def made():
    return servo_scene(21, moves=10, stand_s=1.0)


@pytest.fixture
def scene(made):
    return deepcopy(made)  # with a generator of its own


def faults(report):
    return [one for one in report.findings if one.name.physics not in USUAL]


def predicted(scene):
    return lambda q_rad, time_s: q_rad @ scene.lever_m.T


def test_healthy_devices_with_clocks_of_their_own_have_no_fault(scene):
    report = examine(devices_of_scene(scene, {}), predicted(scene))
    assert faults(report) == []
    for name in ("encoders", "spots"):
        assert report.clocks[name].offset_s == pytest.approx(EPOCHS_S["joints"] - EPOCHS_S[name], abs=1e-4)


@pytest.mark.parametrize(("device", "late_s"), [("encoders", 4e-3), ("spots", -3e-3)])
def test_readings_stamped_late_are_reported_by_how_much(scene, device, late_s):
    """The host's stamps are no later by it, since the line is what it was."""
    devices = devices_of_scene(scene, {})
    late = devices[device]
    devices[device] = replace(late, track=replace(late.track, time_s=late.track.time_s + late_s))
    devices[device] = replace(devices[device], host_s=late.host_s + late_s)
    (found,) = faults(examine(devices, predicted(scene)))
    assert (found.name.physics, found.name.where, found.stream) == ("latency", "time", device)
    assert found.parameters["latency_s"].value == pytest.approx(late_s, abs=2e-4)
    assert 0.0 < found.p < 1e-3


def test_a_clock_that_drifts_more_than_a_quartz_is_reported(scene):
    devices = devices_of_scene(scene, {})
    own = devices["encoders"].track
    devices["encoders"] = delivered(scene.rng, replace(own, time_s=own.time_s + 12.0), -12.0, drift=4e-4)
    (found,) = faults(examine(devices, predicted(scene)))
    assert found.parameters["drift_s_per_s"].value == pytest.approx(-4e-4, abs=5e-6)


def test_a_clock_that_was_set_is_reported_and_does_not_hide_the_rest(scene):
    devices = devices_of_scene(scene, {})
    own = devices["encoders"]
    middle = len(own.track.time_s) // 2
    stepped = own.track.time_s + 0.25 * (np.arange(len(own.track.time_s)) >= middle)
    devices["encoders"] = replace(own, track=replace(own.track, time_s=stepped))
    report = examine(devices, predicted(scene))
    (found,) = faults(report)
    assert (found.name.physics, found.name.where) == ("clock-step", "time")
    assert found.parameters["jump_s"].value == pytest.approx(0.25, abs=1e-3)
    assert found.from_s == pytest.approx(own.track.time_s[middle - 1])
    assert report.clocks["encoders"].offset_s == pytest.approx(15.0, abs=1e-4)


def test_samples_that_a_reader_lost_are_missing_and_no_step_of_a_clock(scene):
    devices = devices_of_scene(scene, {})
    own = devices["encoders"]
    kept = np.delete(np.arange(len(own.track.time_s)), np.arange(300, 320))
    lost = replace(own, track=own.track.take(kept), host_s=own.host_s[kept], sequence=np.arange(len(kept)))
    report = examine({**devices, "encoders": lost}, predicted(scene))
    assert faults(report) == []
    (lines,) = [one for one in report.findings if one.name.physics == "missing-samples"]
    assert lines.parameters["samples_count"].value == 20


def test_one_encoder_that_lags_is_that_joint_and_not_the_clock(scene):
    devices = devices_of_scene(scene, {})
    own = devices["encoders"]
    values = own.track.values.copy()
    values[:, 2] = scene.true(own.track.time_s - EPOCHS_S["encoders"] - 5e-3)[:, 2] + 0.01
    report = examine({**devices, "encoders": replace(own, track=replace(own.track, values=values))}, predicted(scene))
    (found,) = faults(report)
    assert (found.name.physics, found.name.where) == ("reading-lag", "joint3.angle")
    assert found.parameters["behind_s"].value == pytest.approx(5e-3, rel=0.05)
    assert report.clocks["encoders"].offset_s == pytest.approx(15.0, abs=1e-4)


def test_a_stale_reading_is_frozen_at_its_joint(scene):
    devices = devices_of_scene(scene, {})
    own = devices["encoders"]
    speed = np.abs(np.gradient(own.track.values[:, 4], own.track.time_s))
    start = int(np.flatnonzero(speed > 0.1)[40])
    values = own.track.values.copy()
    values[start : start + 12, 4] = values[start, 4]
    found = faults(
        examine({**devices, "encoders": replace(own, track=replace(own.track, values=values))}, predicted(scene))
    )
    assert ("frozen-reading", "joint5.angle") in {(one.name.physics, one.name.where) for one in found}


def test_a_joint_that_rings_is_named_by_the_levers_of_the_model(scene):
    sway = sway_rad(scene, 9.0, 0.03, 2e-5)
    devices = devices_of_scene(scene, {}, scene.spots(sway))
    (found,) = faults(examine(devices, predicted(scene)))
    assert (found.name.physics, found.name.where) == ("ringing", "joint2.angle")
    assert found.parameters["frequency_hz"].value == pytest.approx(9.0, rel=0.02)
    assert found.parameters["damping_share"].value == pytest.approx(0.03, rel=0.2)


def test_samples_taken_too_early_are_reported_by_their_rows():
    scene = servo_scene(8, frequency_hz=4.0, moves=14, stand_s=1.0)
    devices = devices_of_scene(scene, {})
    stands = stands_of(devices["command"].track)[1:]
    shift_s = EPOCHS_S["spots"] - EPOCHS_S["joints"]
    early = np.arange(len(stands)) % 4 == 1
    begin = [stand.from_s + shift_s + (0.12 if soon else 0.7) for stand, soon in zip(stands, early, strict=True)]
    report = examine(devices, predicted(scene), [Window(b, b + 0.05) for b in begin])
    (found,) = [one for one in faults(report) if one.name.physics == "not-settled"]
    assert found.name.where == "time"
    assert found.parameters["samples_count"].value == int(early.sum())
    rows = ", ".join(str(k + 1) for k in np.flatnonzero(early))
    assert f"rows {rows}" in found.says


def test_without_a_model_the_clock_of_the_spots_stays_open(scene):
    report = examine(devices_of_scene(scene, {}))
    assert "spots" not in report.clocks
    assert any(line.startswith("clock of spots") for line in report.unseen)
    assert any("unsettled" in line for line in report.unseen)


def test_without_joints_nothing_is_compared(scene):
    devices = devices_of_scene(scene, {})
    report = examine({"encoders": devices["encoders"]})
    assert report.findings == ()
    assert all(one.outcome != "nothing found" for one in report.examinations if one.what != "continuity of the streams")


def test_probabilities_are_never_zero():
    scene = servo_scene(21, moves=6, stand_s=1.0)
    devices = devices_of_scene(scene, {"encoders": 0.0})
    own = devices["joints"].track
    devices["joints"] = replace(devices["joints"], track=Track("joints", "rad", own.time_s[::-1], own.values))
    assert all(one.p > 0.0 for one in examine(devices).findings)


def test_a_slip_is_found_where_a_bus_carries_the_stamps_of_an_uneven_host(scene):
    """An emulation that runs faster than its host, and now slower: joints keep their clock, encoders have none."""
    devices = devices_of_scene(scene, {})
    encoders = devices["encoders"]
    true_s = {name: one.track.time_s - EPOCHS_S[name] for name, one in devices.items()}
    pace = {name: 1000.0 + 0.2 * t + 0.25 * np.sin(0.4 * t) for name, t in true_s.items()}  # 0.1 to 0.3 of real time
    uneven = {name: replace(one, host_s=pace[name] + 1e-4) for name, one in devices.items()}
    slipped = encoders.track.values.copy()
    slipped[true_s["encoders"] > 11.0, 3] += 4e-4
    bus = Track("encoders", "rad", pace["encoders"], slipped)
    report = examine({**uneven, "encoders": replace(uneven["encoders"], track=bus)}, predicted(scene))
    (found,) = faults(report)
    assert (found.name.physics, found.name.where) == ("encoder-slip", "joint4.angle")
    assert found.parameters["slip_rad"].value == pytest.approx(4e-4, abs=3e-5)
    assert any(line.startswith("clock of encoders: stamped by the host") for line in report.unseen)
