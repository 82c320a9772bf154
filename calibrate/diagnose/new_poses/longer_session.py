"""A fitted session with poses to come behind the measured ones: what any cause would add to readings not yet taken.

Fixture, seats and payload at a new pose are those of a measured one that it is like; time goes on. Terms scale their
drivers by what a session holds, so that coefficients are carried over to the longer session.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import per_joint
from calibrate.diagnose.state.assumed import Stated
from calibrate.diagnose.state.effect_problem import EffectProblem, plain_sizes
from calibrate.diagnose.state.fitted import Fitted
from calibrate.diagnose.state.session import Session, drivers_of
from calibrate.errors import DataError
from calibrate.fit.noise import SharedScatter, levers_of
from calibrate.model.effects.catalogue import terms_of
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.moved import changes
from calibrate.model.effects.term import Accepted, Term
from calibrate.model.parameters import plausible_sizes, priors
from calibrate.model.problem import Measured, whitener_of
from calibrate.model.with_effects.chain import Chain, ChainAt, columns_of
from calibrate.model.with_effects.new_poses import alike

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class NewPoses:
    """Poses to come."""

    q_rad: Floats  # (pose, joint)
    approach: Floats  # (pose, joint) -1 or 1: which way each joint comes
    like: Ints  # (pose,) measured sample whose fixture, seat, payload and temperatures it shares

    def __len__(self) -> int:
        return len(self.like)

    def take(self, chosen: Ints) -> "NewPoses":
        """Some of them, in that order."""
        return NewPoses(self.q_rad[chosen], self.approach[chosen], self.like[chosen])


@dataclass(frozen=True, eq=False)
class LongerSession:
    """Measured and new poses under one model; whitened by the noise that was found."""

    state: Fitted
    session: Session  # new poses behind the measured ones
    drivers: Drivers
    around: ChainAt
    rows: tuple[Ints, ...]  # of each instrument: those that the fit has seen, then those of new poses
    whiteners: tuple[Floats, ...]
    shared: SharedScatter | None

    def carried(self, accepted: Accepted) -> Accepted | None:
        """With the coefficients that give the measured poses what they had; None: a term that knows those only."""
        if isinstance(accepted.term, Stated):
            return replace(accepted, term=accepted.term.at(self.session.samples))
        term = self._terms.get(accepted.term.key)
        if term is None:
            return None
        was = accepted.at(self.state.drivers)
        same, _ = alike(term.basis(self.drivers, accepted.inner)[: len(was)], was[..., None])
        return Accepted(term, same[:, 0], accepted.inner)

    @cached_property
    def _terms(self) -> dict[tuple[object, ...], Term]:
        """By key, of the longer session: some terms know the poses that they were listed for."""
        since = () if self.state.problem.assumed is None else changes(self.drivers)
        return {term.key: term for term in (*terms_of(self.drivers), *since)}

    @cached_property
    def brought(self) -> tuple[Accepted, ...]:
        """Terms of a known model, which come first: what that model assumes is of their values, too.

        DataError for one that cannot be determined where poses have not been taken.
        """
        out = tuple(self.carried(a) for a in self.state.brought)
        unknown = next((a for a, now in zip(self.state.brought, out, strict=True) if now is None), None)
        if unknown is not None:
            raise DataError(f"what {unknown.term.physics} of the model adds at poses not yet taken is not known")
        return tuple(a for a in out if a is not None)

    def added(self, accepted: Accepted) -> tuple[Floats, Floats]:
        """What a carried term adds to the readings: (row,) of the measured rows, (pose, k) of the new ones."""
        amount = accepted.at(self.drivers)[..., None]
        columns = columns_of(self.session.measured, accepted.term.port, amount, self.around)
        seen = self._problem().whitened(columns)
        measured, new = self._split(seen)
        return measured[:, 0], new[..., 0]

    def fitted_along(self, terms: Sequence[Accepted]) -> tuple[Floats, Floats]:
        """Derivatives by geometry and by carried terms, those of a known model included, in plausible units: (row, m)
        of the measured rows and priors, (pose, k, m) of the new poses.
        """
        terms, known = (*self.brought, *terms), self.state.problem
        sizes = plain_sizes(self.session, terms, self.drivers, self.whiteners, self.rows)
        problem = replace(self._problem(terms, sizes), given=known.given, assumed=known.assumed)
        values = problem.from_geometry(self.state.geometry)
        parameters = problem.parameters
        free = np.flatnonzero([p.free for p in parameters])
        scale, sigma = plausible_sizes(parameters)[free], priors(parameters)[free]
        slope = problem.jacobian(values)[:, free] * scale
        ends = np.cumsum([len(r) * W.shape[-1] for r, W in zip(self.rows, self.whiteners, strict=True)])
        parts = np.split(slope, ends)
        seen = [p.reshape(-1, W.shape[-1], len(free)) for p, W in zip(parts, self.whiteners, strict=False)]
        measured, new = self._split(seen)
        return np.concatenate([measured, parts[-1], np.diag(scale / sigma)]), new

    def _problem(self, terms: Sequence[Accepted] = (), sizes: tuple[Floats, ...] = ()) -> EffectProblem:
        chain = self.session.chain(terms, self.drivers)
        return EffectProblem(self.session, chain, self.rows, self.whiteners, sizes, shared=self.shared)

    def _split(self, seen: Sequence[Floats]) -> tuple[Floats, Floats]:
        """(row, m) of measured rows and (pose, k of all instruments, m) of new ones, zero where none reads."""
        n, m = len(self.state.session.samples), seen[0].shape[-1]
        measured: list[Floats] = []
        new = np.zeros((len(self.session.samples) - n, sum(s.shape[1] for s in seen), m))
        at = 0
        for instrument, rows, values in zip(self.session.measured, self.rows, seen, strict=True):
            sample, k = instrument.sample_rows[rows, -1], values.shape[1]
            measured.append(values[sample < n].reshape(-1, m))
            new[sample[sample >= n] - n, at : at + k] = values[sample >= n]
            at += k
        return np.concatenate(measured), new


def at_new_poses(state: Fitted, poses: NewPoses) -> LongerSession:
    """A fitted session, and what it predicts of new poses. Bars, which a hand lays out, read nothing there."""
    n = len(state.session.samples)
    samples = _behind(state, poses)
    measured = tuple(_longer(m, n, poses, state, i) for i, m in enumerate(state.session.measured))
    session = replace(state.session, samples=samples, weighting=replace(state.session.weighting, measured=measured))
    rows = tuple(
        np.concatenate([seen, np.arange(m.problem.rows, longer.problem.rows)])
        for seen, m, longer in zip(state.problem.rows, state.session.measured, measured, strict=True)
    )
    whiteners = tuple(_whiteners(state, i, n, poses, measured[i]) for i in range(len(measured)))
    plain = session.chain()
    bare = plain.at(state.geometry)
    drivers, shared = _drivers(session, bare, state, poses), _shared(state, plain, bare)
    found = LongerSession(state, session, drivers, bare, rows, whiteners, shared)
    carried = (*found.brought, *(a for a in map(found.carried, state.accepted) if a is not None))
    chain = session.chain(carried, drivers)
    around = chain.at(np.concatenate([state.geometry, chain.of_effects]))
    return replace(found, drivers=_drivers(session, around, state, poses), around=around)


def _behind(state: Fitted, poses: NewPoses) -> Samples:
    """The measured rows, then the new poses, each with the conditions of the pose that it is like and its own moves."""
    samples = state.session.samples
    order = np.concatenate([np.arange(len(samples)), poses.like])
    columns = {name: values[order].copy() for name, values in samples.columns.items()}
    n, joints = len(samples), samples.n_joints
    moved = poses.q_rad - samples.joints()[poses.like]
    for i, (q, cmd) in enumerate(zip(per_joint("q", "_rad", joints), per_joint("cmd", "_rad", joints), strict=True)):
        columns[q][n:] = poses.q_rad[:, i]
        if cmd in columns:
            columns[cmd][n:] += moved[:, i]
    moves, sides = _with_moves(state, poses)
    columns |= dict(zip(per_joint("approach", "", joints), sides.T, strict=True))
    columns |= dict(zip(per_joint("last_move", "_rad", joints), moves.T, strict=True))
    t_s = samples.column("t_s")
    columns["t_s"][n:] = t_s.max() + np.ptp(t_s) / max(n - 1, 1)
    if "repeat" in columns:
        columns["repeat"][n:] = np.nan
    return Samples(columns, joints)


def _longer(m: Measured, n: int, poses: NewPoses, state: Fitted, i: int) -> Measured:
    """An instrument with rows of new poses behind, each like the row of a measured pose."""
    if m.sample_rows.shape[1] != 1:
        return m
    row_of = np.full(n, -1, dtype=np.intp)
    row_of[m.sample_rows[:, 0]] = np.arange(m.problem.rows)
    new = np.flatnonzero(row_of[poses.like] >= 0)
    out = m.select(np.concatenate([np.arange(m.problem.rows), row_of[poses.like[new]]]))
    q_rad = np.concatenate([m.problem.q_rad, poses.q_rad[new]])
    chain = out.problem.chain
    chain = chain.facing(chain.expect(state.session.weighting.unweighted.of_block(i, state.geometry), q_rad))
    problem = replace(out.problem, q_rad=q_rad, chain=chain)
    return replace(out, problem=problem, sample_rows=np.concatenate([m.sample_rows, n + new[:, None]]))


def _whiteners(state: Fitted, i: int, n: int, poses: NewPoses, longer: Measured) -> Floats:
    """Noise of a new row is that of the row it is like, without its robust weight."""
    scatter, seen = state.scatters[i], state.problem.rows[i]
    known = whitener_of(scatter.covariance) * np.sqrt(scatter.weights)[:, None, None]
    sample = state.session.measured[i].sample_rows[seen, -1]
    new = longer.sample_rows[longer.sample_rows[:, -1] >= n, -1] - n
    at = np.searchsorted(sample, poses.like[new]) if np.all(np.diff(sample) >= 0) else np.zeros(len(new), dtype=np.intp)
    like = scatter.covariance[np.minimum(at, len(sample) - 1)]
    return np.concatenate([known, whitener_of(like)])


def _shared(state: Fitted, longer: Chain, at: ChainAt) -> SharedScatter | None:
    """What instruments share at new poses, where second encoders answer as well."""
    shared, measured = state.noise.shared, longer.measured
    if shared is None:
        return None
    chains, by_joint = [m.problem.chain for m in measured], [longer.by_joint(at, i) for i in range(len(measured))]
    return replace(shared, levers=levers_of(chains, [m.sample_rows for m in measured], by_joint))


def _drivers(session: Session, at: ChainAt, state: Fitted, poses: NewPoses) -> Drivers:
    joint = session.weighting.unweighted
    expected = {m.name: e for m, e in zip(session.measured, at.expected, strict=True)}
    own = {m.name: joint.of_block(i, state.geometry) for i, m in enumerate(session.measured)}
    out = drivers_of(session, at.frames, expected, own)
    moves, sides = _with_moves(state, poses)
    # Smoothed over the session's own time: new poses have the temperatures of those that they are like.
    known = state.drivers.temperatures_degC
    warm = {place: np.concatenate([values, values[poses.like]]) for place, values in known.items()}
    return replace(
        out,
        last_move_rad=moves,
        approach=sides,
        approach_derived=state.drivers.approach_derived,
        temperatures_degC=warm,
    )


def _with_moves(state: Fitted, poses: NewPoses) -> tuple[Floats, Floats]:
    """Last moves in rad and sides, (row, joint): of the measured rows as known, of new ones by their own approach."""
    known, moves = state.drivers.approach, state.drivers.last_move_rad
    before = np.zeros((len(moves), poses.approach.shape[1])) if known is None else known
    usual = np.median(np.abs(moves), axis=0)
    return np.concatenate([moves, poses.approach * usual]), np.concatenate([before, poses.approach])
