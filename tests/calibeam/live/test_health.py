"""Live, stale, lost: in words that say what to do."""

import pytest

from calibeam.live.health import DeviceReadings, Watch, asked_rates


@pytest.fixture
def watch(rig) -> Watch:
    return Watch(asked_rates(rig))


def test_devices_and_rates_are_those_of_the_rig(rig) -> None:
    assert asked_rates(rig) == {"robot": 500.0, "psd": 1000.0, "encoders": 100.0}


def test_before_its_first_sample_a_device_is_waited_for(watch) -> None:
    health = watch.look("psd", DeviceReadings(), 100.0)
    assert (health.state, health.age_s, health.rate_hz) == ("waiting", None, None)
    assert not watch.fresh("psd", DeviceReadings(), 100.0)


def test_a_live_device_tells_age_and_rate_by_its_own_clock(watch, latest, block, clock) -> None:
    for first in range(0, 300, 10):
        latest.heard("encoders", block(*range(first, first + 10)))
        health = watch.look("encoders", latest.of("encoders"), clock.now_s() + 0.05)
        clock.time_s += 0.1
    assert health.state == "live"
    assert health.age_s == pytest.approx(0.05)
    assert health.rate_hz == pytest.approx(100.0)
    assert health.says == ""


def test_samples_that_go_missing_are_counted_and_reported(watch, latest, block, clock) -> None:
    for first in range(0, 300, 10):
        latest.heard("encoders", block(*range(first, first + 5)))
        health = watch.look("encoders", latest.of("encoders"), clock.now_s())
        clock.time_s += 0.1
    assert health.lost == 29 * 5
    assert "50 of 100 Hz" in health.says or "51 of 100 Hz" in health.says
    assert "lower the rate" in health.says


def test_old_samples_are_stale_and_not_fresh(watch, latest, block, clock) -> None:
    latest.heard("psd", block(1))
    clock.time_s += 1.2
    health = watch.look("psd", latest.of("psd"), clock.now_s())
    assert health.state == "stale"
    assert health.says == "no new sample for 1.2 s: check its cable and power"
    assert not watch.fresh("psd", latest.of("psd"), clock.now_s())


def test_a_slow_device_is_not_stale_between_its_samples(latest, block, clock) -> None:
    slow = Watch({"robot": 5.0})
    latest.heard("robot", block(1))
    clock.time_s += 0.9
    assert slow.fresh("robot", latest.of("robot"), clock.now_s())


def test_a_lost_device_says_why(watch, latest, block, clock) -> None:
    latest.heard("robot", block(1))
    latest.lost("robot", "robot at 192.168.0.10: closed; check power and cable")
    health = watch.look("robot", latest.of("robot"), clock.now_s())
    assert (health.state, health.says) == ("lost", "robot at 192.168.0.10: closed; check power and cable")
    assert not watch.fresh("robot", latest.of("robot"), clock.now_s())


def test_a_device_whose_clock_began_anew_has_a_rate_again(watch, latest, block, clock) -> None:
    for start in (1000, 0):
        for first in range(start, start + 100, 10):
            latest.heard("encoders", block(*range(first, first + 10)))
            health = watch.look("encoders", latest.of("encoders"), clock.now_s())
            clock.time_s += 0.1
    assert health.rate_hz == pytest.approx(100.0)
