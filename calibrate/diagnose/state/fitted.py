"""A session with geometry and terms fitted together: robust, with the noise that the residuals show.

Weights and least squares take turns (calibrate/fit/noise/scatter.py); drivers that the model predicts are refreshed in
between. Where several rows are distrusted, a new term that could make them so is tried from unit weights, too: data of
a moved seat resemble outliers to the model before it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose import limits
from calibrate.diagnose.state.assumed import Assumed
from calibrate.diagnose.state.effect_problem import EffectProblem, plain_sizes
from calibrate.diagnose.state.in_sight import in_sight, solve_in_sight
from calibrate.diagnose.state.linearised import UnseenMisfits, WhitenedRows
from calibrate.diagnose.state.noise_of_fit import (
    SessionNoise,
    covariance_at,
    noise_of,
    whiteners_of,
)
from calibrate.diagnose.state.session import Session, drivers_of
from calibrate.fit.identify.session import assumed_sigma
from calibrate.fit.noise import Scatter, likelihood_of
from calibrate.fit.solvers import (
    FAR_START,
    NEAR_START,
    Loss,
    Stop,
    solve,
)
from calibrate.model.effects.catalogue import Listed
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.moved import changes
from calibrate.model.effects.ports import Port
from calibrate.model.effects.term import Accepted, Form, Term
from calibrate.model.effects.time_laws import FEWEST_AFTER
from calibrate.model.parameters import (
    Parameter,
    plausible_sizes,
    priors,
    start_values,
)
from calibrate.model.problem import whitener_of
from calibrate.model.sensors import point_line, seat
from calibrate.model.with_effects.chain import ChainAt
from calibrate.model.with_effects.driver_values import as_before

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

DAMPING = 1e-9  # of the first step: along what the data see it is a Gauss-Newton step
AT_REST = (Stop.GAIN, Stop.ROUNDING)  # of a solver that found the least squares of its weights
PLACES = ("placement", seat.POINTS, point_line.POINTS)  # of where something stood; a place may be met unseen


@dataclass(frozen=True, eq=False)
class Fitted:
    """State of calibrate/diagnose/state/linearised.py."""

    session: Session
    active: Ints  # samples that the fit sees, sorted
    problem: EffectProblem
    values: Floats  # of the problem's parameters
    noise: SessionNoise  # of each instrument, over its active rows
    covariance: Floats  # (value, value) posterior; zero for held ones
    steps: int = 0  # of the solver, in all rounds of weights
    stop: Stop = Stop.ROUNDS  # the rule that ended the last round
    before: Listed | None = None  # of the state that this one was refitted from

    @cached_property
    def _split(self) -> tuple[Floats, tuple[Accepted, ...]]:
        return self.problem.split(self.values)

    @property
    def geometry(self) -> Floats:
        """(param,) values of session.parameters."""
        return self._split[0]

    @property
    def accepted(self) -> tuple[Accepted, ...]:
        return self._split[1][self.problem.given :]

    @property
    def brought(self) -> tuple[Accepted, ...]:
        """Terms of the model beside which this is sought."""
        return self._split[1][: self.problem.given]

    @property
    def scatters(self) -> tuple[Scatter, ...]:
        """Of each instrument, over its active rows: of what it does not share with another."""
        return self.noise.scatters

    @property
    def samples(self) -> int:
        return len(self.active)

    @property
    def most_search_rows(self) -> int:
        return limits.MOST_SEARCH_ROWS

    @property
    def distrusted(self) -> int:
        return sum(int(np.sum(s.weights < limits.DISTRUSTED_WEIGHT)) for s in self.scatters)

    def trusting(self) -> "Fitted":
        noise = self.noise.trusted
        return replace(self, problem=noise.under(self.problem), noise=noise)

    @cached_property
    def around(self) -> ChainAt:
        """Frames and expected readings of all samples, active or not."""
        return self.problem.around(self.values)

    @property
    def drivers(self) -> Drivers:
        """As this state predicts them, or those that it was fitted with where they are hardly others."""
        return self._drivers

    @cached_property
    def _drivers(self) -> Drivers:
        last = self.problem.drivers
        return last if last is not None and as_before(last, self.predicted) else self.predicted

    @cached_property
    def predicted(self) -> Drivers:
        """Drivers at these very values."""
        joint, session = self.session.weighting.unweighted, self.session
        expected = {m.name: e for m, e in zip(session.measured, self.around.expected, strict=True)}
        own = {m.name: joint.of_block(i, self.geometry) for i, m in enumerate(session.measured)}
        return drivers_of(session, self.around.frames, expected, own)

    @cached_property
    def listed(self) -> Listed:
        """The catalogue at these drivers."""
        kept = self.before
        return kept if kept is not None and kept.drivers is self.drivers else Listed(self.drivers)

    @property
    def rows(self) -> WhitenedRows:
        return self._rows

    @cached_property
    def _rows(self) -> WhitenedRows:
        parameters = self.problem.parameters
        free = np.flatnonzero([p.free for p in parameters])
        with_prior = free[np.isfinite(priors(parameters)[free])]
        scale, sigma = plausible_sizes(parameters), priors(parameters)
        blocks = sum(block.rows for block in self.session.weighting.known)
        assumed = 0 if self.problem.assumed is None else len(self.problem.assumed.root)
        known = blocks + assumed
        residual = np.concatenate(
            [
                -self.problem.residual(self.values),
                -(self.values - start_values(parameters))[with_prior] / sigma[with_prior],
            ]
        )
        prior_rows = np.zeros((len(with_prior), len(free)))
        prior_rows[range(len(with_prior)), np.searchsorted(free, with_prior)] = scale[with_prior] / sigma[with_prior]
        slope = self.problem.forgetting().jacobian(self.values)[:, free] * scale[free]
        none = np.full(known + len(with_prior), -1, dtype=np.intp)
        labels = [np.concatenate([x, none]) for x in self._labels]
        stated = len(self._labels[0]) + blocks + np.arange(assumed)
        return WhitenedRows(
            residual, np.concatenate([slope, prior_rows]), *labels, owner=self.problem.owner[free], stated=stated
        )

    @cached_property
    def _labels(self) -> tuple[Ints, Ints, Ints]:
        """Of the data rows: sample, group, instrument."""
        sample, group, instrument = [], [], []
        seen = 0
        for i, (m, rows) in enumerate(zip(self.session.measured, self.problem.rows, strict=True)):
            k = m.problem.observed.shape[1]
            sample.append(np.repeat(m.sample_rows[rows, -1], k))
            group.append(np.repeat(np.arange(seen, seen + len(rows)), k))
            instrument.append(np.full(len(rows) * k, i))
            seen += len(rows)
        return np.concatenate(sample), np.concatenate(group), np.concatenate(instrument)

    @property
    def minus_two_log_likelihood(self) -> float:
        return self._minus_two_log_likelihood

    @cached_property
    def _minus_two_log_likelihood(self) -> float:
        parameters = self.problem.parameters[: len(self.session.parameters)]
        sigma = priors(parameters)
        with_prior = np.isfinite(sigma) & np.array([p.free for p in parameters])
        away = (self.geometry - start_values(parameters))[with_prior] / sigma[with_prior]
        known = self.problem.residual(self.values)[len(self._labels[0]) :]
        return sum(s.minus_two_log_likelihood for s in self.scatters) + float(away @ away + known @ known)

    def columns(self, term: Term, inner: Floats) -> Floats:
        return self.columns_at(term, [inner])[0].T

    def columns_at(self, term: Term, inner: Sequence[Floats]) -> Floats:
        """A search asks for thousands: where a row follows one sample alone, by what the components of a port do."""
        drivers, sample, rows = self.drivers, self._labels[0], len(self.rows.residual)
        directions = term.along(drivers) if isinstance(term, Form) else None
        if isinstance(term, Form) and directions is not None and self._single:
            values = np.swapaxes([self.listed.function(term, one) for one in inner], 1, 2).take(sample, axis=2)
            lever = directions.T @ self._lever(term.port, len(directions))
            out = np.empty((len(inner), values.shape[1], len(lever), rows))
            np.multiply(values[:, :, None], lever, out=out[..., : len(sample)])
        else:
            basis = np.stack([term.basis(drivers, one) for one in inner])
            out = np.empty((len(inner), basis.shape[3], rows))
            out[..., : len(sample)] = (
                np.einsum("wr,erwm->emr", self._lever(term.port, basis.shape[2]), basis.take(sample, axis=1))
                if self._single
                else [self._felt(term.port, one) for one in basis]
            )
        out[..., len(sample) :] = 0.0
        return out.reshape(len(inner), -1, rows)

    @cached_property
    def _single(self) -> bool:
        """Whether every row follows one sample alone."""
        return self.problem.shared is None and all(m.sample_rows.shape[1] == 1 for m in self.session.measured)

    def _felt(self, port: Port, basis: Floats) -> Floats:
        """(m, data row) whitened, what a port adds by a basis (sample, width, m)."""
        parts = self.problem.whitened(self.problem.chain.columns(port, basis, self.around))
        return np.concatenate([part.reshape(-1, part.shape[-1]) for part in parts]).T

    def _lever(self, port: Port, width: int) -> Floats:
        """(width, data row) whitened, what each component of a port does."""
        if port not in self._levers:
            each = np.broadcast_to(np.eye(width), (len(self.around.frames), width, width))
            self._levers[port] = np.ascontiguousarray(self._felt(port, each))
        return self._levers[port]

    @cached_property
    def _levers(self) -> dict[Port, Floats]:
        return {}

    def candidates(self) -> Sequence[Term]:
        return self._candidates

    @cached_property
    def _candidates(self) -> tuple[Term, ...]:
        """Closed and open menus and the ports ask for them in turn."""
        assumed, every = self.problem.assumed, self.listed.terms
        if assumed is None:
            return every
        if assumed.of_difference:
            every = tuple(term.of_a_difference() if isinstance(term, Form) else term for term in every)
        return (*every, *changes(self.drivers))

    def refitted(self, accepted: Sequence[Accepted]) -> "Fitted":
        kept, many_distrusted = {a.term.key for a in self.accepted}, self.distrusted >= FEWEST_AFTER
        fits = [self._refitted(tuple(accepted), self.noise)]
        if many_distrusted and any(a.term.key not in kept and _makes_outliers(a.term) for a in accepted):
            fits.append(self._refitted(tuple(accepted), self.noise.trusted))
        return replace(min(fits, key=lambda fit: fit.minus_two_log_likelihood), before=self.listed)

    def renewed(self) -> "Fitted":
        return _settled(self, renewing=True)

    def select(self, samples: Ints) -> "Fitted":
        return _cut(self, np.sort(samples))

    def held_out(self, samples: Ints) -> tuple[UnseenMisfits, ...]:
        rows = _rows_of(self.session, np.sort(samples))
        moved = places_found(self.problem, self.values, self.scatters, rows, len(self._labels[0]))
        at = self.problem.around(moved)
        misfits = [m.problem.observed - e for m, e in zip(self.session.measured, at.expected, strict=True)]
        apart = misfits if self.noise.shared is None else self.noise.shared.apart(misfits)
        out: list[UnseenMisfits] = []
        for i, (m, r) in enumerate(zip(self.session.measured, rows, strict=True)):
            if len(r) == 0 or len(self.problem.rows[i]) == 0:  # without a row in the fit its noise is unknown
                continue
            W = whitener_of(covariance_at(self.scatters[i], self.problem.rows[i], r))
            out.append(
                UnseenMisfits(m.name, m.sample_rows[r, -1], misfits[i][r], np.einsum("nij,nj->ni", W, apart[i][r]))
            )
        return tuple(out)

    def _refitted(self, accepted: tuple[Accepted, ...], noise: SessionNoise) -> "Fitted":
        given, assumed = self.problem.given, self.problem.assumed
        terms = (*self._split[1][:given], *accepted)
        drivers, whiteners, rows = self.drivers if terms else None, whiteners_of(noise.scatters), self.problem.rows
        sizes = plain_sizes(self.session, terms, drivers, whiteners, rows)
        chain, known = self.session.chain(terms, drivers), self.problem.known.of_other_effects()
        problem = EffectProblem(self.session, chain, rows, whiteners, sizes, given, assumed, known=known)
        return _settled(_turn(problem, self.active, problem.from_geometry(self.geometry), noise))


def fit_geometry(session: Session, active: Ints | None = None) -> Fitted:
    """Geometry alone, from the closed-form start; `active` samples only, all if None."""
    chosen = np.arange(len(session.samples)) if active is None else np.sort(active)
    rows = _rows_of(session, chosen)
    unit = tuple(
        np.eye(m.problem.observed.shape[1]) / assumed_sigma(m)[r].mean()
        for m, r in zip(session.measured, rows, strict=True)
    )
    whiteners = tuple(np.broadcast_to(W, (len(r), *W.shape)) for W, r in zip(unit, rows, strict=True))
    problem = EffectProblem(session, session.chain(), rows, whiteners)
    fits: list[Fitted] = []
    for loss in (Loss.SQUARE, Loss.HUBER):
        seen = in_sight(problem, session.start)
        rough = solve_in_sight(
            problem, session.start, seen, damping=FAR_START, tolerance=limits.TURN_TOLERANCE, loss=loss
        )
        fits.append(_settled(_turn(problem, chosen, rough.theta, noise_of(problem, rough))))
        if all(np.all(s.weights > limits.UNTRUSTED_WEIGHT) for s in fits[0].scatters):
            break
    return min(fits, key=lambda fit: fit.minus_two_log_likelihood)


def given(fit: Fitted) -> Fitted:
    """The same fit, its terms from now on taken as geometry: a search asks what there is beside them."""
    return replace(fit, problem=replace(fit.problem, given=len(fit.problem.terms)))


def fit_from_model(
    session: Session, geometry: Fitted, terms: tuple[Accepted, ...], assumed: Assumed, start: Floats, unit: Floats
) -> Fitted:
    """A recording under what a model states of it, from `start` (value,). `geometry`: the same recording, alone.

    `unit` (assumed value,): a step over which readings are linear.
    """
    noise = geometry.noise.trusted
    whiteners, rows = whiteners_of(noise.scatters), geometry.problem.rows
    sizes = plain_sizes(session, terms, geometry.drivers, whiteners, rows)
    chain = session.chain(terms, geometry.drivers)
    problem = noise.under(EffectProblem(session, chain, rows, whiteners, sizes, len(terms)))
    free = np.flatnonzero([p.free for p in problem.parameters])
    near = assumed.held_near(problem.jacobian(start), np.setdiff1d(free, assumed.at), unit)
    return _settled(_turn(replace(problem, assumed=near), geometry.active, start, noise))


def _makes_outliers(term: Term) -> bool:
    """Whether data without the term may resemble gross errors: few of them follow it."""
    return term.slow or term.open


def _settled(fitted: Fitted, renewing: bool = False) -> Fitted:
    """Weights and least squares in turns, until the solver is at rest and the likelihood changes no more; not settled,
    but no longer either, where a turn changes it so little that all turns together would decide nothing.

    Of turns that differ in what they take noise for, the likeliest: no refit ends worse than it was. Derivatives may be
    kept from turn to turn, but the turn that ends it begins with those of its own values. `renewing`: with drivers as
    every turn predicts them, the last one as good as its own, which a likelier turn under others would not be.
    """
    best, resting = fitted, False
    for turn in range(1, limits.FIT_TURNS):
        last, problem = fitted, fitted.problem
        anew = resting or turn + 1 == limits.FEWEST_TURNS
        problem = problem.forgetting() if anew else problem
        if fitted.problem.terms and (renewing or turn <= limits.REFRESHED_TURNS):
            problem = problem.refreshed(last.predicted if renewing else last.drivers)
        new = _turn(
            problem,
            fitted.active,
            fitted.values,
            fitted.noise,
            limits.LAST_TOLERANCE if anew else limits.TURN_TOLERANCE,
        )
        fitted = replace(new, steps=fitted.steps + new.steps)
        best = fitted if renewing else min(best, fitted, key=lambda fit: fit.minus_two_log_likelihood)
        gained = last.minus_two_log_likelihood - fitted.minus_two_log_likelihood
        least = limits.SETTLED if new.stop in AT_REST else limits.CREEPING
        resting = turn + 1 >= limits.FEWEST_TURNS and abs(gained) < least
        if resting and anew:
            return replace(best, steps=fitted.steps, stop=Stop.LIKELIHOOD if new.stop in AT_REST else Stop.ROUNDS)
    return replace(best, steps=fitted.steps, stop=Stop.ROUNDS)


def _turn(
    problem: EffectProblem, active: Ints, start: Floats, noise: SessionNoise, tolerance: float = limits.TURN_TOLERANCE
) -> Fitted:
    """Least squares under the noise so far, along what the data see, then the noise that is left."""
    problem = noise.under(problem)
    seen = in_sight(problem, start)
    fit = solve_in_sight(problem, start, seen, damping=DAMPING, max_steps=limits.SOLVER_STEPS, tolerance=tolerance)
    noise = noise_of(problem, fit)
    return Fitted(problem.session, active, problem, fit.theta, noise, fit.covariance, fit.steps, fit.stop)


def _cut(state: Fitted, active: Ints) -> Fitted:
    rows, shared = _rows_of(state.session, active), state.noise.shared
    each = zip(state.session.measured, state.around.expected, strict=True)
    misfits = [m.problem.observed - expected for m, expected in each]
    apart = misfits if shared is None else shared.apart(misfits)
    scatters: list[Scatter] = []
    for i, r in enumerate(rows):
        covariance = covariance_at(state.scatters[i], state.problem.rows[i], r)
        value, weights = likelihood_of(apart[i][r], covariance)
        scatters.append(Scatter(covariance, weights, value, state.scatters[i].free))
    noise = SessionNoise(tuple(scatters), shared)
    problem = replace(noise.under(state.problem), rows=rows, known=state.problem.known.of_other_rows())
    return replace(state, active=active, problem=problem, noise=noise)


def _rows_of(session: Session, active: Ints) -> tuple[Ints, ...]:
    return tuple(np.flatnonzero(np.isin(m.sample_rows, active).all(axis=1)) for m in session.measured)


def places_found(
    problem: EffectProblem, values: Floats, scatters: tuple[Scatter, ...], rows: tuple[Ints, ...], data_rows: int
) -> Floats:
    """Values in which places that the fit has not met are found from these rows of each instrument, all else held.

    `data_rows`: of the problem's own rows, those of readings.
    """
    parameters = problem.parameters
    place = np.array([p.free and p.name.startswith(PLACES) for p in parameters])
    met = np.any(problem.jacobian(values)[:data_rows] != 0.0, axis=0)
    unmet = place & ~met
    if not unmet.any():
        return values
    whiteners = tuple(
        whitener_of(covariance_at(s, old, r)) for s, old, r in zip(scatters, problem.rows, rows, strict=True)
    )
    held = tuple(p if u else replace(p, free=False) for p, u in zip(parameters, unmet, strict=True))
    there = problem.with_rows(rows, whiteners)
    return solve(_Held(there, held), start=values, damping=NEAR_START).theta


@dataclass(frozen=True, eq=False)
class _Held:
    """A problem with other priors."""

    problem: EffectProblem
    parameters: tuple[Parameter, ...]

    def residual(self, theta: Floats) -> Floats:
        return self.problem.residual(theta)

    def jacobian(self, theta: Floats) -> Floats:
        return self.problem.jacobian(theta)
