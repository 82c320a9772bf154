"""An axis of a detector counted the other way round: found by fits, since an arm off its nominal values moves spots as
far.

A face with a mirrored axis is no face that could stand anywhere, so that even the best fit misses its spots by
millimetres. Which axes they are is a comparison: every pattern of signs is fitted, and the one that is right is named.
Zeros and places alone, which is a quarter of the work, separate a wrong pattern from all that may be right.
"""

from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import SPOTS
from calibrate.fit.identify.rounds import coarse_start, first_fit
from calibrate.fit.instruments import instruments_of
from calibrate.fit.weighting import Weighting
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.checks.gross_error import Blunder, BlunderKind
from calibrate.model.checks.witness import thinned
from calibrate.model.default_tolerance import links_of
from calibrate.model.parameters import start_values
from calibrate.model.sensors import spots

Floats = NDArray[np.float64]

FEWEST_POSES = 20  # four numbers each; zeros, links, mount and places are some forty unknowns
GROSS_M = 3e-4  # usual misfit: a hundred times a detector's noise; a mirrored axis leaves some 10 mm on 20 mm faces
GAIN = 4.0  # by which the misfit must fall
RIVAL = 1.5  # times the winner's misfit: as good an explanation


def mirrored_axes(rig: Rig, samples: Samples) -> Blunder | None:
    """The axes whose other sign explains the spots when those of the file do not; None if they do, or without spots."""
    if not all(name in samples for name in SPOTS):
        return None
    spots = samples.spots()
    lit = np.flatnonzero(np.all(np.isfinite(np.zeros((0, 4)) if spots is None else spots), axis=1))
    if len(lit) < FEWEST_POSES:
        return None
    weighting = _spots_alone(rig, samples.take(lit[thinned(np.arange(len(lit)))]))
    before_m = _fitted_m(weighting, _coarse(weighting))
    if before_m < GROSS_M:
        return None
    patterns = [signs for signs in product((1.0, -1.0), repeat=len(SPOTS)) if min(signs) < 0.0]
    read = [_read_as(weighting, np.array(signs)) for signs in patterns]
    begun = [_coarse(one) for one in read]
    left_m = [_misfit_m(one, theta) for one, theta in zip(read, begun, strict=True)]
    for i in np.flatnonzero(np.array(left_m) < GAIN * min(left_m)):
        left_m[i] = _fitted_m(read[i], begun[i])
    best_m = min(left_m)
    if not before_m > GAIN * best_m:
        return None
    best, *others = (_columns(patterns[i]) for i in np.argsort(left_m) if left_m[i] < RIVAL * best_m)
    what = f"counted the other way round (spots and arm agree to {1e3 * best_m:.2g} mm then, to {1e3 * before_m:.2g} mm"
    rivals = "".join(f"; or {other}" for other in others)
    remedy = "change the sign of the column in all rows"
    return Blunder(BlunderKind.MIRRORED_AXIS, (), f"column {best}", f"{what} as written){rivals}", remedy)


def _spots_alone(rig: Rig, samples: Samples) -> Weighting:
    found = instruments_of(samples, rig, arm=arm_of(rig, links_of(rig))).weighting
    return replace(found, measured=tuple(m for m in found.measured if m.name == spots.KIND.name), known=())


def _read_as(weighting: Weighting, signs: Floats) -> Weighting:
    (spots,) = weighting.measured
    problem = replace(spots.problem, observed=spots.problem.observed * signs)
    return replace(weighting, measured=(replace(spots, problem=problem),))


def _coarse(weighting: Weighting) -> Floats:
    return coarse_start(weighting, start_values(weighting.parameters))


def _fitted_m(weighting: Weighting, start: Floats) -> float:
    return _misfit_m(weighting, first_fit(weighting, start))


def _misfit_m(weighting: Weighting, theta: Floats) -> float:
    """Median length of what is left of two spots; infinite where no light goes that way."""
    if not np.all(np.isfinite(theta)):
        return float("inf")
    (spots,) = weighting.measured
    misfit = np.linalg.norm(spots.problem.misfit(weighting.problem(theta).of_block(0, theta)), axis=1)
    return float(np.median(misfit)) if np.all(np.isfinite(misfit)) else float("inf")


def _columns(signs: tuple[float, ...]) -> str:
    return ", ".join(name for name, sign in zip(SPOTS, signs, strict=True) if sign < 0.0)
