"""Torques of a motion with links and terms fitted together: a State of calibrate/diagnose/state/linearised.py.

Weights and least squares take turns under Student's t law, each joint with a size of noise of its own, as in the fit of
poses (calibrate/fit/noise, calibrate/fit/solvers).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose import limits
from calibrate.diagnose.motion.torque_problem import TorqueProblem, plain_sizes
from calibrate.diagnose.state.linearised import UnseenMisfits, WhitenedRows
from calibrate.fit.noise import Scatter, likelihood_of, scatter_of, sigma_about_zero
from calibrate.fit.solvers import NEAR_START, solve
from calibrate.model.arms.inverse_dynamics import NUMBERS
from calibrate.model.effects.term import Accepted, Form, Term
from calibrate.model.effects.torque import LOADS, PAYLOAD, STICTION, MotionDrivers, torque_terms
from calibrate.model.parameters import plausible_sizes, priors, start_values

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

FEWEST_NEIGHBOURS = 20  # data of a joint, for the memory of its noise
NEAR = 1.5  # times the least gap: data that are neighbours
MOST_ALONG = 0.99  # of the noise, from one datum to the next
LEAST_MEMORY_S = 1e-3
RATE_STEP_S = 1e-4  # of the difference quotient by time
MOST_MEMORY_S = 0.1  # what lasts longer than vibration and ripple follows the motion: it is no noise


@dataclass(frozen=True, eq=False)
class TorqueState:
    """`problem` holds the data that the fit sees; `whole` all of them, under the same weights where both have them."""

    whole: TorqueProblem
    active: Ints  # moments that the fit sees, sorted
    problem: TorqueProblem
    theta: Floats  # of the problem's parameters
    minus_two_log_likelihood: float

    @property
    def accepted(self) -> tuple[Accepted, ...]:
        return self.problem.split(self.theta)[1]

    @property
    def links(self) -> Floats:
        """(link number,)"""
        return self.problem.split(self.theta)[0]

    @property
    def noise_nm(self) -> Floats:
        """(joint,) one sigma by the normal law: under Student's t the size of the noise is smaller."""
        problem = replace(self.problem, weights=np.ones_like(self.problem.weights))
        new, joints = problem.whitened(problem.misfit_nm(self.theta)), range(self.drivers.n_joints)
        each = [new[problem.joint == j] for j in joints]
        wider = np.array([sigma_about_zero(one, axis=0) if len(one) else 1.0 for one in each], dtype=float)
        return problem.sigma_nm * wider

    @property
    def samples(self) -> int:
        return len(self.active)

    @property
    def most_search_rows(self) -> int:
        """All of them: the moments are thinned evenly when the motion is read, and their noise has a memory."""
        return len(self.problem.moment)

    @property
    def distrusted(self) -> int:
        return int(np.sum(self.problem.weights < limits.DISTRUSTED_WEIGHT))

    @property
    def drivers(self) -> MotionDrivers:
        return self.problem.drivers

    def trusting(self) -> Self:
        return replace(self, problem=replace(self.problem, weights=np.ones_like(self.problem.weights)))

    @property
    def rows(self) -> WhitenedRows:
        return self._rows

    @cached_property
    def _rows(self) -> WhitenedRows:
        problem, parameters = self.problem, self.problem.parameters
        free = np.flatnonzero([p.free for p in parameters])
        with_prior = free[np.isfinite(priors(parameters)[free])]
        unit, sigma = plausible_sizes(parameters), priors(parameters)
        held = np.zeros((len(with_prior), len(free)))
        held[range(len(with_prior)), np.searchsorted(free, with_prior)] = unit[with_prior] / sigma[with_prior]
        none = np.full(len(with_prior), -1, dtype=np.intp)
        data = np.arange(len(problem.moment))
        away = (self.theta - start_values(parameters))[with_prior] / sigma[with_prior]
        return WhitenedRows(
            np.concatenate([-problem.residual(self.theta), -away]),
            np.concatenate([problem.jacobian(self.theta)[:, free] * unit[free], held]),
            np.concatenate([problem.moment, none]),
            np.concatenate([data, none]),
            np.concatenate([problem.joint, none]),
            problem.owner[free],
            earlier=np.concatenate([np.where(problem.kept > 0.0, problem.moment[problem.before], -1), none]),
            kept=np.concatenate([problem.kept, np.zeros(len(with_prior))]),
        )

    def columns(self, term: Term, inner: Floats) -> Floats:
        felt = self.problem.whitened(self.problem.felt(term.basis(self.drivers, inner)))
        return np.concatenate([felt, np.zeros((len(self.rows.residual) - len(felt), felt.shape[1]))])

    def columns_at(self, term: Term, inner: Sequence[Floats]) -> Floats:
        return np.stack([self.columns(term, one).T for one in inner])

    def candidates(self) -> Sequence[Term]:
        return self._candidates

    @cached_property
    def _candidates(self) -> tuple[Term, ...]:
        """Beside what is known a change may have either sign; but for stiction: how fast friction turns with the motion
        is not known, and shows as less of it at the lowest speeds.
        """
        terms = torque_terms(self.drivers)
        if not self.problem.given:
            return terms
        return tuple(
            term.of_a_difference() if isinstance(term, Form) and term.physics != STICTION else term for term in terms
        )

    def refitted(self, accepted: Sequence[Accepted]) -> "TorqueState":
        terms = tuple(accepted)
        problem = replace(self.problem, terms=terms, sizes=plain_sizes(self.problem, terms))
        values = [a.values for a in terms]
        return _settled(self, problem, np.concatenate([self.theta[: problem.links.size], *values]))

    def renewed(self) -> "TorqueState":
        """With the load as now fitted."""
        drivers = with_torque(self.drivers, self.links, (*self.problem.given, *self.accepted))
        whole, problem = replace(self.whole, drivers=drivers), replace(self.problem, drivers=drivers)
        return _settled(replace(self, whole=whole), problem, self.theta)

    def select(self, samples: Ints) -> Self:
        chosen = np.sort(samples)
        problem = part_of(self.problem, np.isin(self.problem.moment, chosen))
        value, _ = _likelihood(problem, problem.misfit_nm(self.theta))
        return replace(self, active=chosen, problem=problem, minus_two_log_likelihood=value)

    def held_out(self, samples: Ints) -> tuple[UnseenMisfits, ...]:
        mine = np.isin(self.whole.moment, samples)
        unseen = replace(part_of(self.whole, mine), terms=self.problem.terms, sizes=self.problem.sizes)
        misfit = -unseen.misfit_nm(self.theta)
        each = ((j, np.flatnonzero(unseen.joint == j)) for j in range(self.drivers.n_joints))
        return tuple(
            UnseenMisfits(
                f"joint{j + 1}.torque",
                unseen.moment[rows],
                misfit[rows, None],
                misfit[rows, None] / self.problem.sigma_nm[j],
            )
            for j, rows in each
            if len(rows)
        )


