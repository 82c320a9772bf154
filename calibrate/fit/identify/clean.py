"""Gross errors that only a fit shows: bad rows, detector axes counted the other way round.

Bad rows are found against a fit that they cannot pull, named, and left out before anything is averaged.

Axes need fits, since an arm off its nominal values moves spots as far. A face with a mirrored axis is no face that
could stand anywhere, so that even the best fit misses its spots by millimetres. Which axes they are is a comparison:
every pattern of signs is fitted, and the one that is right is named. Zeros and places alone, which is a quarter of the
work, separate a wrong pattern from all that may be right.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import SPOTS
from calibrate.errors import DataError
from calibrate.fit.gross_errors.bad_rows import bad_rows
from calibrate.fit.identify.rounds import coarse_start, distances, first_fit, wary_fit
from calibrate.fit.identify.session import columns_of, shots_of
from calibrate.fit.instruments import instruments_of
from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.weighting import Weighting
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.checks.gross_error import GrossError, GrossErrorKind, Shots, outlying, robust_scale
from calibrate.model.checks.witness import thinned
from calibrate.model.default_tolerance import links_of
from calibrate.model.parameters import priors, start_values
from calibrate.model.problem import Measured
from calibrate.model.sensors import spots
from calibrate.model.sensors.catalogue import kind_of

Floats = NDArray[np.float64]
FEWEST_POSES = 20  # four numbers each; zeros, links, mount and places are some forty unknowns
GROSS_M = 3e-4  # usual misfit: a hundred times a detector's noise; a mirrored axis leaves some 10 mm on 20 mm faces
GAIN = 4.0  # by which the misfit must fall
RIVAL = 1.5  # times the winner's misfit: as good an explanation
FEWEST_ROWS = 12  # of an instrument: below, it is open which row is the odd one
PASSES = 3  # bad rows can hide behind worse ones
SEVERAL = 3.0  # times the assumed noise, which is often wrong by less
UNMISTAKABLE = 30.0  # robust sigmas; rows of soft arms lie at up to 16
UNSEEN = 1e-9  # of the largest singular value, columns scaled: the data do not see it
MOST_BAD = 0.4  # of the rows: beyond, the question is which of two sessions is the right one


def mirrored_axes(rig: Rig, samples: Samples) -> GrossError | None:
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
    return GrossError(GrossErrorKind.MIRRORED_AXIS, (), f"column {best}", f"{what} as written){rivals}", remedy)


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


def clean(weighting: Weighting, start: Floats) -> tuple[Weighting, tuple[GrossError, ...]]:
    """The rows that can be averaged, and what was wrong with the others.

    DataError where so many rows are bad that the rest is no basis.
    """
    rows = np.unique(np.concatenate([m.sample_rows.ravel() for m in weighting.measured]))
    gross_errors: list[GrossError] = []
    kept = weighting
    for _ in range(PASSES):
        found = _found(kept, wary_fit(kept, start))
        if not found:
            break
        gross_errors += found
        refuse_most(tuple(gross_errors), len(rows))
        kept = weighting.take(np.setdiff1d(rows, rows_of(gross_errors)))
    return kept, tuple(gross_errors)


def rows_of(gross_errors: Sequence[GrossError]) -> NDArray[np.intp]:
    """Every row that any of them names, sorted."""
    return np.array(sorted({row for b in gross_errors for row in b.rows}), dtype=np.intp)


def refuse_most(gross_errors: tuple[GrossError, ...], rows: int) -> None:
    """DataError where so many of the rows are named that it is open which ones are the good ones."""
    bad = len(rows_of(gross_errors))
    if bad > MOST_BAD * rows:
        raise DataError(
            f"{bad} of {rows} rows do not go with the rest (first: {gross_errors[0].says}); "
            "check that joints and observations are of the same rows and session"
        )


def _found(weighting: Weighting, theta: Floats) -> list[GrossError]:
    problem = weighting.problem(theta)
    out: list[GrossError] = []
    every = zip(weighting.measured, distances(problem, theta), strict=False)  # known lengths come last and are no rows
    for index, (measured, distance) in enumerate(every):
        if measured.problem.rows < FEWEST_ROWS:
            continue
        met = _met_exactly(problem, index, theta, measured)
        own = problem.of_block(index, theta)
        shots = shots_of(measured, own)
        if shots is None:
            out += _bad_pairs(measured, distance, met, np.linalg.norm(measured.problem.misfit(own), axis=1))
            continue
        shots = replace(shots, met=met)
        blocks = kind_of(measured.name).blocks(shots)
        inside = {row for b in blocks for row in b.rows}
        named = [*blocks, *(b for b in bad_rows(shots) if b.rows[0] not in inside)]
        out += [b for b in named if _beyond_the_arm(b, shots)]
    return out


def _beyond_the_arm(gross_error: GrossError, shots: Shots) -> bool:
    """Whether a row is wrong whatever the arm does: where all rows miss by several times the noise, physics is missing
    from the model, and rows that feel most of it are as good as any.
    """
    misfit = shots.misfit()
    distance = np.linalg.norm(misfit, axis=1)
    scale = robust_scale(distance, misfit.shape[1], shots.met)
    mine = distance[np.isin(shots.rows, gross_error.rows)]
    return scale <= SEVERAL or float(np.median(mine)) > UNMISTAKABLE * scale


def _met_exactly(problem: JointProblem, index: int, theta: Floats, measured: Measured) -> int:
    """How many rows of a block the fit can meet exactly, where these are half of them; otherwise 0.

    A fit that lets rows go meets as many observations exactly as it has effective parameters there, the trace of the
    hat matrix. Where that is half of the block, the median distance is no longer one of noise.
    Source: Rousseeuw, Leroy, Robust Regression and Outlier Detection, 1987, section 3.4 (the exact fit property).
    """
    free = np.flatnonzero([p.free for p in problem.parameters])
    own = problem.jacobian_of(index, theta)[:, free]
    if len(own) >= 2 * len(free):
        return 0
    others = (problem.jacobian_of(i, theta)[:, free] for i in range(len(problem.blocks)) if i != index)
    every = np.concatenate([own, *others, np.diag(1.0 / priors(problem.parameters)[free])])
    scale = np.maximum(np.linalg.norm(every, axis=0), np.finfo(float).tiny)
    U, s, _ = np.linalg.svd(every / scale, full_matrices=False)
    effective = float(np.sum(U[: len(own), s > UNSEEN * s[0]] ** 2))
    rows = measured.problem.rows
    met = min(math.ceil(effective * rows / len(own)), rows - 1)
    return met if 2 * met >= rows else 0


def _bad_pairs(measured: Measured, distance: Floats, met: int, away_m: Floats) -> list[GrossError]:
    """Pairs of rows, of which it is open which one is wrong; (row,) whitened and plain misfit."""
    out: list[GrossError] = []
    for i in np.flatnonzero(outlying(distance, measured.problem.observed.shape[1], met)):
        rows = tuple(sorted(int(r) for r in measured.sample_rows[i]))
        what = f"{measured.name} {1e3 * away_m[i]:.3g} mm away from what all other rows predict"
        remedy = "take both again, or remove them"
        out.append(GrossError(GrossErrorKind.BAD_SHOT, rows, ", ".join(columns_of(measured)), what, remedy))
    return out
