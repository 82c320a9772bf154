"""Effect over noise: how much of a defect is left, in one sigmas per reading, when geometry has taken what it can.

Known lengths between the places of a fixture are the source of scale; each session has its own whitening and geometry.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import forward, jacobian
from simulators.conceal.geometry import Absorber
from simulators.conceal.observe import Observed, observe
from simulators.conceal.plan import Timetable
from simulators.conceal.rig import ENCODER_RAD, Artefacts, DualPsd, TrueRig
from simulators.conceal.rig_file import KnownDistance
from simulators.conceal.rigs import BAR_SIGMA_M, DrawnRig
from simulators.conceal.seated import seated_tip_m
from simulators.defects.defect import AnyDefect, Defect, size_of, with_size

Floats = NDArray[np.float64]
DISTANCE_SIGMA_M = 20e-6  # a length bar or a tracker over less than 2 m


def measure_distances(true: TrueRig, rng: np.random.Generator) -> list[KnownDistance]:
    """Each place measured against the one before, and the last against the first."""
    instrument = true.instrument
    if not isinstance(instrument, DualPsd) or len(instrument.places) < 2:
        return []
    count = len(instrument.places)
    pairs = [(k, k + 1) for k in range(1, count)] + ([(1, count)] if count > 2 else [])
    centre_m = instrument.places[:, :3, 3]
    return [
        KnownDistance(
            a,
            b,
            float(np.linalg.norm(centre_m[a - 1] - centre_m[b - 1]) + DISTANCE_SIGMA_M * rng.standard_normal()),
            DISTANCE_SIGMA_M,
        )
        for a, b in pairs
    ]


def in_sigmas(rig: TrueRig, distances: Sequence[KnownDistance]) -> Floats:
    """The same lengths of any rig, each in units of its sigma, (distance,)."""
    if not isinstance(rig.instrument, DualPsd):
        return np.empty(0)
    centre_m = rig.instrument.places[:, :3, 3]
    return np.array(
        [float(np.linalg.norm(centre_m[one.first - 1] - centre_m[one.second - 1])) / one.sigma_m for one in distances]
    )


Watch = Callable[[Sequence[Defect]], Observed]  # the session with these defects, noise-free
Whiten = Callable[[Floats], Floats]  # change of the readings (row, channel) in sigmas, flat
# Times the typical size: beyond, a mechanism would be found with the naked eye. Where a material sets a bound, the
# mechanism states its own LARGEST.
FARTHEST = 12.0
INVISIBLE = 0.05  # effect over noise of the largest plausible size: geometry takes it all, and size does not matter
STEPS = 3  # most effects are in proportion to their size; the rest need another try or two


@dataclass(frozen=True, eq=False)
class Scale:
    """One session's measure of how strong a defect is."""

    watch: Watch
    whiten: Whiten
    absorber: Absorber
    perfect: Observed

    def enr(self, defects: Sequence[Defect]) -> float:
        """Rms of what geometry leaves of these defects, over the noise."""
        change = self.whiten(self.watch(defects).values_m - self.perfect.values_m)
        return float(np.sqrt(np.mean(self.absorber.left_over(change) ** 2)))

    def raw(self, defects: Sequence[Defect]) -> float:
        """The same before geometry takes its share."""
        change = self.whiten(self.watch(defects).values_m - self.perfect.values_m)
        return float(np.sqrt(np.mean(change**2)))

    def brought_to(self, defect: AnyDefect, enr: float) -> tuple[AnyDefect, float]:
        """The defect with about this effect over noise, and what it truly has; no more than plausible.

        One that no plausible size would show keeps the size that it was drawn with.
        """
        drawn, most = defect, float(getattr(defect, "LARGEST", FARTHEST * defect.TYPICAL))
        for _ in range(STEPS):
            found = self.enr([defect])
            if found <= 0.0 or not np.isfinite(found):
                return drawn, 0.0
            size = float(np.clip(size_of(defect) * enr / found, -most, most))
            defect = with_size(defect, size)
        reached = self.enr([defect])
        return (defect, reached) if reached > INVISIBLE else (drawn, self.enr([drawn]))


def scale_of(
    drawn: DrawnRig,
    table: Timetable,
    watch: Callable[[Sequence[Defect]], Observed],
    sigma_m: float,
    distances: Sequence[KnownDistance],
) -> Scale:
    """Whitened predictions of any geometry for the readings of a session without defects."""
    perfect = watch(())
    seated = isinstance(drawn.true.instrument, Artefacts)
    whiteners = _seat_whiteners(drawn.true, perfect.reading_rad, sigma_m) if seated else None

    def whiten(change_m: Floats) -> Floats:
        scaled = change_m / sigma_m if whiteners is None else np.einsum("rij,rj->ri", whiteners, change_m)
        return scaled.ravel()

    def predict(rig: TrueRig) -> Floats:
        values_m = observe(rig, table.scene, (), perfect.reading_rad, wire=perfect.values_m.shape[1] == 1).values_m
        return np.concatenate((whiten(values_m), in_sigmas(rig, distances)))

    def predict_seated(rig: TrueRig) -> Floats:
        assert isinstance(rig.instrument, Artefacts)  # noqa: S101 - narrows the type
        misses = whiten(seated_tip_m(rig, perfect.reading_rad) - rig.instrument.seat_m[table.scene.seat - 1])
        return np.concatenate((misses, rig.instrument.ends_m() / BAR_SIGMA_M))

    absorber = Absorber(drawn.true, drawn.spread, predict_seated if seated else predict)
    return Scale(watch, whiten, absorber, perfect)


def _seat_whiteners(true: TrueRig, reading_rad: Floats, sigma_m: float) -> Floats:
    """(row, 3, 3): inverse roots of the covariance of seat and encoders together, s^2 I + e^2 J J^T."""
    frames = forward(true.arm, reading_rad + true.arm.zero_rad)
    tip_m = frames.flange[:, :3, :3] @ true.tool_point_m + frames.flange[:, :3, 3]
    slope = jacobian(frames, tip_m)[:, :3]
    covariance = sigma_m**2 * np.eye(3) + ENCODER_RAD**2 * slope @ slope.swapaxes(-1, -2)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)), dtype=np.float64)
