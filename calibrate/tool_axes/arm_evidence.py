"""Whether the measurement shows that the arm is farther off than its prior: then the prior is widened, or refused.

Two witnesses. The wrist: its rows determine how the last two axes lie to each other, hence some combinations of the
arm's parameters, and these have a size under the prior. The other rows: the fit predicts them, with a covariance.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from calibrate.tool_axes.wrist_fit import TargetRows, WristFit, chain_of

Floats = NDArray[np.float64]

UNLIKELY = 0.01  # chance of an arm of the prior: below, the arm is taken to be farther off (as in report/verdict.py)
SEEN = 0.5  # share of a prior variance that the data remove from a combination: below, it is not a witness
MOST_ROWS = 200  # that are predicted with their full covariance, spread over all


@dataclass(frozen=True)
class Witness:
    """Size of what is seen over what the prior expects: root of the mean square."""

    ratio: float
    chance: float  # of one as large, for an arm of the prior
    directions: float  # independent ones that it rests on

    @property
    def contradicts(self) -> bool:
        return self.ratio > 1.0 and self.chance < UNLIKELY


def wrist_witness(found: WristFit) -> Witness | None:
    """The arm's estimated parameters against their prior; None where the wrist determines nothing of them.

    Of an arm of the prior the whitened estimates have the covariance 1 - C, with C the whitened posterior one.
    """
    prior_block = len(found.problem.blocks) - 1
    rows = found.problem.blocks[prior_block]
    if not rows.rows:
        return None
    whitener = rows.jacobian(found.fit.theta)
    u = rows.residual(found.problem.of_block(prior_block, found.fit.theta))
    columns = found.columns(tuple(p.name for p in rows.parameters))
    C = whitener @ found.fit.covariance[np.ix_(columns, columns)] @ whitener.T
    value, vector = np.linalg.eigh(np.eye(len(u)) - C)
    seen = value > SEEN
    k = int(seen.sum())
    if k == 0:
        return None
    q = float(np.sum((vector[:, seen].T @ u) ** 2 / value[seen]))
    return Witness(float(np.sqrt(q / k)), float(chi2.sf(q, k)), float(k))


def other_rows_witness(
    found: WristFit, others: tuple[TargetRows, ...], T_base_device: Floats
) -> tuple[Witness, float] | None:
    """Rows that took no part against their prediction, with the rms (m) of a coordinate; None without such rows.

    The sum of squares has the mean and variance of a chi-square with fewer degrees of freedom (Satterthwaite,
    Biometrics Bulletin 2(6), 1946), since few parameters of the arm move all rows.
    """
    off: list[Floats] = []
    by: list[Floats] = []
    for k, target in enumerate(others):
        if not len(target.q_rad):
            continue
        chosen = np.unique(np.linspace(0, len(target.q_rad) - 1, MOST_ROWS).astype(int))
        rows = target.select(chosen)
        chain, observed = chain_of(found.arm, rows, found.start_m[k], found.start_turn[k], T_base_device)
        own = found.problem.of_block(k, found.fit.theta)
        off.append((chain.expect(own, rows.q_rad) - observed)[:, :3].ravel())
        by.append(found.problem.spread(k, chain.jacobian(own, rows.q_rad)[:, :3].reshape(-1, len(own))))
    if not off:
        return None
    r, J = np.concatenate(off), np.concatenate(by)
    S = J @ found.fit.covariance @ J.T
    S[np.diag_indices(len(r))] += found.noise.position_m**2 + found.prior.fit_rms_m**2
    trace = float(np.trace(S))
    k = trace**2 / float(np.sum(S**2))
    square = float(r @ r) / trace
    return Witness(float(np.sqrt(square)), float(chi2.sf(k * square, k)), k), float(np.sqrt(np.mean(r**2)))
