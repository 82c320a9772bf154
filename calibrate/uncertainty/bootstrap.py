"""Doubt without a stated law of noise: refit on rows drawn with replacement.

Sources: Efron, Tibshirani, An Introduction to the Bootstrap, 1993, ch. 9.5 (pairs) and 13.3 (percentiles); block
bootstrap for rows that belong together: Kuensch, Ann. Statist. 17(3), 1989. Priors are observations of their own, so
their centres are drawn again as well.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.estimator import LEAST_SQUARES, Estimator
from calibrate.fit import Fit, Status
from calibrate.uncertainty.cuttable import Cuttable

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
        believed = tuple(
            replace(p, start=p.start + rng.normal(0.0, p.prior)) if p.free and np.isfinite(p.prior) else p
            for p in problem.parameters
        )
        again = by.fit(problem.select(rows).with_parameters(believed), fit.theta)
        if again.status is Status.CONVERGED:
            found.append(again.theta)
    return Bootstrap(np.array(found).reshape(-1, len(fit.theta)), rounds - len(found))
