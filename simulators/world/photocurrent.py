"""From light on a face to the four currents of a duo-lateral detector, with noise.

    X1 + X2 = Y1 + Y2 = S = responsivity * absorbed power
    x = (L/2) (X2 - X1) / (X1 + X2),   y likewise,   L the length of the face

Source: On-Trak Photonics, "PSD theory", duo-lateral type (sign as in the DAQ protocol: X2 grows with x).

Noise: what limits a spot in a workshop is not the amplifier but air and vibration, hence noise of position, the same
at any brightness. One current with sigma s moves the position by (L/2)/S sqrt(2 (1 + u^2)) s with u = x / (L/2), so
each current gets s = psd_noise S / ((L/2) sqrt(2 (1 + u^2))), which is also how an amplifier behind an automatic range
behaves. White in time: sigma grows with the root of the sampling rate. A dark face has the noise of its amplifier.

What the detectors saw since the last advance, one knot a physics step, for samples that fall in between.

Currents are worked out only when somebody samples; a straight line between two knots is exact for a spot that moves
evenly (at 1 rad/s and 1 m it bends by less than 1 um in a millisecond) and shows a beam that runs off a face as a
short fall of the sum.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from simulators.world.model import STEP_S
from simulators.world.optics import Ray, Spot, Spots

Floats = NDArray[np.float64]
RESPONSIVITY_A_W = 0.4  # silicon at 635 nm; On-Trak duo-lateral data sheets, typical curve
SATURATION_A = 500e-6  # an electrode's current ends here: range of the DAQ's transimpedance stage, above 1 mW full on
DARK_NOISE_A = 2e-9  # sigma of one sample at 1 kHz in the dark; a few ppm of the range
NOISE_RATE_HZ = 1000.0  # the rate for which psd_noise_m and DARK_NOISE_A are stated
ELECTRODES = 8  # psd1 x1, x2, y1, y2, psd2 x1, x2, y1, y2


class Photodetectors:
    """Both detectors of a fixture: spots to mean currents and their noise, those to samples."""

    def __init__(self, half_size_m: float, laser_power_w: float, noise_m: float) -> None:
        self._half_size_m = half_size_m
        self._full_a = RESPONSIVITY_A_W * laser_power_w
        self._noise_of_range = noise_m / (half_size_m * math.sqrt(2.0))

    def see(self, spots: Spots) -> Floats:
        """(2, 8) A: mean currents, and the sigma of one sample of each at NOISE_RATE_HZ."""
        first_a, first_sigma_a = self._four(spots.psd1)
        second_a, second_sigma_a = self._four(spots.psd2)
        return np.array((first_a + second_a, first_sigma_a + second_sigma_a))

    def _four(self, spot: Spot | None) -> tuple[list[float], list[float]]:
        """Means and sigmas of x1, x2, y1, y2."""
        if spot is None or self._full_a == 0.0:
            return [0.0] * 4, [DARK_NOISE_A] * 4
        half_a = 0.5 * self._full_a * spot.share
        u, v = spot.x_m / self._half_size_m, spot.y_m / self._half_size_m
        sigma_a = 2.0 * half_a * self._noise_of_range
        along_x_a, along_y_a = sigma_a / math.sqrt(1.0 + u * u), sigma_a / math.sqrt(1.0 + v * v)
        return (
            [half_a * (1.0 - u), half_a * (1.0 + u), half_a * (1.0 - v), half_a * (1.0 + v)],
            [along_x_a, along_x_a, along_y_a, along_y_a],
        )


def sample_a(seen: Floats, rate_hz: float, rng: np.random.Generator, count: int | None = None) -> Floats:
    """Noisy, clipped currents (sample, 8) A for what was seen, (sample, 2, 8) A; draws 8 numbers a sample, in order.

    With a `count`, `seen` is (1, 2, 8) and all samples see the same.
    """
    noisy_a = rng.standard_normal((len(seen) if count is None else count, ELECTRODES))
    noisy_a *= (rate_hz / NOISE_RATE_HZ) ** 0.5 * seen[:, 1]
    noisy_a += seen[:, 0]
    np.maximum(noisy_a, -SATURATION_A, out=noisy_a)
    return np.minimum(noisy_a, SATURATION_A, out=noisy_a)


EDGE_S = 1e-9  # rounding of times that are multiples of a sampling interval
ON_KNOT = EDGE_S / STEP_S


class Knot:
    """The beam at one physics step; what the detectors see of it, (2, 8) A, is found once."""

    __slots__ = ("_seen", "beam")

    def __init__(self, beam: Ray) -> None:
        self.beam = beam
        self._seen: Floats | None = None

    def seen(self, see: Callable[[Ray], Floats]) -> Floats:
        if self._seen is None:
            self._seen = see(self.beam)
        return self._seen


def interpolate(knots: list[Knot], start_s: float, times_s: list[float], see: Callable[[Ray], Floats]) -> Floats:
    """Mean currents and their sigma at times, (sample, 2, 8) A; the last knot holds on for as long as the arm stands.

    A loop, because a tick has a few samples only and most of them fall on a knot.
    """
    return np.array([_at((time_s - start_s) / STEP_S, knots, see) for time_s in times_s])


def _at(place: float, knots: list[Knot], see: Callable[[Ray], Floats]) -> Floats:
    before = int(place + ON_KNOT)
    if before >= len(knots) - 1:
        return knots[-1].seen(see)
    share = place - before
    if share <= ON_KNOT:
        return knots[before].seen(see)
    return (1.0 - share) * knots[before].seen(see) + share * knots[before + 1].seen(see)
