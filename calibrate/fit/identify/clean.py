"""Bad rows are found against a fit that they cannot pull, named, and left out before anything is averaged."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.fit.gross_errors.bad_rows import bad_rows
from calibrate.fit.identify.rounds import distances, wary_fit
from calibrate.fit.identify.session import columns_of, shots_of
from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.weighting import Weighting
from calibrate.model.checks.gross_error import Blunder, BlunderKind
from calibrate.model.checks.shots import Shots, outlying, robust_scale
from calibrate.model.measured import Measured
from calibrate.model.parameters import priors
from calibrate.model.sensors.catalogue import kind_of

Floats = NDArray[np.float64]

FEWEST_ROWS = 12  # of an instrument: below, it is open which row is the odd one
PASSES = 3  # bad rows can hide behind worse ones
SEVERAL = 3.0  # times the assumed noise, which is often wrong by less
UNMISTAKABLE = 30.0  # robust sigmas; rows of soft arms lie at up to 16
UNSEEN = 1e-9  # of the largest singular value, columns scaled: the data do not see it
MOST_BAD = 0.4  # of the rows: beyond, the question is which of two sessions is the right one


def clean(weighting: Weighting, start: Floats) -> tuple[Weighting, tuple[Blunder, ...]]:
    """The rows that can be averaged, and what was wrong with the others.

    DataError where so many rows are bad that the rest is no basis.
    """
    rows = np.unique(np.concatenate([m.sample_rows.ravel() for m in weighting.measured]))
    blunders: list[Blunder] = []
    kept = weighting
    for _ in range(PASSES):
        found = _found(kept, wary_fit(kept, start))
        if not found:
            break
        blunders += found
        refuse_most(tuple(blunders), len(rows))
        kept = weighting.take(np.setdiff1d(rows, rows_of(blunders)))
    return kept, tuple(blunders)


def rows_of(blunders: Sequence[Blunder]) -> NDArray[np.intp]:
    """Every row that any of them names, sorted."""
    return np.array(sorted({row for b in blunders for row in b.rows}), dtype=np.intp)


def refuse_most(blunders: tuple[Blunder, ...], rows: int) -> None:
    """DataError where so many of the rows are named that it is open which ones are the good ones."""
    bad = len(rows_of(blunders))
    if bad > MOST_BAD * rows:
        raise DataError(
            f"{bad} of {rows} rows do not go with the rest (first: {blunders[0].says}); "
            "check that joints and observations are of the same rows and session"
        )


def _found(weighting: Weighting, theta: Floats) -> list[Blunder]:
    problem = weighting.problem(theta)
    out: list[Blunder] = []
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


def _beyond_the_arm(blunder: Blunder, shots: Shots) -> bool:
    """Whether a row is wrong whatever the arm does: where all rows miss by several times the noise, physics is missing
    from the model, and rows that feel most of it are as good as any.
    """
    misfit = shots.misfit()
    distance = np.linalg.norm(misfit, axis=1)
    scale = robust_scale(distance, misfit.shape[1], shots.met)
    mine = distance[np.isin(shots.rows, blunder.rows)]
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


def _bad_pairs(measured: Measured, distance: Floats, met: int, away_m: Floats) -> list[Blunder]:
    """Pairs of rows, of which it is open which one is wrong; (row,) whitened and plain misfit."""
    out: list[Blunder] = []
    for i in np.flatnonzero(outlying(distance, measured.problem.observed.shape[1], met)):
        rows = tuple(sorted(int(r) for r in measured.sample_rows[i]))
        what = f"{measured.name} {1e3 * away_m[i]:.3g} mm away from what all other rows predict"
        remedy = "take both again, or remove them"
        out.append(Blunder(BlunderKind.BAD_SHOT, rows, ", ".join(columns_of(measured)), what, remedy))
    return out
