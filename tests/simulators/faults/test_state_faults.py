"""Faults that last: the device's clock and the light on its faces."""

import numpy as np
import pytest

from simulators.faults.device_faults import DisturbedLight, Target
from simulators.faults.injector import Injector
from simulators.wire import TICK_S, DeviceClock


class Lit:
    """A world with a tenth of a milliampere on every electrode."""

    time_s = 3.0

    def photocurrents_a(self, times_s) -> np.ndarray:
        return np.full((len(times_s), 8), 1e-4)


@pytest.fixture
def light() -> DisturbedLight:
    return DisturbedLight(Lit())


@pytest.fixture
def clock() -> DeviceClock:
    return DeviceClock()


@pytest.fixture
def faults(light, clock) -> Injector:
    return Injector("psd", Target(clock, light))


def run(faults: Injector, cycles: int, from_s: float = 0.0) -> None:
    for cycle in range(cycles):
        faults.before_step(from_s + cycle * TICK_S)


def test_a_clock_steps_and_drifts_from_the_moment_on(faults, clock) -> None:
    run(faults, 1, from_s=10.0)
    faults.inject("clock", None, 1, None, {"step_s": 0.5, "drift": 0.01})
    assert clock.tells(10.0) == pytest.approx(10.5)
    assert clock.tells(20.0) == pytest.approx(20.6)
    faults.clear()
    assert clock.tells(20.0) == 20.0


def test_a_clock_is_right_again_after_its_cycles(faults, clock) -> None:
    faults.inject("clock", 5, 1, None, {"step_s": -1.0})
    run(faults, 4)
    assert clock.tells(2.0) == 1.0
    run(faults, 1)
    assert clock.tells(2.0) == 2.0


def test_the_spot_off_the_face_leaves_no_current(faults, light) -> None:
    faults.inject("spot-off", 2, 1, None, {})
    assert not light.photocurrents_a([0.0]).any()
    run(faults, 2)
    assert light.photocurrents_a([0.0])[0, 0] == 1e-4


def test_saturating_light_is_beyond_every_converter(faults, light) -> None:
    faults.inject("saturation", None, 1, None, {})
    assert light.photocurrents_a([0.0]).min() > 0.1


def test_faults_that_overlap_end_each_by_itself(faults, light, clock) -> None:
    """The shorter one ends inside the longer: the longer lasts; then all is well."""
    faults.inject("spot-off", 4, 1, None, {})
    faults.inject("saturation", 2, 1, None, {})
    faults.inject("clock", 4, 1, None, {"step_s": 0.5})
    faults.inject("clock", 2, 1, None, {"step_s": 2.0})
    assert (light.photocurrents_a([0.0])[0, 0], clock.tells(1.0)) == (0.0, 3.5)
    run(faults, 2)
    assert (light.photocurrents_a([0.0])[0, 0], clock.tells(1.0)) == (0.0, 1.5)
    run(faults, 2)
    assert (light.photocurrents_a([0.0])[0, 0], clock.tells(1.0)) == (1e-4, 1.0)


def test_everything_else_of_the_world_shows_through(light) -> None:
    assert light.time_s == 3.0
