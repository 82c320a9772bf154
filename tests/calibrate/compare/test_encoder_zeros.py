"""Zeros of second encoders in two recordings: a change is found with its size, and nothing where there is none."""

from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import Channel, RecordingWriter, read
from acquisition.recording.rig import rig_text
from benchmarks.stream_cases import servo_scene
from benchmarks.stream_devices import devices_of_scene
from calibrate.compare.encoder_zeros import ZERO, joint_zeros, zero_mismatches_of
from calibrate.compare.rig_and_streams import compare_logs
from calibrate.diagnose.streams.examine import examine
from calibrate.errors import DataError

MOVED_RAD = np.radians(2.0)
RIG = Path(__file__).parents[3] / "rigs" / "encoders.toml"
ZEROS = "offset of the second encoders"
NOISE_RAD, ROWS = 6e-6, 2000


class Standing:
    def now_s(self) -> float:
        return 0.0


@pytest.fixture(scope="module")
def scene():
    return servo_scene(21, moves=10, stand_s=1.0)


def report(scene, more_rad=0.0, seed=0, zeros_rad=(), rows=slice(None)):
    """As of one recording, noise by its seed; from `rows` on the second encoder of joint 3 reads more."""
    scene = replace(deepcopy(scene), rng=np.random.default_rng(seed))
    devices = devices_of_scene(scene, {})
    track = devices["encoders"].track
    values = track.values.copy()
    values[rows, 2] += more_rad
    devices["encoders"] = replace(devices["encoders"], track=replace(track, values=values))
    return examine(devices, zeros_rad=zeros_rad)


def mismatches(one, two):
    return list(zero_mismatches_of(joint_zeros(one, two)))


@pytest.mark.parametrize("more_rad", [MOVED_RAD, -MOVED_RAD])
def test_a_zero_that_moved_between_two_recordings_is_named_with_its_size(scene, more_rad):
    (found,) = mismatches(report(scene, more_rad, 1), report(scene, 0.0, 2))
    assert (found.physics, found.where, found.decides) == (ZERO, "joint3.angle", True)
    size = found.sizes["zero_rad"]
    assert abs(size.value - more_rad) < 5.0 * size.sigma
    assert size.sigma < 1e-4
    assert "Zero of the second encoder of joint 3" in found.says


def test_arbitrary_zeros_that_stayed_are_no_difference(scene):
    changes = joint_zeros(report(scene, MOVED_RAD, 1), report(scene, MOVED_RAD, 2))
    assert len(changes) == 6
    assert not any(one.found for one in changes)
    assert all(0.0 < one.limit_rad < MOVED_RAD for one in changes)


def test_a_zero_that_one_rig_file_states_is_no_change_of_the_encoder(scene):
    """The rig file of the later recording states the zeros, as the diagnosis of the earlier one advised."""
    stated = [0.01] * 6
    assert mismatches(report(scene, 0.0, 1), report(scene, 0.0, 2, stated)) == []
    (found,) = mismatches(report(scene, MOVED_RAD, 1, stated), report(scene, 0.0, 2))
    assert found.sizes["zero_rad"].value == pytest.approx(MOVED_RAD, abs=1e-5)


def test_an_encoder_that_slipped_within_one_of_the_two_has_no_zero_to_compare(scene):
    slipped = report(scene, MOVED_RAD, 1, rows=slice(700, None))
    assert {one.name.where for one in slipped.findings if one.name.physics == "encoder-slip"} == {"joint3.angle"}
    assert {one.where for one in joint_zeros(slipped, report(scene, 0.0, 2))} == {
        f"joint{j}.angle" for j in (1, 2, 4, 5, 6)
    }


def test_without_streams_on_one_side_nothing_is_compared(scene):
    assert joint_zeros(report(scene), None) == ()


@pytest.fixture
def log(tmp_path):
    """A log of three encoders on one shaft that turns to and fro."""

    def made(name, more_rad=0.0, seed=1, turn_rad=4.0, rows=ROWS):
        time_s, rng = 0.01 * np.arange(rows), np.random.default_rng(seed)
        angle = (turn_rad * np.sin(0.5 * time_s))[:, None] + np.array([0.0, 0.4 + more_rad, 1.0])
        angle += rng.normal(0.0, NOISE_RAD, angle.shape)
        path, channel = tmp_path / name, Channel("position_rad", "rad", (3,))
        with RecordingWriter(path, rig_text=rig_text(RIG), software="t", clock=Standing()) as writer:
            stream = writer.stream("encoders", (channel,))
            stream.append(time_s, time_s, np.arange(rows), {"position_rad": angle})
        return read(path)

    return made


@pytest.mark.parametrize("turn_rad", [4.0, 1.0])
def test_logs_of_encoders_alone_show_a_zero_that_moved(log, turn_rad):
    one, two = log("one.mcap", MOVED_RAD, 1, turn_rad), log("two.mcap", 0.0, 2, turn_rad)
    file = compare_logs(one, two, "t")
    (found,) = (d for d in file.differences if d.physics == ZERO)
    assert (found.where, file.verdict) == ("encoder2.angle", "mismatch")
    assert found.sizes["zero_rad"].value == pytest.approx(MOVED_RAD, abs=1e-5)
    (ending,) = (e for e in file.examinations if e.what == ZEROS)
    assert (ending.outcome, ending.says) == ("found", found.says)


def test_logs_whose_encoders_stayed_state_the_smallest_change_that_shows(log):
    file = compare_logs(log("one.mcap", 0.0, 1), log("two.mcap", 0.0, 2), "t")
    assert file.verdict == "consistent"
    (ending,) = (e for e in file.examinations if e.what == ZEROS)
    assert (ending.outcome, ending.unit) == ("nothing found", "rad")
    assert 0.0 < ending.limit < 1e-3


def test_logs_that_are_too_short_are_not_examined_with_the_remedy(log):
    file = compare_logs(log("one.mcap", MOVED_RAD, 1, rows=300), log("two.mcap", 0.0, 2, rows=300), "t")
    (ending,) = (e for e in file.examinations if e.what == ZEROS)
    assert ending.outcome == "not examined"
    assert ending.expected
    assert "not determined" in ending.reason
    assert "over ten seconds" in ending.remedy


def test_logs_of_different_numbers_of_encoders_are_refused(log, tmp_path):
    angle, time_s = np.zeros((ROWS, 2)), 0.01 * np.arange(ROWS)
    with RecordingWriter(tmp_path / "two.mcap", rig_text=rig_text(RIG), software="t", clock=Standing()) as writer:
        stream = writer.stream("encoders", (Channel("position_rad", "rad", (2,)),))
        stream.append(time_s, time_s, np.arange(ROWS), {"position_rad": angle})
    with pytest.raises(DataError, match=r"3 encoders, .*: 2; give logs of the same encoders"):
        compare_logs(log("one.mcap"), read(tmp_path / "two.mcap"), "t")
