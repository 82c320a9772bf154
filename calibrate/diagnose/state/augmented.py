"""Geometry and terms as one least-squares problem under given weights, for any solver of calibrate/fit/solvers."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.state.assumed import Assumed
from calibrate.diagnose.state.session import Session
from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.noise import SharedScatter
from calibrate.model.arms.coupled_readings import by_readings, recoupled
from calibrate.model.arms.serial import SerialArm
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Perturbation, Place, Port
from calibrate.model.effects.term import Accepted
from calibrate.model.parameters import Parameter
from calibrate.model.problem import Measured
from calibrate.model.rigid import inverse
from calibrate.model.with_effects.ported_chain import (
    Look,
    adjoints,
    flange_twists,
    joint_turns,
    look,
    offsets,
    perturbed_frames,
    through,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

NEAR = 1e-5  # m, rad: directions that the data hardly see are differences of columns that are large by themselves
INNER_STEP = 1e-3  # of the range of an inner parameter, for its difference quotient
PART_STEP = 1e-3  # m, rad: whether a part of the arm follows a parameter at all
KEPT = 8  # arms of which that is remembered
FEW = 0.9  # of the samples: where a fit sees fewer, derivatives are computed of those alone
LOOSE = 1e3  # times the size that would be plain to see: prior about a coefficient, so that none is ever singular


@dataclass(frozen=True, eq=False)
class Around:
    """The session at one set of values."""

    by: Perturbation
    frames: Floats  # (sample, joint + 1, 4, 4)
    looks: tuple[Look, ...]
    expected: tuple[Floats, ...]  # (row, k) with reading terms
    adjoint: dict[int, Floats] = field(default_factory=dict[int, Floats])  # (sample, 6, 6) of the frames asked for

    @cached_property
    def turns(self) -> Floats:
        """(sample, 6, joint) base twist of the flange by each joint angle."""
        return joint_turns(self.frames)

    def twists(self, port: Port, basis: Floats) -> Floats:
        """(sample, 6, m) as `flange_twists`; a search asks for thousands at the same frames."""
        if port.place is Place.JOINTS:
            return self.turns @ basis
        if port.place is not Place.FRAME:
            return flange_twists(self.frames, port, basis)
        if port.index not in self.adjoint:
            self.adjoint[port.index] = adjoints(self.frames[:, port.index])
        return self.adjoint[port.index] @ basis


@dataclass(frozen=True, eq=False)
class Kept:
    """Derivatives by geometry at one set of values, without weights; they serve for all values near it.

    A slope that is hardly off moves the least squares by next to nothing of a sigma, since what it is multiplied with
    is noise; residuals are never taken from it.
    """

    geometry: Floats  # (param,)
    by: Perturbation
    slopes: tuple[Floats, ...]  # of each instrument (row, k, param)
    few: Ints | None  # samples that they are of; None: all

    def near(self, geometry: Floats, by: Perturbation, few: Ints | None) -> bool:
        """Whether frames are nearly those of the slopes. What acts on a reading moves no frame."""
        if not _same(self.few, few):
            return False
        parts = zip(_moving(self.by), _moving(by), strict=True)
        off = [np.abs(geometry - self.geometry), *(np.abs(old - new) for old, new in parts)]
        return max(float(part.max(initial=0.0)) for part in off) < NEAR


def _same(one: Ints | None, other: Ints | None) -> bool:
    return one is other if one is None or other is None else np.array_equal(one, other)


def _moving(by: Perturbation) -> tuple[Floats, ...]:
    return by.joints_rad, by.frames, by.surroundings


@dataclass(frozen=True, eq=False)
class Augmented:
    """LeastSquares. Values are those of the geometry, then coefficients and smooth inner values of each term.

    `drivers` stand still during a fit: they are refreshed between fits. Rows of each instrument are those of `rows`.
    """

    session: Session
    terms: tuple[Accepted, ...]
    drivers: Drivers | None  # needed where there are terms
    rows: tuple[Ints, ...]  # of each instrument, the active ones
    whiteners: tuple[Floats, ...]  # (active row, k, k) robust weights included
    sizes: tuple[Floats, ...]  # of each term (coefficient,) that would be plain to see; inf where it does nothing
    given: int = 0  # terms, the first ones, that a model brought along: to a search they are geometry
    assumed: Assumed | None = None  # what that model states of the values
    shared: SharedScatter | None = None  # scatter that instruments have in common; a weight, too
    last: dict[bytes, Around] = field(default_factory=dict[bytes, Around])
    slopes: dict[bytes, list[Floats]] = field(default_factory=dict[bytes, list[Floats]])
    kept: list[Kept] = field(default_factory=list[Kept])  # at most one: where derivatives were computed last
    added: dict[int, list[Floats]] = field(default_factory=dict[int, list[Floats]])  # of terms, as near as `kept`

    def under(self, whiteners: tuple[Floats, ...], shared: SharedScatter | None = None) -> "Augmented":
        """The same with other weights: what was computed last without weights is kept."""
        return replace(self, whiteners=whiteners, shared=shared)

    def refreshed(self, drivers: Drivers) -> "Augmented":
        """The same with other drivers."""
        return self if drivers is self.drivers else replace(self, drivers=drivers, last={}, slopes={}, added={})

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self._parameters

    @cached_property
    def _parameters(self) -> tuple[Parameter, ...]:
        out = list(self.session.parameters)
        for i, accepted in enumerate(self.terms):
            out += [
                Parameter(f"term{i}.c{j}", "1", s, start=0.0, prior=LOOSE * s, free=bool(np.isfinite(s)))
                if np.isfinite(s)
                else Parameter(f"term{i}.c{j}", "1", 1.0, free=False)
                for j, s in enumerate(self.sizes[i])
            ]
            for inner in accepted.term.inner:
                if not inner.discrete:
                    width = inner.upper - inner.lower
                    out.append(
                        Parameter(f"term{i}.{inner.name}", "1", 0.1 * width, lower=inner.lower, upper=inner.upper)
                    )
        return tuple(out)

    @cached_property
    def owner(self) -> Ints:
        """(parameter,) index of the term that it belongs to, those given not counted, -1: geometry or given."""
        out = [np.full(len(self.session.parameters), -1, dtype=np.intp)]
        for i, accepted in enumerate(self.terms):
            smooth = sum(not inner.discrete for inner in accepted.term.inner)
            out.append(np.full(len(accepted.coefficients) + smooth, max(i - self.given, -1), dtype=np.intp))
        return np.concatenate(out)

    @property
    def start(self) -> Floats:
        """(geometry unknown to this class: zeros,) then the values that the terms came with."""
        parts = [np.zeros(len(self.session.parameters))]
        for accepted in self.terms:
            smooth = [not inner.discrete for inner in accepted.term.inner]
            parts += [accepted.coefficients, accepted.inner[np.array(smooth, dtype=bool)]]
        return np.concatenate(parts)

    def split(self, values: Floats) -> tuple[Floats, tuple[Accepted, ...]]:
        """Geometry (param,), and the terms with these values."""
        n = len(self.session.parameters)
        out: list[Accepted] = []
        at = n
        for accepted in self.terms:
            m = len(accepted.coefficients)
            coefficients, at = values[at : at + m], at + m
            inner = accepted.inner.copy()
            for j, spec in enumerate(accepted.term.inner):
                if not spec.discrete:
                    inner[j], at = values[at], at + 1
            out.append(Accepted(accepted.term, coefficients, inner))
        return values[:n], tuple(out)

    def around(self, values: Floats) -> Around:
        """Frames and readings at these values; kept, since residual and derivative are asked for in turn."""
        key = values.tobytes()
        if key not in self.last:
            self.last.clear()
            self.last[key] = self._around(values)
        return self.last[key]

    def residual(self, theta: Floats) -> Floats:
        at, geometry = self.around(theta), theta[: len(self.session.parameters)]
        misfits = [e - m.problem.observed for m, e in zip(self.session.measured, at.expected, strict=True)]
        each = zip(self.apart(misfits), self.rows, self.whiteners, strict=True)
        parts = [np.einsum("nij,nj->ni", W, misfit[rows]).ravel() for misfit, rows, W in each]
        joint, first = self.session.weighting.unweighted, len(self.session.measured)
        parts += [
            block.residual(joint.of_block(first + i, geometry)) for i, block in enumerate(self.session.weighting.known)
        ]
        parts += [] if self.assumed is None else [self.assumed.residual(theta)]
        return np.concatenate(parts)

    def jacobian(self, theta: Floats) -> Floats:
        """By derivatives that were kept, where these values are near them."""
        slopes = self._slopes(theta)
        each = (
            self.whitened(slopes) if self._few is None else [W @ c for W, c in zip(self.whiteners, slopes, strict=True)]
        )
        parts = [whitened.reshape(-1, whitened.shape[-1]) for whitened in each]
        joint, geometry = self.session.weighting.unweighted, theta[: len(self.session.parameters)]
        extra = len(theta) - len(geometry)
        for i, block in enumerate(self.session.weighting.known, start=len(self.session.measured)):
            known = joint.spread(i, block.jacobian(joint.of_block(i, geometry)))
            parts.append(np.concatenate([known, np.zeros((len(known), extra))], axis=1))
        parts += [] if self.assumed is None else [self.assumed.jacobian(len(theta))]
        return np.concatenate(parts)

    def forgetting(self) -> "Augmented":
        """The same; derivatives are computed where they are asked for next."""
        return replace(self, slopes={}, kept=[], added={})

    def apart(self, parts: Sequence[Floats]) -> list[Floats]:
        """Rows (row, k, ...) of every instrument less what they share with those of the second encoders."""
        return list(parts) if self.shared is None else self.shared.apart(parts)

    def whitened(self, columns: Sequence[Floats]) -> list[Floats]:
        """Of each instrument's active rows (active row, k, m), from columns (row, k, m) of all of them."""
        return [W @ c[rows] for W, c, rows in zip(self.whiteners, self.apart(columns), self.rows, strict=True)]

    @cached_property
    def _few(self) -> Ints | None:
        """(sample,) of the active rows, where these are few; None: all, also where instruments may share scatter."""
        measured = self.session.measured
        if any(m.encoder_channels is not None for m in measured):
            return None
        seen = [m.sample_rows[rows].ravel() for m, rows in zip(measured, self.rows, strict=True)]
        samples = np.unique(np.concatenate(seen))
        return samples if len(samples) < FEW * len(self.session.samples) else None

    @cached_property
    def _measured(self) -> tuple[Measured, ...]:
        """Instruments with the rows that derivatives are of, samples counted among `_few`."""
        few, each = self._few, zip(self.session.measured, self.rows, strict=True)
        if few is None:
            return self.session.measured
        cut = [m.select(rows) for m, rows in each]
        return tuple(replace(m, sample_rows=np.searchsorted(few, m.sample_rows)) for m in cut)

    def _seen(self, at: Around, geometry: Floats) -> Around:
        """What derivatives are taken at: of the samples of the active rows alone, where these are few."""
        few, joint = self._few, self.session.weighting.unweighted
        if few is None:
            return at
        looks = [look(m, joint.of_block(i, geometry), at.frames[few]) for i, m in enumerate(self._measured)]
        return Around(at.by.of(few), at.frames[few], tuple(looks), ())

    def _slopes(self, theta: Floats) -> list[Floats]:
        """Of each instrument (row, k, value) without weights, of its active rows alone where samples are few; kept,
        since weights change more often than values.
        """
        key = theta.tobytes()
        if key not in self.slopes:
            self.slopes.clear()
            at, (geometry, terms) = self.around(theta), self.split(theta)
            seen = self._seen(at, geometry)
            if not (self.kept and self.kept[0].near(geometry, at.by, self._few)):
                self.kept[:] = [Kept(geometry, at.by, self._own_slopes(geometry, seen), self._few)]
                self.added.clear()
            added = [self._added(i, accepted, seen) for i, accepted in enumerate(terms)]
            self.slopes[key] = [
                np.concatenate([own, *(columns[i] for columns in added)], axis=-1)
                for i, own in enumerate(self.kept[0].slopes)
            ]
        return self.slopes[key]

    def _own_slopes(self, geometry: Floats, at: Around) -> tuple[Floats, ...]:
        """Of each instrument (row, k, param)."""
        arm, joint = self._arm_twists(geometry[: len(self.session.arm.parameters)], at), self.session.weighting
        return tuple(self._own_slope(joint.unweighted, i, m, at, arm) for i, m in enumerate(self._measured))

    def _added(self, i: int, accepted: Accepted, at: Around) -> list[Floats]:
        """Columns of a term; those that bend with an inner value are computed for every one."""
        if any(not spec.discrete for spec in accepted.term.inner):
            return self._term_columns(accepted, at)
        if i not in self.added:
            self.added[i] = self._term_columns(accepted, at)
        return self.added[i]

    def _arm_twists(self, theta: Floats, at: Around) -> Floats:
        """(sample, 6, param) of the frames as terms have moved them, each before or behind what a term adds there."""
        if not (np.any(at.by.frames) or np.any(at.by.surroundings)):
            more_rad = recoupled(self.session.arm.by_reading, at.by.joints_rad)
            q_rad = self.session.samples.joints()
            return self.session.arm.twists(theta, (q_rad if self._few is None else q_rad[self._few]) + more_rad)
        B = at.frames.copy()
        for i in np.flatnonzero(np.any(at.by.frames != 0.0, axis=(0, 2))):
            B[:, i] = B[:, i] @ inverse(offsets(at.by.frames[:, i]))
        arm = self.session.arm
        return np.where(ends_of_links(arm), arm.twists_at(theta, B), arm.twists_at(theta, at.frames))

    @staticmethod
    def _own_slope(joint: JointProblem, i: int, m: Measured, at: Around, arm: Floats) -> Floats:
        return joint.spread(i, np.concatenate([through(at.looks[i], m, arm), at.looks[i].by_sensor], axis=-1))

    def by_joint(self, at: Around, i: int) -> Floats:
        """(row, k, readings) derivative of instrument i's readings by the joint readings of the row's poses."""
        turns, m = by_readings(self.session.arm.by_reading, at.turns), self.session.measured[i]
        each = [by @ turns[rows] for by, rows in zip(at.looks[i].by_twists, m.sample_rows.T, strict=True)]
        return np.concatenate(each, axis=-1)

    def _around(self, values: Floats) -> Around:
        geometry, terms = self.split(values)
        q = self.session.samples.joints()
        by = Perturbation.none(len(q), self.session.arm.n_joints)
        for accepted in terms:
            amount = accepted.term.amount(self._drivers, accepted.coefficients, accepted.inner)
            by = by.plus(accepted.term.port, amount)
        theta = geometry[: len(self.session.arm.parameters)]
        frames = perturbed_frames(self.session.arm, theta, q, by)
        joint = self.session.weighting.unweighted
        looks = tuple(look(m, joint.of_block(i, geometry), frames) for i, m in enumerate(self.session.measured))
        return Around(by, frames, looks, tuple(map(self._read, self.session.measured, looks, [by] * len(looks))))

    @staticmethod
    def _read(measured: Measured, seen: Look, by: Perturbation) -> Floats:
        expected, rows = seen.expected, measured.sample_rows[:, -1]
        if (channels := measured.encoder_channels) is not None:
            expected = expected + by.between_rad[np.ix_(rows, channels)]
        return expected if measured.name not in by.readings else expected + by.readings[measured.name][rows]

    @property
    def _drivers(self) -> Drivers:
        if self.drivers is None:
            raise ValueError("terms need drivers: give those of the last state")
        return self.drivers

    def _term_columns(self, accepted: Accepted, at: Around) -> list[Floats]:
        """Of each instrument (row, k, coefficients and smooth inner values)."""
        basis = accepted.term.basis(self._drivers, accepted.inner)
        parts = [basis]
        for j, spec in enumerate(accepted.term.inner):
            if not spec.discrete:
                parts.append(self._by_inner(accepted, j, INNER_STEP * (spec.upper - spec.lower))[..., None])
        basis = np.concatenate(parts, axis=-1)
        return columns_of(self._measured, accepted.term.port, basis if self._few is None else basis[self._few], at)

    def _by_inner(self, accepted: Accepted, j: int, step: float) -> Floats:
        low, high = accepted.inner.copy(), accepted.inner.copy()
        low[j], high[j] = low[j] - step / 2.0, high[j] + step / 2.0
        amount = accepted.term.amount
        return (
            amount(self._drivers, accepted.coefficients, high) - amount(self._drivers, accepted.coefficients, low)
        ) / step

    def columns(self, port: Port, basis: Floats, at: Around) -> list[Floats]:
        """Of each instrument (row, k, m) derivative of its readings by what a port adds (sample, width, m)."""
        return columns_of(self.session.measured, port, basis, at)


