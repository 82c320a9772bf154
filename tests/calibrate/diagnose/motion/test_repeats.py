"""Scatter of torques between repeats: that of the noise, also where cycles were missed; none where there is nothing."""

from dataclasses import replace

import numpy as np
import pytest

from acquisition.recording import Event
from acquisition.recording.motion_plan import MOTION_EVENT
from benchmarks.drawn_motion import Hidden, recorded
from calibrate.diagnose.motion import scatter_of_repeats

LENGTH_S, REPEATS, PERIOD_S, NOISE_NM = 5.0, 3, 0.002, 0.2
BAND_SHARE = np.sqrt(2.0 * 20.0 * PERIOD_S)  # of white noise that a low pass of 20 Hz leaves


def repeated(late_s: float = 0.0, noise_nm: float = NOISE_NM, swing_rad: float = 0.4):
    """Three repeats between two stands; the second one begins late."""
    plain = recorded(Hidden(), length_s=20.0)
    stream = plain.streams["robot"]
    t_s = PERIOD_S * np.arange(len(stream.device_s))
    motion_s = t_s - 1.0
    motion_s = np.where(motion_s > LENGTH_S, np.maximum(motion_s - late_s, LENGTH_S), motion_s)
    phase = 2.0 * np.pi * np.clip(motion_s, 0.0, LENGTH_S * REPEATS) / LENGTH_S
    q = swing_rad * np.outer(1.0 - np.cos(phase), np.arange(1, 7) / 6.0)
    torque = 20.0 * np.sin(q) + noise_nm * np.random.default_rng(3).standard_normal(q.shape)
    values = {**stream.values, "actual_q_rad": q, "joint_torque_nm": torque}
    moved = replace(stream, device_s=t_s, host_s=t_s + 100.0, values=values)
    detail = {"length_s": LENGTH_S, "repeats": REPEATS}
    detail |= {"host_s": (t_s[::20] + 100.0).tolist(), "motion_s": motion_s[::20].tolist()}
    return replace(plain, streams={"robot": moved}, events=(Event(200.0, MOTION_EVENT, detail),))


@pytest.mark.parametrize("late_s", [0.0, 0.3])
def test_the_scatter_is_that_of_the_noise(late_s: float) -> None:
    found = scatter_of_repeats(repeated(late_s))
    assert found is not None
    assert (found.used, found.repeats) == (REPEATS, REPEATS)
    assert found.rms_nm == pytest.approx(NOISE_NM * BAND_SHARE, rel=0.15)


def test_without_noise_there_is_next_to_none() -> None:
    found = scatter_of_repeats(repeated(0.3, noise_nm=0.0))
    assert found is not None
    assert np.all(found.rms_nm < 5e-3)


def test_a_repeat_of_other_angles_takes_no_part() -> None:
    recording = repeated()
    stream = recording.streams["robot"]
    second = (stream.device_s > 6.0) & (stream.device_s < 11.0)
    q = np.where(second[:, None], 0.5, 1.0) * stream.values["actual_q_rad"]
    other = replace(recording, streams={"robot": replace(stream, values={**stream.values, "actual_q_rad": q})})
    found = scatter_of_repeats(other)
    assert found is not None
    assert found.used == REPEATS - 1


def test_a_motion_that_was_not_finished_has_no_scatter() -> None:
    assert scatter_of_repeats(replace(repeated(), events=())) is None
