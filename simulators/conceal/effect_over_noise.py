"""Effect over noise: how much of a defect is left, in one sigmas per reading, when geometry has absorbed what it can.

Known lengths between the stations of a fixture are the source of scale; each session has its own whitening and
geometry.

Geometry absorbs the share of an effect that a fit of all links, zeros, stations and frames would take away. Derivatives
are finite differences of this package's own chain. Deviations carry the tolerance sigma as a prior, so that a direction
which the data do not determine absorbs no more than a tolerance allows.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import forward, jacobian, moved
from simulators.conceal.observe import Observed, observe, seated_tip_m
from simulators.conceal.plan import Timetable
from simulators.conceal.rig import ENCODER_RAD, Artefacts, Device, DualPsd, Spread, TrueRig
from simulators.conceal.rig_file import KnownDistance
from simulators.conceal.rigs import BAR_SIGMA_M, DrawnRig
from simulators.defects.defect import AnyDefect, Defect, size_of, with_size

Floats = NDArray[np.float64]
Predict = Callable[[TrueRig], Floats]  # whitened predictions, flat
FREE_M, FREE_RAD = 0.1, 0.2  # of what is found on site: places, device, seats
STEP = 1e-6  # m, rad: central differences, errors of 1e-12 relative to curvature of about 1/m


@dataclass(frozen=True)
class Deviation:
    """One way in which the true rig may lie off its drawing."""

    name: str
    sigma: float
    apply: Callable[[TrueRig, float], TrueRig]


class Absorber:
    """Projects the part of an effect that geometry cannot take away."""

    def __init__(self, rig: TrueRig, spread: Spread, predict: Predict) -> None:
        deviations = list_deviations(rig, spread)
        columns = [
            (predict(one.apply(rig, STEP)) - predict(one.apply(rig, -STEP))) * (one.sigma / (2.0 * STEP))
            for one in deviations
        ]
        self._basis = np.linalg.qr(np.concatenate((np.stack(columns, axis=1), np.eye(len(columns)))))[0]

    def left_over(self, effect: Floats) -> Floats:
        """`effect`: whitened change of the predictions, flat; returns what no geometry explains, of the same shape."""
        basis = self._basis[: effect.size]  # further rows are known lengths, which no defect changes
        return effect - basis @ (basis.T @ effect)


def list_deviations(rig: TrueRig, spread: Spread) -> list[Deviation]:
    """Six motions of every link, the tool or laser, and everything that stands around."""
    found: list[Deviation] = []
    for link in range(len(rig.arm.fixed)):
        for axis in range(6):
            sigma = (
                spread.length_m
                if axis < 3
                else spread.angle_rad
                if axis < 5
                else max(spread.zero_rad, spread.angle_rad)
            )
            found.append(Deviation(f"link{link}.{axis}", sigma, _link(link, axis)))
    instrument = rig.instrument
    if isinstance(instrument, DualPsd):
        return found + _dual(instrument, spread)
    found += [Deviation(f"tool.{axis}", spread.tool_m, _tool(axis)) for axis in range(3)]
    if isinstance(instrument, Device):
        found += [Deviation(f"device.{axis}", FREE_M if axis < 3 else FREE_RAD, _device(axis)) for axis in range(6)]
    else:
        seats = range(len(instrument.seat_m))
        found += [Deviation(f"seat{k + 1}.{axis}", FREE_M, _seat(k, axis)) for k in seats for axis in range(3)]
    return found


def _dual(fixture: DualPsd, spread: Spread) -> list[Deviation]:
    found = [
        Deviation(f"laser.{axis}", spread.tool_m if axis < 3 else spread.laser_rad, _laser(axis)) for axis in range(6)
    ]
    found += [
        Deviation(f"psd2.{axis}", spread.psd2_m if axis < 3 else spread.psd2_rad, _psd2(axis)) for axis in range(6)
    ]
    for place in range(len(fixture.places)):
        found += [
            Deviation(f"place{place + 1}.{axis}", FREE_M if axis < 3 else FREE_RAD, _place(place, axis))
            for axis in range(6)
        ]
    return found


def _small(axis: int, size: float) -> Floats:
    six = np.zeros(6)
    six[axis] = size
    return moved(six[:3], six[3:])


def _link(link: int, axis: int) -> Callable[[TrueRig, float], TrueRig]:
    def apply(rig: TrueRig, size: float) -> TrueRig:
        fixed = rig.arm.fixed.copy()
        fixed[link] = fixed[link] @ _small(axis, size)
        return replace(rig, arm=replace(rig.arm, fixed=fixed))

    return apply


def _tool(axis: int) -> Callable[[TrueRig, float], TrueRig]:
    return lambda rig, size: replace(rig, tool_point_m=rig.tool_point_m + size * np.eye(3)[axis])


def _device(axis: int) -> Callable[[TrueRig, float], TrueRig]:
    def apply(rig: TrueRig, size: float) -> TrueRig:
        assert isinstance(rig.instrument, Device)  # noqa: S101 - narrows the type
        return replace(rig, instrument=Device(rig.instrument.pose @ _small(axis, size)))

    return apply


def _seat(seat: int, axis: int) -> Callable[[TrueRig, float], TrueRig]:
    def apply(rig: TrueRig, size: float) -> TrueRig:
        assert isinstance(rig.instrument, Artefacts)  # noqa: S101 - narrows the type
        seat_m = rig.instrument.seat_m.copy()
        seat_m[seat, axis] += size
        return replace(rig, instrument=replace(rig.instrument, seat_m=seat_m))

    return apply


def _on_fixture(change: Callable[[DualPsd, float], DualPsd]) -> Callable[[TrueRig, float], TrueRig]:
    def apply(rig: TrueRig, size: float) -> TrueRig:
        assert isinstance(rig.instrument, DualPsd)  # noqa: S101 - narrows the type
        return replace(rig, instrument=change(rig.instrument, size))

    return apply


def _laser(axis: int) -> Callable[[TrueRig, float], TrueRig]:
    def change(fixture: DualPsd, size: float) -> DualPsd:
        if axis < 3:
            return replace(fixture, laser_origin_m=fixture.laser_origin_m + size * np.eye(3)[axis])
        turned = moved(np.zeros(3), size * np.eye(3)[axis - 3])[:3, :3]
        return replace(fixture, laser_direction=turned @ fixture.laser_direction)

    return _on_fixture(change)


def _psd2(axis: int) -> Callable[[TrueRig, float], TrueRig]:
    return _on_fixture(lambda fixture, size: replace(fixture, psd2_in_psd1=fixture.psd2_in_psd1 @ _small(axis, size)))


def _place(place: int, axis: int) -> Callable[[TrueRig, float], TrueRig]:
    def change(fixture: DualPsd, size: float) -> DualPsd:
        places = fixture.places.copy()
        places[place] = places[place] @ _small(axis, size)
        return replace(fixture, places=places)

    return _on_fixture(change)


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
