"""Laws that every fault of streams keeps, and what each does to the streams of a session."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from simulators.conceal.case import Case, conceal
from simulators.conceal.wanted import Wanted
from simulators.streams.faults import (
    FAULTS,
    EarlyReading,
    LaggingEncoder,
    LateStamps,
    SlippingEncoder,
    StreamFault,
    SwingingFoot,
)
from simulators.streams.stream_session import DARK_A, EPOCH_S, HOST_S, StreamedSession, photocurrents_a, streamed

PORTS = {"time", "base.pose", *(f"joint{i}.angle" for i in range(1, 7))}
PHYSICS = {"latency", "reading-lag", "encoder-slip", "not-settled", "ringing"}
Stream = Callable[..., StreamedSession]


@pytest.fixture(scope="module")
def case() -> Case:
    return conceal(Wanted("dual-psd", seed=3, samples=30, places=3))


@pytest.fixture(scope="module")
def with_fault(case: Case) -> Stream:
    return cache(lambda fault=None: streamed(case, fault, np.random.default_rng(8)))


@pytest.mark.parametrize("kind", FAULTS, ids=lambda kind: kind.KIND)
def test_it_speaks_the_words_of_the_format(kind: type[StreamFault]) -> None:
    for seed in range(5):
        fault = kind.draw(np.random.default_rng(seed), 6)
        assert fault.port in PORTS
        assert kind.PHYSICS in PHYSICS
        assert fault.figures
        assert fault.size > 1.0  # what nobody could see would prove nothing


def test_names_are_unique() -> None:
    assert len({kind.KIND for kind in FAULTS}) == len(FAULTS)


def test_devices_have_clocks_of_their_own_and_the_host_stamps_late(with_fault: Stream) -> None:
    for stream in with_fault().streams.values():
        true_s = (stream.device_s - stream.clock.epoch_s) / (1.0 + stream.clock.rate)
        assert 0.0 <= stream.clock.epoch_s <= EPOCH_S
        assert np.all(stream.host_s > HOST_S + true_s)
        assert np.all(np.diff(stream.host_s) >= 0.0)


def test_samples_are_read_while_the_spots_lie_on_both_faces(with_fault: Stream) -> None:
    session = with_fault()
    psd = session.streams["psd"]
    for from_s, to_s in session.window_s:
        read = psd.values["photocurrent_a"][(psd.device_s >= from_s) & (psd.device_s <= to_s)]
        assert len(read) > 20
        assert np.all(read.sum(axis=1) > 100.0 * DARK_A)


def test_late_stamps_are_on_the_encoders_alone(with_fault: Stream) -> None:
    late, none = with_fault(LateStamps(4e-3, 6)).streams, with_fault().streams
    for name, by_s in (("encoders", 4e-3), ("robot", 0.0)):
        assert late[name].host_s[0] - none[name].host_s[0] == pytest.approx(by_s, abs=1e-9)


def test_a_slip_stays_and_a_lag_does_not(with_fault: Stream) -> None:
    plain = with_fault().streams["encoders"].values["position_rad"]
    slipped = with_fault(SlippingEncoder(2, 1e-4, 0.5)).streams["encoders"].values["position_rad"]
    half = len(plain) // 2
    assert slipped[half + 2 :, 1] - plain[half + 2 :, 1] == pytest.approx(
        1e-4, abs=2e-8
    )  # the disc is read a slip further
    assert slipped[: half - 2] == pytest.approx(plain[: half - 2], abs=1e-12)
    lagging = with_fault(LaggingEncoder(3, 4e-3)).streams["encoders"].values["position_rad"]
    behind = np.abs(lagging[:, 2] - plain[:, 2])
    assert behind.max() > 1e-3  # 4 ms at some 1 rad/s
    assert np.median(behind[:50]) < 1e-9


def test_an_early_reading_comes_before_the_spots_stand(with_fault: Stream) -> None:
    fault = EarlyReading(3e-4, 0.1, 0.03, 6)
    early, patient = with_fault(fault), with_fault()
    assert np.all(early.read_s < patient.read_s)
    moved_a = early.streams["psd"].values["photocurrent_a"] - patient.streams["psd"].values["photocurrent_a"]
    assert np.abs(moved_a).max() > 1e-7


def test_a_swinging_foot_moves_the_spots_and_no_reading(with_fault: Stream) -> None:
    swinging, plain = with_fault(SwingingFoot(9.0, 0.03, 5e-5, (1.0, 0.0, 0.0))).streams, with_fault().streams
    assert np.array_equal(swinging["robot"].values["actual_q_rad"], plain["robot"].values["actual_q_rad"])
    assert not np.array_equal(swinging["psd"].values["photocurrent_a"], plain["psd"].values["photocurrent_a"])


def test_photocurrents_say_the_spot_by_the_duo_lateral_formula() -> None:
    spot_m = np.array([[1e-3, -2e-3, 3e-3, 4e-3], [0.0, 0.0, 0.011, 0.0]])
    a = photocurrents_a(spot_m, 0.01).reshape(-1, 2, 2, 2)
    said = 0.01 * (a[..., 1] - a[..., 0]) / a.sum(axis=3)
    assert said[0].ravel() == pytest.approx(spot_m[0], abs=1e-15)
    assert np.all(a[1, 1] == DARK_A)  # off its face: both axes are dark
