"""Does each term predict rows that the fit has not seen: exact for the linearised model, without a refit.

Errors of a fold that was left out are (I - H_ff)^-1 r_f. Source: Cook, Weisberg, Residuals and Influence in Regression,
1982, section 2.2 (several rows deleted).
"""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.folds import k_folds, units

Floats = NDArray[np.float64]

FOLDS = 10
RIDGE = 1e-9  # keeps a direction that only one fold knows finite
NU = 5.0  # of the law of noise, as in calibrate/diagnose/scatter.py


def predicts(bench: Bench, rng: Generator) -> Floats:
    """(term,) 2 ln L of unseen rows that each accepted term gains; below zero it only fitted noise.

    Beside a model of another recording that recording counts, too: many rows of the new one bend a model until it
    predicts them well, at the cost of all that was known. It is not held out, so each value costs two (Akaike 1974).
    """
    rows = bench.state.rows
    data = np.flatnonzero(rows.data)
    labels = units(bench.state.drivers)[rows.sample[data]]
    folds = [data[f] for f in k_folds(labels, FOLDS, rng)]
    whole = _loss(bench.sight.basis, bench.sight.residual, folds)
    out: list[float] = []
    for gone in bench.gone:
        # The span of the model without a term: the complement of what only the term spans.
        basis = bench.sight.basis - gone.span @ (gone.span.T @ bench.sight.basis)
        without = bench.sight.residual + gone.span @ gone.part
        known = float(np.sum(without[rows.stated] ** 2) - np.sum(bench.sight.residual[rows.stated] ** 2))
        out.append(_loss(basis, without, folds) - whole + max(known - 2.0 * gone.cost, 0.0))
    return np.array(out)


def _loss(basis: Floats, residual: Floats, folds: list[NDArray[np.intp]]) -> float:
    """-2 log L of Student's t law, rows apart. `basis` may be an orthonormal one less some directions."""
    total, p = 0.0, basis.shape[1]
    for fold in folds:
        # (I - Q Q')^-1 r = r + Q (I - Q' Q)^-1 Q' r: a fold has more rows than the model has directions.
        Q = basis[fold]
        error = residual[fold] + Q @ np.linalg.solve((1.0 + RIDGE) * np.eye(p) - Q.T @ Q, Q.T @ residual[fold])
        total += float(np.sum((NU + 1.0) * np.log1p(error**2 / NU)))
    return total