@lru_cache(maxsize=KEPT)
def ends_of_links(arm: SerialArm) -> NDArray[np.bool_]:
    """(param,) whether each moves its frame from the link's side, hence before what a term adds at that frame; the
    others turn or shift what comes behind it.
    """
    nominal, n = np.zeros(len(arm.parameters)), len(arm.parameters)
    parts = arm.fixed_parts(nominal)
    moved = [np.any(arm.fixed_parts(step) != parts, axis=(1, 2)) for step in PART_STEP * np.eye(n)]
    return np.array([bool(part[frame]) for part, frame in zip(moved, arm.moves_frame, strict=True)], dtype=bool)


def plain_sizes(
    session: Session,
    terms: Sequence[Accepted],
    drivers: Drivers | None,
    whiteners: Sequence[Floats],
    rows: Sequence[Ints],
) -> tuple[Floats, ...]:
    """Of each term (coefficient,) size that would show as one sigma per observation; inf where it does nothing.

    At the session's drawing: good enough for a size.
    """
    if not terms or drivers is None:
        return ()
    frames, joint = drivers.frames, session.weighting.unweighted
    looks = tuple(look(m, joint.of_block(i, session.start), frames) for i, m in enumerate(session.measured))
    at = Around(Perturbation.none(len(frames), session.arm.n_joints), frames, looks, ())
    out: list[Floats] = []
    for accepted in terms:
        basis = accepted.term.basis(drivers, accepted.inner)
        columns = columns_of(session.measured, accepted.term.port, basis, at)
        seen = [(W @ c[r]).reshape(-1, c.shape[-1]) for c, r, W in zip(columns, rows, whiteners, strict=True)]
        felt = np.sqrt(np.mean(np.concatenate(seen) ** 2, axis=0))
        with np.errstate(divide="ignore"):
            out.append(np.where((felt > 0.0) & np.any(basis != 0.0, axis=(0, 1)), 1.0 / felt, np.inf))
    return tuple(out)


def columns_of(measured: Sequence[Measured], port: Port, basis: Floats, at: Around) -> list[Floats]:
    """Of each instrument (row, k, m) derivative of its readings by what a port adds (sample, width, m)."""
    if port.place is not Place.READING:
        twists = at.twists(port, basis)
        return [
            through(seen, m, twists) if (channels := m.encoder_channels) is None else _between(port, basis, m, channels)
            for seen, m in zip(at.looks, measured, strict=True)
        ]
    return [
        basis[m.sample_rows[:, -1]] if m.name == port.instrument else np.zeros((*seen.expected.shape, basis.shape[-1]))
        for seen, m in zip(at.looks, measured, strict=True)
    ]


def _between(port: Port, basis: Floats, measured: Measured, channels: Ints) -> Floats:
    """(row, channel, m) what second encoders see of a port that is no reading: turns of the joints before them."""
    rows = measured.sample_rows[:, -1]
    if not port.between_encoders:
        return np.zeros((len(rows), len(channels), basis.shape[-1]))
    return basis[np.ix_(rows, channels)]
