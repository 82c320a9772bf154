"""The check names stamps that are not what they state, with size and remedy, and none in healthy streams."""

from dataclasses import replace

import numpy as np
import pytest

from acquisition.recording.check_recording import Finding, Problem, check
from acquisition.recording.recording import Stream
from acquisition.recording.sampling import SamplingStatus, sampling_of
from tests.acquisition.recording.conftest import RIG
from tests.acquisition.recording.stamped import NOMINAL_HZ, recording, stream, world

SEEDS = range(20)


def found(*streams: Stream) -> list[Finding]:
    return [one for one in check(recording(RIG, *streams)) if one.where.startswith("stream")]


def number_after(says: str, words: str) -> tuple[float, float]:
    """Value and sigma behind `words`: "4.00 ± 0.02"."""
    value, _, sigma = says.split(words, 1)[1].split(maxsplit=3)[:3]
    return float(value), float(sigma)


@pytest.mark.parametrize("seed", range(50))
def test_a_healthy_stream_has_no_finding(seed: int) -> None:
    one = world(seed)
    prompt_s = one.prompt()
    lost = one.rng.random(prompt_s.size) > 0.002
    device_s = one.true_s - 900.0
    assert not found(
        stream(prompt_s),
        stream(prompt_s[lost], np.flatnonzero(lost), name="psd"),
        stream(prompt_s, device_s=device_s, stamps="sampled", name="robot"),
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_bursts_are_named_with_pause_period_and_remedy(seed: int) -> None:
    one = world(seed)
    (finding,) = found(stream(one.in_bursts()))
    assert finding.problem is Problem.BURSTS
    assert finding.where == "stream tracker"
    assert "arrive in bursts" in finding.says
    assert "no constant delay repairs this" in finding.says
    assert "--restore-stamps" in finding.says
    pause_ms, _ = number_after(finding.says, "a pause of ")
    period_ms, sigma_ms = number_after(finding.says, "period ")
    assert pause_ms == pytest.approx(290.0, abs=20.0)
    assert abs(period_ms - 1e3 * (one.true_s[1] - one.true_s[0])) < 4.0 * sigma_ms + 1e-9


@pytest.mark.parametrize("seed", SEEDS)
def test_batches_are_named_with_their_size(seed: int) -> None:
    (finding,) = found(stream(world(seed).in_batches()))
    assert finding.problem is Problem.BURSTS
    assert "in batches of 16 with nearly one stamp" in finding.says


def test_one_stamp_for_a_whole_batch_is_no_sample_that_came_twice() -> None:
    one = world(3)
    last_s = one.true_s.reshape(-1, 16)[:, -1:].repeat(16, axis=1).ravel()
    assert [f.problem for f in found(stream(last_s, device_s=last_s, stamps="unknown"))] == [Problem.BURSTS]


def test_bursts_contradict_stamps_that_are_stated_as_sampled() -> None:
    late_s = world(4).in_bursts()
    (finding,) = found(stream(late_s, device_s=late_s, stamps="sampled"))
    assert "stated as `sampled`, but samples arrive in bursts" in finding.says


@pytest.mark.parametrize("seed", SEEDS)
def test_a_clock_that_was_set_is_named_with_its_step(seed: int) -> None:
    one = world(seed)
    step_s = one.rng.choice([-1.0, 1.0]) * one.rng.uniform(0.02, 0.5)
    row = int(one.rng.integers(600, 5400))
    counted = np.arange(one.true_s.size) + (np.arange(one.true_s.size) > 100)  # one counted as lost: a counter
    late_s = one.prompt() + np.where(np.arange(one.true_s.size) >= row, step_s, 0.0)
    late_s[101:] += one.true_s[1] - one.true_s[0]
    (finding,) = [f for f in found(stream(late_s, counted)) if f.problem is Problem.CLOCK_STEP]
    way = "forward" if step_s > 0.0 else "back"
    size_ms, sigma_ms = number_after(finding.says, f"was set {way} by ")
    assert abs(size_ms - 1e3 * abs(step_s)) < 4.0 * sigma_ms
    assert f"(sample {row + 1})" in finding.says


@pytest.mark.parametrize("seed", SEEDS)
def test_a_clock_that_slept_is_named_with_its_time(seed: int) -> None:
    one = world(seed)
    row, missing = int(one.rng.integers(1000, 5000)), int(one.rng.integers(100, 900))
    number = np.arange(one.true_s.size)
    kept = (number < row) | (number >= row + missing)
    asleep_s = missing * (one.true_s[1] - one.true_s[0])
    late_s = one.prompt() - np.where(number >= row + missing, asleep_s, 0.0)
    (finding,) = found(stream(late_s[kept], number[kept]))
    assert finding.problem is Problem.CLOCK_STEP
    assert f"where {missing} samples are missing" in finding.says
    size_ms, sigma_ms = number_after(finding.says, "slept: it fell behind by ")
    assert abs(size_ms - 1e3 * asleep_s) < 4.0 * sigma_ms


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("off", [0.018, -0.018])
def test_a_mean_rate_that_is_wrong_is_named_against_the_rig_file(seed: int, off: float) -> None:
    (finding,) = found(stream(world(seed, off).prompt()))
    assert finding.problem is Problem.RATE
    assert f"the {NOMINAL_HZ:g} a second of the rig file" in finding.says
    value, sigma = number_after(finding.says, "mean rate ")
    assert abs(value - 100.0 * off) < 4.0 * sigma + 0.02  # a quartz of 0.005 %


@pytest.mark.parametrize("seed", SEEDS)
def test_two_clocks_that_disagree_are_named(seed: int) -> None:
    one = world(seed)
    good = stream(one.prompt(), device_s=one.true_s, stamps="sampled", name="robot")
    fast = stream(one.prompt(), device_s=1.018 * one.true_s, stamps="sampled", name="laser")
    findings = found(good, fast)
    assert [f.problem for f in findings] == [Problem.RATE]
    assert "off the clock of stream laser" in findings[0].says
    value, sigma = number_after(findings[0].says, "its clock runs ")
    assert abs(value - 100.0 * (1.0 / 1.018 - 1.0)) < 4.0 * sigma + 1e-5


@pytest.mark.parametrize("stamps", ["sent", "unknown"])
def test_an_emulation_at_another_pace_is_no_finding_beside_stamps_of_the_host(stamps: str) -> None:
    one = world(9)
    fast = stream(one.prompt(), device_s=1.67 * one.true_s, stamps="sampled", name="robot")
    late_s = one.prompt()
    assert not found(fast, replace(stream(late_s, device_s=one.true_s - 0.005, name="encoders"), stamps=stamps))


def test_samples_that_were_lost_without_a_counter_are_steps_forward() -> None:
    one = world(5)
    kept = np.ones(one.true_s.size, dtype=bool)
    kept[2000:2040] = False
    (finding,) = found(stream(one.prompt()[kept]))
    assert "40 samples were lost without a counter, or the clock was set" in finding.says


def test_a_device_without_a_period_has_none() -> None:
    rng = np.random.default_rng(6)
    at_s = np.cumsum(rng.exponential(0.01, 6000))
    assert sampling_of(at_s, np.arange(6000)).status is SamplingStatus.IRREGULAR
    assert sampling_of(at_s[:100], np.arange(100)).status is SamplingStatus.TOO_SHORT
    assert sampling_of(at_s, np.zeros(6000, dtype=np.int64)).status is SamplingStatus.UNORDERED
    assert not found(stream(at_s))