def _settled(state: TorqueState, problem: TorqueProblem, start: Floats) -> TorqueState:
    """Turns of weights and least squares until the likelihood rests."""
    theta, last, out = start, np.inf, state
    for _ in range(limits.FIT_TURNS):
        fit = solve(problem, start=theta, damping=NEAR_START, max_steps=limits.SOLVER_STEPS, tolerance=0.02)
        theta = fit.theta
        problem, value = with_noise(problem, theta)
        away = (theta - start_values(problem.parameters)) / priors(problem.parameters)
        value += float(away[: problem.links.size] @ away[: problem.links.size])
        out = replace(state, problem=problem, theta=theta, minus_two_log_likelihood=value)
        if abs(last - value) < limits.SETTLED:
            break
        last = value
    return out


def part_of(problem: TorqueProblem, kept: NDArray[np.bool_]) -> TorqueProblem:
    """Some of the data."""
    cut = {name: getattr(problem, name)[kept] for name in ("columns", "observed_nm", "moment", "joint", "weights")}
    return replace(problem, **cut)


def with_noise(problem: TorqueProblem, theta: Floats) -> tuple[TorqueProblem, float]:
    """Under the noise that these values leave, and -2 log likelihood; what the fit has taken is given back."""
    misfit, n = problem.misfit_nm(theta), problem.drivers.n_joints
    memory = np.array([_memory_s(problem, misfit, j) for j in range(n)])
    plain = replace(problem, memory_s=memory, sigma_nm=np.ones(n), weights=np.ones(len(misfit)))
    new, larger = plain.whitened(misfit), _freedom(problem, theta)
    sigma, weights = problem.sigma_nm.copy(), np.ones(len(misfit))
    for j in range(n):
        rows = np.flatnonzero(problem.joint == j)
        if len(rows):
            own = np.full((len(rows), 1), float(np.std(new[rows])) + 1e-12)
            found: Scatter = scatter_of(new[rows, None], np.zeros((len(rows), 1, 1)), own)
            sigma[j] = float(np.sqrt(found.covariance[0, 0, 0] * larger[j]))
            weights[rows] = found.weights
    out = replace(problem, memory_s=memory, sigma_nm=sigma, weights=weights)
    return out, _likelihood(out, misfit)[0]


