"""Figures of ISO 10360-12:2016, articulated arm CMMs with a tactile probe.

Symbols and definitions: ISO 10360-12:2016, the figures by the titles under which makers publish them (Kreon, "ISO
10360-12 standard for measuring arms", 2020: P_Size, P_Form, L_Dia, E_Uni with these formulas). Clause numbers were not
at hand and are not invented; before a certificate the purchased standard has the word.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.verification.figure import Figure, Source, judged
from calibrate.verification.measured_lengths import Measured
from calibrate.verification.sphere import LEAST, Sphere, enclosing_diameter_m, fitted_sphere

Floats = NDArray[np.float64]
STANDARD = "ISO 10360-12:2016"
SIZE_SERIES, SIZE_TOUCHES, SIZE_SPHERES = 0, 25, 2
LOCATION_SERIES = (1, 2, 3, 4, 5)
ARTICULATIONS = 5
LENGTHS = 105  # seven positions, five lengths, three times each, as ISO 10360-2 has it: to be checked (see above)

SIZE = Source(
    STANDARD,
    "Probing size error P_Size.Sph.1x25::Tact.AArm",
    "diameter of the least-squares sphere of 25 points, less the probe's, minus the calibrated diameter; the worse of "
    "two positions of the sphere",
)
FORM = Source(
    STANDARD,
    "Probing form error P_Form.Sph.1x25::Tact.AArm",
    "largest minus smallest distance of the 25 points from the centre of their least-squares sphere; the worse of two "
    "positions of the sphere",
)
LOCATION = Source(
    STANDARD,
    "Articulated location error L_Dia.5x5:Art:Tact.AArm",
    "diameter of the smallest sphere round the centres of five least-squares spheres, of five points each, one for "
    "each articulation",
)
SEAT_LOCATION = Source(
    STANDARD,
    "Articulated location error L_Dia, taken at a seat in place of a sphere",
    "diameter of the smallest sphere round the places of the probe in one cone over all articulations; the standard's "
    "own object is a sphere",
)
LENGTH = Source(
    STANDARD,
    "Unidirectional length error E_Uni",
    "distance of the middles of both ends as measured, minus the calibrated length; permitted e_uni_m + e_uni_per_m L. "
    "105 lengths as ISO 10360-2 has it, which part 12 was not read for",
)


def figures(measured: Measured) -> tuple[Figure, ...]:
    """All that the recording allows; what it does not hold is told as such."""
    return (
        _of_spheres(measured, "P_Size", "probing size error", SIZE, measured.rig.mpe.p_size_m, _size),
        _of_spheres(measured, "P_Form", "probing form error", FORM, measured.rig.mpe.p_form_m, _form),
        _location(measured),
        _seat_location(measured),
        _length(measured),
    )


def _size(sphere: Sphere, measured: Measured, number: int) -> float:
    probe_m = measured.rig.tool.probe_diameter_m or 0.0
    return 2.0 * sphere.radius_m - probe_m - measured.rig.spheres[number].diameter_m


def _form(sphere: Sphere, measured: Measured, number: int) -> float:
    return float(np.ptp(sphere.distance_m))


def _of_spheres(
    measured: Measured,
    symbol: str,
    says: str,
    source: Source,
    permitted_m: float | None,
    value: Callable[[Sphere, Measured, int], float],
) -> Figure:
    each: list[tuple[str, float, float | None]] = []
    for (number, series), touches_m in measured.touches.items():
        if series == SIZE_SERIES and len(touches_m) >= LEAST:
            found = value(fitted_sphere(touches_m), measured, number)
            each.append((f"sphere {number}, {len(touches_m)} points", found, permitted_m))
    whole = sum(len(t) >= SIZE_TOUCHES for (_, series), t in measured.touches.items() if series == SIZE_SERIES)
    return worst_of(symbol, says, source, each, whole, SIZE_SPHERES)


def _location(measured: Measured) -> Figure:
    permitted_m = measured.rig.mpe.l_dia_m
    each: list[tuple[str, float, float | None]] = []
    most = 0
    for number in sorted({number for number, _ in measured.touches}):
        series = [measured.touches.get((number, k), np.empty((0, 3))) for k in LOCATION_SERIES]
        centres_m = [fitted_sphere(touches_m).centre_m for touches_m in series if len(touches_m) >= LEAST]
        if len(centres_m) > 1:
            diameter_m = enclosing_diameter_m(np.array(centres_m))
            each.append((f"sphere {number}, {len(centres_m)} articulations", diameter_m, permitted_m))
            most = max(most, len(centres_m))
    return worst_of("L_Dia", "articulated location error", LOCATION, each, most, ARTICULATIONS)


def _seat_location(measured: Measured) -> Figure:
    permitted_m = measured.rig.mpe.l_dia_m
    each = [
        (f"cone {number}, {len(places_m)} articulations", enclosing_diameter_m(places_m), permitted_m)
        for number, places_m in measured.seats.items()
        if len(places_m) > 1
    ]
    most = max((len(places_m) for places_m in measured.seats.values()), default=0)
    return worst_of("L_Dia at a seat", "location of the probe in a cone", SEAT_LOCATION, each, most, ARTICULATIONS)


def _length(measured: Measured) -> Figure:
    mpe = measured.rig.mpe
    each = [
        (one.says, one.error_m, None if mpe.e_uni_m is None else mpe.e_uni_m + mpe.e_uni_per_m * one.calibrated_m)
        for one in measured.lengths
    ]
    return worst_of("E_Uni", "unidirectional length error", LENGTH, each, len(each), LENGTHS)


def worst_of(
    symbol: str,
    says: str,
    source: Source,
    each: list[tuple[str, float, float | None]],
    taken: int,
    asked: int,
    also: tuple[tuple[str, float], ...] = (),
) -> Figure:
    """The value nearest to its limit, or beyond it the farthest; without limits the largest."""
    if not each:
        return Figure(symbol, says, source, "m", None, None, judged(None, None), taken, asked)
    _, value, permitted = max(each, key=lambda one: abs(one[1]) / one[2] if one[2] is not None else abs(one[1]))
    return Figure(
        symbol, says, source, "m", value, permitted, judged(value, permitted), taken, asked, tuple(each), also
    )


def refuse_without_probe(measured: Measured) -> None:
    """DataError where spheres were touched and nobody says how large the probe's ball is."""
    if measured.touches and measured.rig.tool.probe_diameter_m is None:
        raise DataError("samples: spheres were touched, but the rig's [tool] has no probe_diameter_m; add it")
