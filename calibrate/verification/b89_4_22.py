"""Figures of ASME B89.4.22-2004 (reaffirmed 2019), performance evaluation of articulated arm CMMs.

Three tests by their titles: effective diameter, single-point articulation, volumetric performance. Clause numbers were
not at hand and are not invented; before a certificate the purchased standard has the word.
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.verification.figure import Figure, Source
from calibrate.verification.measured_lengths import Measured
from calibrate.verification.sphere import fitted_sphere
from calibrate.verification.standards import worst_of

Floats = NDArray[np.float64]
STANDARD = "ASME B89.4.22-2004"
DIAMETER_SERIES, DIAMETER_TOUCHES, DIAMETER_TIMES = (6, 7, 8), 9, 3
ARTICULATIONS = 10
POSITIONS = 20

DIAMETER = Source(
    STANDARD,
    "Effective diameter performance test",
    "diameter of the least-squares sphere of nine points, less the probe's, minus the calibrated diameter; the largest "
    "of three measurements",
)
SINGLE_POINT = Source(
    STANDARD,
    "Single-point articulation performance test",
    "d_i distance of place i of the probe in the seat from the mean place; s = sqrt(sum d_i^2 / (n - 1)), reported as "
    "2 s with the largest d_i; ten articulations",
)
VOLUMETRIC = Source(
    STANDARD,
    "Volumetric performance test",
    "length of a ball bar as measured minus calibrated, in twenty positions: the largest; beside it the range and "
    "twice the root mean square",
)


def figures(measured: Measured) -> tuple[Figure, ...]:
    """All that the recording allows; what it does not hold is told as such."""
    return (_diameter(measured), _single_point(measured), _volumetric(measured))


def _diameter(measured: Measured) -> Figure:
    probe_m, permitted_m = measured.rig.tool.probe_diameter_m or 0.0, measured.rig.mpe.effective_diameter_m
    each: list[tuple[str, float, float | None]] = []
    for (number, series), touches_m in measured.touches.items():
        if series in DIAMETER_SERIES and len(touches_m) >= DIAMETER_TOUCHES:
            diameter_m = 2.0 * fitted_sphere(touches_m).radius_m - probe_m
            deviation_m = diameter_m - measured.rig.spheres[number].diameter_m
            each.append((f"sphere {number}, {len(touches_m)} points", deviation_m, permitted_m))
    says = "deviation of the effective diameter"
    return worst_of("effective diameter", says, DIAMETER, each, len(each), DIAMETER_TIMES)


def _single_point(measured: Measured) -> Figure:
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
        "single point (2 s)", "scatter of the probe in a seat", SINGLE_POINT, each, most, ARTICULATIONS, also
    )


def _volumetric(measured: Measured) -> Figure:
    permitted_m = measured.rig.mpe.volumetric_m
    errors_m = np.array([length.error_m for length in measured.lengths])
    each = [(length.says, length.error_m, permitted_m) for length in measured.lengths]
    positions = len({length.position for length in measured.lengths})
    also: tuple[tuple[str, float], ...] = ()
    if len(errors_m):
        twice_rms_m = 2.0 * float(np.sqrt(np.mean(errors_m**2)))
        also = (("range", float(np.ptp(errors_m))), ("twice the root mean square", twice_rms_m))
    return worst_of("volumetric", "deviation of ball bar lengths", VOLUMETRIC, each, positions, POSITIONS, also)
