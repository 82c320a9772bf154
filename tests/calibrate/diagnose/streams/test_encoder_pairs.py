"""Encoders on one shaft against each other: what the simulated discs truly are is found."""

import numpy as np
import pytest

from calibrate.diagnose.streams import StreamDevice, Track
from calibrate.diagnose.streams.encoder_pairs import EncoderPair, examine_encoders, pace_of
from simulators.defects.encoder import RADIUS_M
from simulators.encoders.shaft import ShaftTruth, ShaftWorld

SLIP_S, SLIP_RAD = 17.3, 1e-3


def rows(
    seed: int, for_s: float = 40.0, slip_rad: float = 0.0, off_m: float = 20e-6
) -> tuple[StreamDevice, ShaftTruth]:
    emulation = {"disc_eccentricity_m": off_m, "encoder_noise_rad": 5e-6}
    world = ShaftWorld.from_rig({"devices": {"encoders": {"nodes": [1, 2, 3]}}, "emulation": emulation}, seed=seed)
    time_s = np.linspace(0.01, for_s, round(100.0 * for_s))
    values = np.empty((len(time_s), 3))
    for row, at_s in enumerate(time_s):
        world.advance(float(at_s))
        if abs(at_s - SLIP_S) < 1e-6 and slip_rad:
            world.slip(2, slip_rad)
        values[row] = world.link_encoders_rad()
    return StreamDevice(Track("encoders", "rad", time_s, values), np.arange(len(time_s)), time_s), world.truth


def once_rad(truth: ShaftTruth, pair: EncoderPair) -> float:
    """Of both discs together, first order of eccentricity over radius."""
    off = [
        disc.eccentricity_m / RADIUS_M * np.exp(1j * (disc.bearing_rad - zero))
        for disc, zero in zip(truth.discs, truth.joint_zero_rad, strict=True)
    ]
    return float(abs(off[pair.number - 1] - off[0]))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("slip_rad", [0.0, SLIP_RAD])
def test_eccentricity_noise_and_slip_are_those_of_the_discs(seed: int, slip_rad: float) -> None:
    device, truth = rows(seed, slip_rad=slip_rad)
    for pair in examine_encoders(device)[1]:
        assert pair.once_rad is not None
        assert pair.once_rad.value == pytest.approx(once_rad(truth, pair), rel=2e-3, abs=5.0 * pair.once_rad.sigma)
        assert pair.noise_rad == pytest.approx(5e-6, rel=0.1)
    second, third = examine_encoders(device)[1]
    assert third.slips == ()
    assert len(second.slips) == (slip_rad != 0.0)
    for slip in second.slips:
        assert slip.from_s < SLIP_S <= slip.to_s
        assert slip.size_rad == pytest.approx(SLIP_RAD, abs=10e-6)


def test_centred_discs_have_a_limit_and_no_eccentricity() -> None:
    device, _ = rows(1, off_m=0.0)
    for pair in examine_encoders(device)[1]:
        assert pair.once_rad is not None
        assert pair.once_rad.value < 5.0 * pair.once_rad.sigma < 5e-6


def test_what_the_motion_does_not_show_has_a_reason() -> None:
    device, _ = rows(2, for_s=9.0)
    first = device.track.take(slice(0, 100))
    short = StreamDevice(first, device.sequence[:100], first.time_s)
    assert "fewer than 800 rows" in examine_encoders(short)[1][0].why
    still = StreamDevice(
        Track("encoders", "rad", device.track.time_s, 0.05 * device.track.values), device.sequence, device.host_s
    )
    assert "not 360°" in examine_encoders(still)[1][0].why
    values = device.track.values.copy()
    values[:, 1] *= 1.7
    other = StreamDevice(Track("encoders", "rad", device.track.time_s, values), device.sequence, device.host_s)
    assert "does not follow encoder 1" in examine_encoders(other)[1][0].why


def test_pace_leaves_missing_rows_out() -> None:
    time_s = np.array([0.0, 0.010, 0.021, 0.050, 0.060])
    sequence = np.array([0, 1, 2, 5, 6])
    pace = pace_of(StreamDevice(Track("encoders", "rad", time_s, np.zeros((5, 1))), sequence, time_s))
    assert pace is not None
    assert pace.period_s == pytest.approx(0.010, abs=1e-4)
    assert pace.jitter_s == pytest.approx(np.std([0.010, 0.011, 0.010]), rel=1e-9)
    assert pace.longest_s == pytest.approx(0.029)


def test_a_shaft_that_stands_is_no_encoder_that_does_not_follow() -> None:
    time_s = 0.01 * np.arange(4000.0)
    drifting = np.round(np.stack([np.zeros(4000), 1e-4 * np.sin(0.1 * time_s)], axis=1) / 2e-5) * 2e-5
    pair = examine_encoders(StreamDevice(Track("encoders", "rad", time_s, drifting), np.arange(4000), time_s))[1][0]
    assert pair.why == "eccentricity: the shaft turns through 0°, not 360°"
