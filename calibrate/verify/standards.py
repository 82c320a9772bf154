"""Figures of two standards for articulated arm CMMs with a tactile probe: ISO 10360-12:2016 and ASME B89.4.22-2004.

ISO 10360-12: the figures by the titles under which makers publish them (Kreon, "ISO 10360-12 standard for measuring
arms", 2020: P_Size, P_Form, L_Dia, E_Uni with these formulas). B89.4.22 (reaffirmed 2019): three tests by their titles,
effective diameter, single-point articulation and volumetric performance. Clause numbers were not at hand and are not
invented; a certificate needs the purchased standard.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.verify.measured_lengths import (
    LEAST,
    BallPlaces,
    Figure,
    Source,
    Sphere,
    enclosing_diameter_m,
    fitted_sphere,
    judged,
)

Floats = NDArray[np.float64]
ISO_10360_12 = "ISO 10360-12:2016"
SIZE_SERIES, SIZE_TOUCHES, SIZE_SPHERES = 0, 25, 2
LOCATION_SERIES = (1, 2, 3, 4, 5)
ISO_ARTICULATIONS = 5
LENGTHS = 105  # seven positions, five lengths, three times each, as ISO 10360-2 has it: to be checked (see above)

SIZE = Source(
    ISO_10360_12,
    "Probing size error P_Size.Sph.1x25::Tact.AArm",
    "diameter of the least-squares sphere of 25 points, less the probe's, minus the calibrated diameter; the worse of "
    "two positions of the sphere",
)
FORM = Source(
    ISO_10360_12,
    "Probing form error P_Form.Sph.1x25::Tact.AArm",
    "largest minus smallest distance of the 25 points from the centre of their least-squares sphere; the worse of two "
    "positions of the sphere",
)
LOCATION = Source(
    ISO_10360_12,
    "Articulated location error L_Dia.5x5:Art:Tact.AArm",
    "diameter of the smallest sphere round the centres of five least-squares spheres, of five points each, one for "
    "each articulation",
)
SEAT_LOCATION = Source(
    ISO_10360_12,
    "Articulated location error L_Dia, taken at a seat in place of a sphere",
    "diameter of the smallest sphere round the places of the probe in one cone over all articulations; the standard's "
    "own object is a sphere",
)
LENGTH = Source(
    ISO_10360_12,
    "Unidirectional length error E_Uni",
    "distance of the middles of both ends as measured, minus the calibrated length; permitted e_uni_m + e_uni_per_m L. "
    "105 lengths as ISO 10360-2 has it, which part 12 was not read for",
)


def iso10360_12_figures(measured: BallPlaces) -> tuple[Figure, ...]:
    """All that the recording allows; what it does not hold is reported as such."""
    return (
        _of_spheres(measured, "P_Size", "probing size error", SIZE, measured.rig.mpe.p_size_m, _size),
        _of_spheres(measured, "P_Form", "probing form error", FORM, measured.rig.mpe.p_form_m, _form),
        _location(measured),
        _seat_location(measured),
        _length(measured),
    )


def _size(sphere: Sphere, measured: BallPlaces, number: int) -> float:
    probe_m = measured.rig.tool.probe_diameter_m or 0.0
    return 2.0 * sphere.radius_m - probe_m - measured.rig.spheres[number].diameter_m


def _form(sphere: Sphere, measured: BallPlaces, number: int) -> float:
    return float(np.ptp(sphere.distance_m))


def _of_spheres(
    measured: BallPlaces,
    symbol: str,
    says: str,
    source: Source,
    permitted_m: float | None,
    value: Callable[[Sphere, BallPlaces, int], float],
) -> Figure:
    each: list[tuple[str, float, float | None]] = []
    for (number, series), touches_m in measured.touches.items():
        if series == SIZE_SERIES and len(touches_m) >= LEAST:
            found = value(fitted_sphere(touches_m), measured, number)
            each.append((f"sphere {number}, {len(touches_m)} points", found, permitted_m))
    whole = sum(len(t) >= SIZE_TOUCHES for (_, series), t in measured.touches.items() if series == SIZE_SERIES)
    return worst_of(symbol, says, source, each, whole, SIZE_SPHERES)


def _location(measured: BallPlaces) -> Figure:
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
    return worst_of("L_Dia", "articulated location error", LOCATION, each, most, ISO_ARTICULATIONS)


def _seat_location(measured: BallPlaces) -> Figure:
    permitted_m = measured.rig.mpe.l_dia_m
    each = [
        (f"cone {number}, {len(places_m)} articulations", enclosing_diameter_m(places_m), permitted_m)
        for number, places_m in measured.seats.items()
        if len(places_m) > 1
    ]
    most = max((len(places_m) for places_m in measured.seats.values()), default=0)
    return worst_of("L_Dia at a seat", "location of the probe in a cone", SEAT_LOCATION, each, most, ISO_ARTICULATIONS)


def _length(measured: BallPlaces) -> Figure:
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


def refuse_without_probe(measured: BallPlaces) -> None:
    """DataError where spheres were touched and the size of the probe's ball is not stated."""
    if measured.touches and measured.rig.tool.probe_diameter_m is None:
        raise DataError("samples: spheres were touched, but the rig's [tool] has no probe_diameter_m; add it")


