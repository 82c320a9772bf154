"""The line under the arrival times: rate and offset to the host's clock, and what is only delay."""

import numpy as np
import pytest

from acquisition.recording.device_clock import ClockStatus, clock_model
from acquisition.recording.recording import Stream
from acquisition.recording.samples import Floats

OFFSET_S, RATE, LEAST_S = 1e5, 1.0 + 23e-6, 2e-4


def stream(device_s: Floats, host_s: Floats) -> Stream:
    return Stream("psd", (), host_s, device_s, np.arange(device_s.size), {})


def arrivals(device_s: Floats, rng: np.random.Generator) -> Floats:
    """A busy host: delays of half a millisecond in the mean, and none overtakes another."""
    delay_s = LEAST_S + rng.exponential(5e-4, device_s.size)
    return np.maximum.accumulate(OFFSET_S + RATE * device_s + delay_s)


@pytest.fixture
def device_s() -> Floats:
    return np.arange(100_000) * 2e-3


@pytest.mark.parametrize("epoch_s", [0.0, 1.79e9])
def test_rate_and_offset_are_found_under_one_sided_delays(device_s: Floats, epoch_s: float) -> None:
    host_s = arrivals(device_s, np.random.default_rng(0))
    model = clock_model(stream(device_s + epoch_s, host_s))
    assert model.status is ClockStatus.FOUND
    assert model.rate == pytest.approx(RATE, abs=2e-8)
    true_s = OFFSET_S + RATE * device_s + LEAST_S
    np.testing.assert_allclose(model.offset_s + model.rate * (device_s + epoch_s), true_s, rtol=0.0, atol=2e-6)
    assert model.delay_median_s == pytest.approx(5e-4 * np.log(2.0), rel=0.2)


def test_no_sample_arrives_before_the_line(device_s: Floats) -> None:
    host_s = arrivals(device_s, np.random.default_rng(1))
    model = clock_model(stream(device_s, host_s))
    assert (host_s - (model.offset_s + model.rate * device_s)).min() > -1e-9


def test_batches_of_a_slow_line_are_delay_and_no_clock(device_s: Floats) -> None:
    host_s = arrivals(device_s, np.random.default_rng(2)).reshape(-1, 20)[:, -1].repeat(20)
    model = clock_model(stream(device_s, host_s))
    assert model.rate == pytest.approx(RATE, abs=2e-7)
    assert model.delay_p99_s == pytest.approx(0.039, abs=3e-3)


def test_a_clock_that_changes_its_pace_wanders(device_s: Floats) -> None:
    bent_s = device_s + 5e-7 * (device_s - 100.0) ** 2
    steady = clock_model(stream(device_s, arrivals(device_s, np.random.default_rng(3))))
    bent = clock_model(stream(device_s, arrivals(bent_s, np.random.default_rng(3))))
    assert steady.wander_s < 1e-5
    assert bent.wander_s > 1e-3


@pytest.mark.parametrize(
    ("times_s", "status"),
    [
        (np.arange(5) * 1.0, ClockStatus.TOO_SHORT),
        (np.arange(500) * 1e-3, ClockStatus.TOO_SHORT),
        (np.array([*range(100), *range(100)]) * 1.0, ClockStatus.GOES_BACK),
        (np.full(100, np.nan), ClockStatus.UNSTAMPED),
        (np.empty(0), ClockStatus.TOO_SHORT),
        (np.zeros(100), ClockStatus.TOO_SHORT),
    ],
)
def test_what_cannot_be_reported_is_not_reported(times_s: Floats, status: ClockStatus) -> None:
    model = clock_model(stream(times_s, np.arange(times_s.size) * 1.0))
    assert model.status is status
    assert model.rate is None
    assert model.offset_s is None


def test_samples_without_a_stamp_are_left_out(device_s: Floats) -> None:
    host_s = arrivals(device_s, np.random.default_rng(0))
    holed_s = np.where(np.arange(device_s.size) % 7 == 0, np.nan, device_s)
    assert clock_model(stream(holed_s, host_s)).rate == pytest.approx(RATE, abs=2e-8)
