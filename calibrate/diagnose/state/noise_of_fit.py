"""SessionNoise of every instrument at a fit: how large, how far each observation is trusted, and what whitens it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose import limits
from calibrate.diagnose.state.effect_problem import EffectProblem
from calibrate.fit.identify.session import assumed_sigma
from calibrate.fit.noise import Scatter, SharedScatter, levers_of, likelihood_of, scatter_of, shares_found, witness_of
from calibrate.fit.solvers import Fit
from calibrate.model.parameters import plausible_sizes
from calibrate.model.problem import Measured, whitener_of
from calibrate.model.sensors.catalogue import kind_of

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class SessionNoise:
    """Of all instruments, over the active rows."""

    scatters: tuple[Scatter, ...]  # of each instrument, without what it shares
    shared: SharedScatter | None = None  # over all rows; None: nothing

    def under(self, problem: EffectProblem) -> EffectProblem:
        """The problem with weights from this noise."""
        return problem.under(whiteners_of(self.scatters), self.shared)

    @property
    def trusted(self) -> "SessionNoise":
        """The same, every observation with its full weight."""
        return replace(self, scatters=tuple(replace(s, weights=np.ones(len(s.weights))) for s in self.scatters))

    def whole(self, rows: tuple[Ints, ...]) -> tuple[Scatter, ...]:
        """Of each instrument by itself, as one meets it who does not know the others; `rows` are the active ones."""
        if self.shared is None:
            return self.scatters
        form = middle_of(self.scatters[self.shared.witness])
        shared = [self.shared.whole(i, form) for i in range(len(self.scatters))]
        each = zip(self.scatters, shared, rows, strict=True)
        return tuple(s if more is None else replace(s, covariance=s.covariance + more[r]) for s, more, r in each)


def noise_of(problem: EffectProblem, fit: Fit) -> SessionNoise:
    """SessionNoise of every instrument at the values of a fit; what they share with second encoders is found first."""
    at, larger = problem.around(fit.theta), freedom(problem, fit.theta, fit.covariance)
    measured = problem.session.measured
    residuals = [m.problem.observed - expected for m, expected in zip(measured, at.expected, strict=True)]
    by_joint = [problem.chain.by_joint(at, i) for i in range(len(measured))]

    def found(i: int, residual: Floats) -> Scatter:
        rows = problem.rows[i]
        scatter = scatter_of(residual[rows], by_joint[i][rows], assumed_sigma(measured[i])[rows], _alike(measured[i]))
        return replace(scatter, covariance=scatter.covariance * larger[i])

    witness = witness_of([m.problem.chain for m in measured])
    if witness is None or len(measured) == 1 or len(problem.rows[witness]) == 0:
        return SessionNoise(tuple(found(i, residual) for i, residual in enumerate(residuals)))
    seen = found(witness, residuals[witness])
    trust = _trust(seen, residuals[witness], problem.rows[witness])
    chains, samples = [m.problem.chain for m in measured], [m.sample_rows for m in measured]
    levers = levers_of(chains, samples, by_joint, trust)
    share, _ = shares_found(residuals, levers, problem.whiteners, problem.rows, witness)
    shared = SharedScatter(witness, share, levers)
    out = [seen if i == witness else found(i, alone) for i, alone in enumerate(shared.apart(residuals))]
    more = [shared.unseen(i, middle_of(seen)) for i in range(len(out))]
    each = zip(out, more, problem.rows, strict=True)
    return SessionNoise(
        tuple(s if m is None else replace(s, covariance=s.covariance + m[r]) for s, m, r in each), shared
    )


def _alike(measured: Measured) -> list[slice]:
    """Which numbers of a reading have one size of noise where rows are few: every second encoder has its own."""
    joints = measured.problem.chain.sensor.joints_compared()
    each = [slice(i, i + 1) for i in range(len(joints))]
    return each or [quantity.part for quantity in kind_of(measured.name).quantities]


def _trust(seen: Scatter, residual: Floats, known: Ints) -> Floats:
    """(row,) of all readings of the second encoders, active or not."""
    _, weights = likelihood_of(residual, covariance_at(seen, known, np.arange(len(residual))))
    return np.clip(weights / limits.GLITCH_WEIGHT, 0.0, 1.0)


def freedom(problem: EffectProblem, values: Floats, covariance: Floats) -> Floats:
    """(instrument,) numbers over numbers less what was fitted to them: residuals of a fit are smaller than the noise.

    What an instrument has given to the fit is the trace of its part of the hat matrix, J C J' of whitened rows: spots
    pay for nearly all of geometry, second encoders for their zeros alone. Source: Cook, Weisberg, Residuals and
    Influence in Regression, 1982, section 2.1.
    """
    slope, out, first = problem.jacobian(values), np.ones(len(problem.rows)), 0
    posterior = covariance
    if not np.isfinite(covariance).all():  # a direction that nothing holds; what the others have fitted counts
        slope = slope * plausible_sizes(problem.parameters)
        posterior = np.linalg.pinv(slope.T @ slope, hermitian=True)
    for i, (measured, rows) in enumerate(zip(problem.session.measured, problem.rows, strict=True)):
        count = len(rows) * measured.problem.observed.shape[1]
        mine = slope[first : first + count]
        fitted = float(np.sum((mine @ posterior) * mine))
        out[i] = count / max(count - fitted, limits.MOST_FITTED * count) if count else 1.0
        first += count
    return out


def whiteners_of(scatters: tuple[Scatter, ...]) -> tuple[Floats, ...]:
    """Of each instrument (row, k, k), robust weights included."""
    return tuple(whitener_of(s.covariance) * np.sqrt(s.weights)[:, None, None] for s in scatters)


def covariance_at(scatter: Scatter, known: Ints, rows: Ints) -> Floats:
    """(row, k, k) noise at rows: as found where the fit has seen them, else the middle one of those it has."""
    if len(scatter.covariance) == 0:  # unknown: as good as no weight
        return np.broadcast_to(np.eye(scatter.covariance.shape[-1]), (len(rows), *scatter.covariance.shape[1:]))
    out = np.broadcast_to(middle_of(scatter), (len(rows), *scatter.covariance.shape[1:])).copy()
    seen = np.isin(rows, known)
    out[seen] = scatter.covariance[np.searchsorted(known, rows[seen])]
    return out


def middle_of(scatter: Scatter) -> Floats:
    """(k, k) of a usual row: a whole one of them, since medians of single entries together need be no covariance."""
    middle = np.argsort(np.trace(scatter.covariance, axis1=1, axis2=2))[len(scatter.covariance) // 2]
    return scatter.covariance[middle]