def _memory_s(problem: TorqueProblem, misfit: Floats, joint: int) -> float:
    """From neighbours as near as they come; robust weights keep single gross errors from hiding it."""
    rows = np.flatnonzero((problem.joint == joint) & np.isfinite(problem.gap_s))
    if len(rows) < FEWEST_NEIGHBOURS:
        return LEAST_MEMORY_S
    near = rows[problem.gap_s[rows] < NEAR * np.min(problem.gap_s[rows])]
    w, one, two = problem.weights[near], misfit[near], misfit[problem.before[near]]
    along = float(np.sum(w * one * two)) / max(float(np.sum(w * (one**2 + two**2))) / 2.0, 1e-300)
    gap = float(np.mean(problem.gap_s[near]))
    return float(np.clip(-gap / np.log(np.clip(along, 1e-6, MOST_ALONG)), LEAST_MEMORY_S, MOST_MEMORY_S))


def _freedom(problem: TorqueProblem, theta: Floats) -> Floats:
    """(joint,) data over data less what was fitted to them: the trace of its part of the hat matrix."""
    slope, n = problem.jacobian(theta), problem.drivers.n_joints
    leverage = np.sum((slope @ covariance_of(problem, slope)) * slope, axis=1)
    count, fitted = np.bincount(problem.joint, minlength=n), np.bincount(problem.joint, leverage, minlength=n)
    return np.asarray(count / np.maximum(count - fitted, limits.MOST_FITTED * np.maximum(count, 1)))


def covariance_of(problem: TorqueProblem, slope: Floats) -> Floats:
    """(parameter, parameter) posterior for the derivatives (datum, parameter) of the whitened residual."""
    unit, sigma = plausible_sizes(problem.parameters), priors(problem.parameters)
    scaled = slope * unit
    inverse = np.linalg.pinv(scaled.T @ scaled + np.diag((unit / sigma) ** 2), hermitian=True)
    return np.asarray(unit[:, None] * inverse * unit)


def _likelihood(problem: TorqueProblem, misfit: Floats) -> tuple[float, Floats]:
    """-2 log L of what is new in each datum, and its weights."""
    alone = replace(problem, weights=np.ones(len(misfit)))
    value, weights = likelihood_of(alone.whitened(misfit)[:, None], np.ones((len(misfit), 1, 1)))
    return value - 2.0 * float(np.sum(np.log(alone.scale))), weights


def with_torque(drivers: MotionDrivers, links: Floats, terms: Sequence[Accepted] = ()) -> MotionDrivers:
    """With the load of these links, and of what the terms add to it, at every moment, also of joints that stand."""
    n, carried = drivers.n_joints, links.copy()
    for a in terms:
        if a.term.physics == PAYLOAD.physics:
            last = len(NUMBERS) * (n - 1)
            carried[last : last + len(a.coefficients)] += a.coefficients
    torque = (drivers.link_columns @ carried).reshape(-1, n)
    for a in terms:
        if a.term.physics in LOADS:
            torque = torque + a.at(drivers)
    rate = (drivers.rate_columns @ carried).reshape(-1, n)  # of links and payload
    extra = {**drivers.extra, **{f"tau{i + 1}": torque[:, i] for i in range(n)}}
    tilted = (drivers.lean_columns @ carried).reshape(-1, n, 2)
    out = replace(drivers, torque_nm=torque, torque_rate_nm_s=rate, tilted=tilted, extra=extra)
    beside = [a for a in terms if a.term.physics != PAYLOAD.physics]
    return replace(out, torque_rate_nm_s=rate + _rate_of(beside, out)) if beside else out


def _rate_of(terms: Sequence[Accepted], drivers: MotionDrivers) -> Floats:
    """(moment, joint) derivative by time of what terms add: moments stand too far apart for a slope."""
    ahead, back = (drivers.moved_on(h) for h in (RATE_STEP_S, -RATE_STEP_S))
    return np.asarray(sum((a.at(ahead) - a.at(back) for a in terms), np.zeros_like(drivers.qd)) / (2.0 * RATE_STEP_S))
