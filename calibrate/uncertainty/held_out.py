"""Error on rows that the fit has not seen, for any problem that can be cut.

Each fold is predicted by a refit on the other rows. What only the unseen rows know (where the fixture stood at a
place that was left out) is fitted to them with all else held, and costs them as many degrees of freedom; so a place
that was left out proves the arm, not the place. Source: cross-validation, Stone, J. R. Statist. Soc. B 36(2), 1974.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from calibrate.estimator import LEAST_SQUARES, Estimator
from calibrate.fit import Status
from calibrate.identifiability import analyse
from calibrate.parameters import Parameter, start_values
from calibrate.redundant import reduced
from calibrate.uncertainty.cuttable import Cuttable
from calibrate.uncertainty.splits import Split

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
P = TypeVar("P", bound=Cuttable)

SEEN = 1e-9  # of the largest singular value of scaled columns: rounding is at 1e-16, what rows see at 1e-3 and above

USABLE = (Status.CONVERGED, Status.RANK_DEFICIENT)  # unseen combinations do not spoil a prediction of like rows


class Proof(Enum):
    """How the proof ended."""

    DONE = "predicted from the other rows"
    TOO_FEW = "too few rows: none left to fit, or fewer unseen values than unknowns of their own"
    NOT_REFITTED = "the fit on the other rows did not converge"


@dataclass(frozen=True)
class HeldOut:
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
) -> HeldOut:
    """Proof by one split from the fit `theta` (param,) of all rows, a start only; refits are made `by` that of the fit.

    `measure(problem, theta)` gives errors (any shape) in the unit wanted for `rms`, such as `Problem.misfit`.
    """
    folds: list[_Fold] = []
    for unseen in split.unseen:
        used = np.setdiff1d(np.arange(problem.rows), unseen)
        fold = _fold(problem, used, unseen, theta, measure, by) if len(used) else Proof.TOO_FEW
        if isinstance(fold, Proof):
            return HeldOut(split.says, fold, 0, None, None, None, ())
        folds.append(fold)
    dof = sum(fold.dof for fold in folds)
    if dof <= 0:
        return HeldOut(split.says, Proof.TOO_FEW, 0, None, None, None, ())
    errors = np.concatenate([fold.measured for fold in folds])
    return HeldOut(
        split.says,
        Proof.DONE,
        sum(len(unseen) for unseen in split.unseen),
        float(np.sqrt(sum(fold.squares for fold in folds) / dof)),
        float(np.sqrt(sum(fold.predicted_squares for fold in folds) / dof)),
        float(np.sqrt(np.mean(errors**2))) if len(errors) else None,
        tuple(dict.fromkeys(name for fold in folds for name in fold.refitted)),
        tuple(fold.measured for fold in folds),
    )


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
    """Squares r' (I + T C T')^-1 r of the error over its own covariance, noise and doubt of the fit together.

    `train`, `test`: whitened derivatives (value, param); C is the covariance of what the training rows see, and what
    only the unseen rows know (`own`) is projected out of both. Rows elsewhere than the others are missed by more than
    the noise although nothing is wrong; this is what tells the two apart.
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
    """Free parameters without any say in these rows."""
    return tuple(i for i, p in enumerate(parameters) if p.free and not np.any(jacobian[:, i]))


def _refit(problem: Cuttable, parameters: tuple[Parameter, ...], by: Estimator) -> Callable[[Floats], Floats | None]:
    """Fit of what these rows can tell; a combination that they alone do not see goes back to its nominal value."""

    def from_start(theta: Floats) -> Floats | None:
        seen = analyse(problem.jacobian(theta), parameters)
        kept = reduced(parameters, seen)
        nominal = np.array([before.free and not after.free for before, after in zip(parameters, kept, strict=True)])
        start = np.where(nominal, start_values(parameters), theta)
        fit = by.fit(problem.with_parameters(kept), start)
        return fit.theta if fit.status in USABLE else None

    return from_start
