"""What geometry can absorb: the share of an effect that a fit of all links, zeros, places and frames would take away.

Derivatives by finite differences of this package's own chain. Deviations carry the drawing's sigma as a prior, so
that a direction which the data do not determine absorbs no more than a drawing allows.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import moved
from simulators.conceal.rig import Artefacts, Device, DualPsd, Spread, TrueRig

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
