"""Refits on some of the rows: the error on rows that a fit has not used, and uncertainty by drawing rows.

Held out: each fold is predicted by a refit on the other rows. What only the unseen rows determine (where the fixture
stood at a station that was left out) is fitted to them with all else held, and costs them as many degrees of freedom;
so a station that was left out proves the arm, not the station. Source: cross-validation, Stone, J. R. Statist. Soc. B
36(2), 1974.

Bootstrap: refits on rows drawn with replacement need no stated noise distribution. Priors are observations of their
own, so their centres are drawn again as well. Sources: Efron, Tibshirani, An Introduction to the Bootstrap, 1993, ch.
9.5 (pairs) and 13.3 (percentiles); block bootstrap for rows that belong together: Kuensch, Ann. Statist. 17(3), 1989.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Protocol, Self, TypeVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.fit.held_out.splits import Split
from calibrate.fit.rank.identifiability import analyse
from calibrate.fit.rank.observability import reduced
from calibrate.fit.solvers import Fit, Status
from calibrate.fit.solvers.solve import LEAST_SQUARES, Estimator
from calibrate.model.parameters import Parameter, start_values
from calibrate.model.problem import Block


class Cuttable(Block, Protocol):
    """`Problem` and `JointProblem` are such. Unknowns keep their names and order in a cut.

    `select` may name a row several times. Rows of a `JointProblem` are those of all blocks, each with its own number of
    residuals.
    """

    def with_parameters(self, parameters: tuple[Parameter, ...]) -> Self:
        """The same rows with parameters held, bounded or assumed otherwise."""
        ...


Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Bootstrap:
    """Answers of the refits; columns are the parameters of the fit, held ones do not move."""

    theta: Floats  # (round, param) of those that converged
    failed: int  # rounds without an answer: rows drawn lost rank, or the fit did not converge

    def sigma(self) -> Floats:
        """(param,) standard deviation over the rounds; nan with fewer than two."""
        few = np.full(self.theta.shape[1], np.nan)
        return np.std(self.theta, axis=0, ddof=1) if len(self.theta) > 1 else few

    def interval(self, level: float = 0.95) -> Floats:
        """(param, 2) percentiles that hold `level` of the answers; nan without any."""
        if len(self.theta) == 0:
            return np.full((self.theta.shape[1], 2), np.nan)
        tail = 50.0 * (1.0 - level)
        return np.percentile(self.theta, [tail, 100.0 - tail], axis=0).T


def bootstrap(
    problem: Cuttable,
    fit: Fit,
    rng: Generator,
    *,
    rounds: int = 200,
    group: Ints | None = None,
    by: Estimator = LEAST_SQUARES,
) -> Bootstrap:
    """Refits of `problem` (the one that gave `fit`, `by` the same) on drawn rows.

    Rows of one `group` (row,) are drawn together; rows of a group below 0 are stated, not sampled, and always there.
    """
    labels = np.arange(problem.rows) if group is None else group
    members = [np.flatnonzero(labels == g) for g in np.unique(labels[labels >= 0])]
    stated = np.flatnonzero(labels < 0)
    found: list[Floats] = []
    for _ in range(rounds):
        rows = np.concatenate([*(members[i] for i in rng.integers(len(members), size=len(members))), stated])
        redrawn = tuple(
            replace(p, start=p.start + rng.normal(0.0, p.prior)) if p.free and np.isfinite(p.prior) else p
            for p in problem.parameters
        )
        again = by.fit(problem.select(rows).with_parameters(redrawn), fit.theta)
        if again.status is Status.CONVERGED:
            found.append(again.theta)
    return Bootstrap(np.array(found).reshape(-1, len(fit.theta)), rounds - len(found))


Rows = NDArray[np.intp]
P = TypeVar("P", bound=Cuttable)

SEEN = 1e-9  # of the largest singular value of scaled columns: rounding is at 1e-16, what rows see at 1e-3 and above

CHANCE = 2.33  # standard deviations of a mean square: one in a hundred by chance
USABLE = (Status.CONVERGED, Status.RANK_DEFICIENT)  # unseen combinations do not spoil a prediction of like rows


class Proof(Enum):
    """How the proof ended."""

    DONE = "predicted from the other rows"
    TOO_FEW = "too few rows: none left to fit, or fewer unseen values than unknowns of their own"
    NOT_REFITTED = "the fit on the other rows did not converge"


@dataclass(frozen=True)
class HeldOutRows:
    """Pooled over the folds of a split; numbers are None where there is no proof."""

    split: str
    proof: Proof
    rows: int  # predicted
    chi: float | None  # rms of the whitened error: 1 = the noise, above it what the fit does not know
    chi_predicted: float | None  # the same, whitened with what the other rows leave open besides: near 1 unless wrong
    rms: float | None  # rms of `measure`, in its unit; None without one
    refitted: tuple[str, ...]  # what only unseen rows know
    errors: tuple[Floats, ...] = ()  # of each fold, what `measure` gave


@dataclass(frozen=True)
class _Fold:
    squares: float
    predicted_squares: float
    dof: int
    measured: Floats
    refitted: tuple[str, ...]


def held_out(
    problem: P,
    split: Split,
    theta: Floats,
    measure: Callable[[P, Floats], Floats] | None = None,
    by: Estimator = LEAST_SQUARES,
) -> HeldOutRows:
    """Proof by one split from the fit `theta` (param,) of all rows, a start only; refits are made `by` that of the fit.

    `measure(problem, theta)` gives errors (any shape) in the unit wanted for `rms`, such as `Problem.misfit`.
    """
    folds: list[_Fold] = []
    for unseen in split.unseen:
        used = np.setdiff1d(np.arange(problem.rows), unseen)
        fold = _fold(problem, used, unseen, theta, measure, by) if len(used) else Proof.TOO_FEW
        if isinstance(fold, Proof):
            return HeldOutRows(split.says, fold, 0, None, None, None, ())
        folds.append(fold)
    dof = sum(fold.dof for fold in folds)
    if dof <= 0:
        return HeldOutRows(split.says, Proof.TOO_FEW, 0, None, None, None, ())
    errors = np.concatenate([fold.measured for fold in folds])
    return HeldOutRows(
        split.says,
        Proof.DONE,
        sum(len(unseen) for unseen in split.unseen),
        float(np.sqrt(sum(fold.squares for fold in folds) / dof)),
        float(np.sqrt(sum(fold.predicted_squares for fold in folds) / dof)),
        float(np.sqrt(np.mean(errors**2))) if len(errors) else None,
        tuple(dict.fromkeys(name for fold in folds for name in fold.refitted)),
        tuple(fold.measured for fold in folds),
    )


def beyond_sigma(splits: Sequence[tuple[int, float, float]]) -> float:
    """What rows that a fit has not seen are missed by beyond noise and its own uncertainty, root mean square; 0 where
    chance explains it. Of each way to split: how many values, their rms, and the rms to be expected.
    """
    squares = [
        n * (rms**2 - expected**2) if rms**2 > expected**2 * (1.0 + CHANCE * np.sqrt(2.0 / n)) else 0.0
        for n, rms, expected in splits
    ]
    return float(np.sqrt(sum(squares) / sum(n for n, _, _ in splits))) if splits else 0.0


def _fold(
    problem: P,
    used: Rows,
    unseen: Rows,
    theta: Floats,
    measure: Callable[[P, Floats], Floats] | None,
    by: Estimator,
) -> _Fold | Proof:
    train, test = problem.select(used), problem.select(unseen)
    idle = _idle(train.jacobian(theta), problem.parameters)
    kept = tuple(replace(p, free=p.free and i not in idle) for i, p in enumerate(problem.parameters))
    known = _refit(train, kept, by)
    after = known(theta)
    if after is None:
        return Proof.NOT_REFITTED
    own = [i for i in idle if np.any(test.jacobian(after)[:, i])]
    if own:
        fit = _refit(test, tuple(replace(p, free=i in own) for i, p in enumerate(problem.parameters)), by)(after)
        if fit is None:
            return Proof.NOT_REFITTED
        after = fit
    residual = test.residual(after)
    measured = np.zeros(0) if measure is None else np.ravel(measure(test, after))
    refitted = tuple(problem.parameters[i].name for i in own)
    predicted = _predicted_squares(residual, train.jacobian(after), test.jacobian(after), kept, own)
    return _Fold(float(residual @ residual), predicted, len(residual) - len(own), measured, refitted)


def _predicted_squares(
    residual: Floats, train: Floats, test: Floats, parameters: tuple[Parameter, ...], own: list[int]
) -> float:
    """Squares r' (I + T C T')^-1 r of the error over its own covariance, noise and uncertainty of the fit together.

    `train`, `test`: whitened derivatives (value, param); C is the covariance of what the training rows see, and what
    only the unseen rows know (`own`) is projected out of both. Rows elsewhere than the others are missed by more than
    the noise although nothing is wrong; this is what separates the two.
    """
    free = [i for i, p in enumerate(parameters) if p.free]
    scale = np.linalg.norm(train[:, free], axis=0)
    scale[scale == 0.0] = 1.0
    _, sizes, directions = np.linalg.svd(train[:, free] / scale, full_matrices=False)
    seen = sizes > sizes[0] * SEEN if len(sizes) else np.zeros(0, dtype=bool)
    spread = test[:, free] / scale @ (directions[seen].T / sizes[seen])
    if own:
        onto, _ = np.linalg.qr(test[:, own])
        spread = spread - onto @ (onto.T @ spread)
        residual = residual - onto @ (onto.T @ residual)
    inner = np.eye(spread.shape[1]) + spread.T @ spread  # Woodbury: small where parameters are fewer than values
    along = spread.T @ residual
    return float(residual @ residual - along @ np.linalg.solve(inner, along))


def _idle(jacobian: Floats, parameters: tuple[Parameter, ...]) -> tuple[int, ...]:
    """Free parameters without any effect on these rows."""
    return tuple(i for i, p in enumerate(parameters) if p.free and not np.any(jacobian[:, i]))


def _refit(problem: Cuttable, parameters: tuple[Parameter, ...], by: Estimator) -> Callable[[Floats], Floats | None]:
    """Fit of what these rows can show; a combination that they alone do not see goes back to its nominal value."""

    def from_start(theta: Floats) -> Floats | None:
        seen = analyse(problem.jacobian(theta), parameters)
        kept = reduced(parameters, seen)
        nominal = np.array([before.free and not after.free for before, after in zip(parameters, kept, strict=True)])
        start = np.where(nominal, start_values(parameters), theta)
        fit = by.fit(problem.with_parameters(kept), start)
        return fit.theta if fit.status in USABLE else None

    return from_start