B89_4_22 = "ASME B89.4.22-2004"
DIAMETER_SERIES, DIAMETER_TOUCHES, DIAMETER_TIMES = (6, 7, 8), 9, 3
B89_ARTICULATIONS = 10
POSITIONS = 20

DIAMETER = Source(
    B89_4_22,
    "Effective diameter performance test",
    "diameter of the least-squares sphere of nine points, less the probe's, minus the calibrated diameter; the largest "
    "of three measurements",
)
SINGLE_POINT = Source(
    B89_4_22,
    "Single-point articulation performance test",
    "d_i distance of place i of the probe in the seat from the mean place; s = sqrt(sum d_i^2 / (n - 1)), reported as "
    "2 s with the largest d_i; ten articulations",
)
VOLUMETRIC = Source(
    B89_4_22,
    "Volumetric performance test",
    "length of a ball bar as measured minus calibrated, in twenty positions: the largest; beside it the range and "
    "twice the root mean square",
)


def b89_4_22_figures(measured: BallPlaces) -> tuple[Figure, ...]:
    """All that the recording allows; what it does not hold is reported as such."""
    return (_diameter(measured), _single_point(measured), _volumetric(measured))


def _diameter(measured: BallPlaces) -> Figure:
    probe_m, permitted_m = measured.rig.tool.probe_diameter_m or 0.0, measured.rig.mpe.effective_diameter_m
    each: list[tuple[str, float, float | None]] = []
    for (number, series), touches_m in measured.touches.items():
        if series in DIAMETER_SERIES and len(touches_m) >= DIAMETER_TOUCHES:
            diameter_m = 2.0 * fitted_sphere(touches_m).radius_m - probe_m
            deviation_m = diameter_m - measured.rig.spheres[number].diameter_m
            each.append((f"sphere {number}, {len(touches_m)} points", deviation_m, permitted_m))
    says = "deviation of the effective diameter"
    return worst_of("effective diameter", says, DIAMETER, each, len(each), DIAMETER_TIMES)


def _single_point(measured: BallPlaces) -> Figure:
    permitted_m = measured.rig.mpe.single_point_m
    each: list[tuple[str, float, float | None]] = []
    farthest_m, most = 0.0, 0
    for number, places_m in measured.seats.items():
        if len(places_m) > 1:
            apart_m = np.linalg.norm(places_m - places_m.mean(axis=0), axis=1)
            twice_s_m = 2.0 * float(np.sqrt(np.sum(apart_m**2) / (len(apart_m) - 1)))
            each.append((f"cone {number}, {len(apart_m)} articulations", twice_s_m, permitted_m))
            farthest_m, most = max(farthest_m, float(apart_m.max())), max(most, len(apart_m))
    also = (("largest distance from the mean", farthest_m),) if each else ()
    return worst_of(
        "single point (2 s)", "scatter of the probe in a seat", SINGLE_POINT, each, most, B89_ARTICULATIONS, also
    )


def _volumetric(measured: BallPlaces) -> Figure:
    permitted_m = measured.rig.mpe.volumetric_m
    errors_m = np.array([length.error_m for length in measured.lengths])
    each = [(length.says, length.error_m, permitted_m) for length in measured.lengths]
    positions = len({length.position for length in measured.lengths})
    also: tuple[tuple[str, float], ...] = ()
    if len(errors_m):
        twice_rms_m = 2.0 * float(np.sqrt(np.mean(errors_m**2)))
        also = (("range", float(np.ptp(errors_m))), ("twice the root mean square", twice_rms_m))
    return worst_of("volumetric", "deviation of ball bar lengths", VOLUMETRIC, each, positions, POSITIONS, also)
