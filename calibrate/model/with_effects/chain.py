"""The chain with its effects: what every instrument reads at given values, and the derivative by every value.

Values are those of geometry, then of each effect its coefficients and its smooth inner values. Drivers of the effects
stand still meanwhile: who fits refreshes them between fits.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from calibrate.model.arms.coupled_readings import by_readings, recoupled
from calibrate.model.arms.serial import SerialArm, twists_of
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Perturbation, Place, Port
from calibrate.model.effects.term import Accepted
from calibrate.model.problem import Measured
from calibrate.model.rigid import inverse
from calibrate.model.unknowns import Unknowns
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
PART_STEP = 1e-3  # m, rad: whether a part of the arm follows a parameter at all
KEPT = 8  # arms of which that is remembered
FEW = 0.9  # of the samples: where a fit sees fewer, derivatives are computed of those alone


@dataclass(frozen=True, eq=False)
class ChainAt:
    """The chain at one set of values."""

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
class Slopes:
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


@dataclass(eq=False)
class Evaluations:
    """What was computed last of one chain, weights aside: residual and derivative are asked for in turn, and weights
    change more often than values. Whoever evaluates brings it along; where chains differ in part, they share a part.
    """

    at: dict[bytes, ChainAt] = field(default_factory=dict[bytes, ChainAt])
    slopes: dict[bytes, list[Floats]] = field(default_factory=dict[bytes, list[Floats]])
    near: list[Slopes] = field(default_factory=list[Slopes])  # at most one: where geometry's were computed last
    added: dict[int, list[Floats]] = field(default_factory=dict[int, list[Floats]])  # of effects, as near as `near`

    def of_other_drivers(self) -> "Evaluations":
        return Evaluations(near=self.near)

    def of_other_effects(self) -> "Evaluations":
        return Evaluations(near=list(self.near))

    def of_other_rows(self) -> "Evaluations":
        return Evaluations(dict(self.at), near=list(self.near))

    def anew(self) -> "Evaluations":
        """The same readings; derivatives are computed where they are asked for next."""
        return Evaluations(self.at)


@dataclass(frozen=True, eq=False)
class ActiveRows:
    """Rows of each instrument that derivatives are of."""

    measured: tuple[Measured, ...]
    rows: tuple[Ints, ...]
    samples: int

    @cached_property
    def few(self) -> Ints | None:
        """(sample,) of the rows, where these are few; None: all, also where instruments may share scatter."""
        if any(m.encoder_channels is not None for m in self.measured):
            return None
        seen = [m.sample_rows[rows].ravel() for m, rows in zip(self.measured, self.rows, strict=True)]
        samples = np.unique(np.concatenate(seen))
        return samples if len(samples) < FEW * self.samples else None

    @cached_property
    def seen(self) -> tuple[Measured, ...]:
        """Instruments with the rows that derivatives are of, samples counted among `few`."""
        few = self.few
        if few is None:
            return self.measured
        cut = [m.select(rows) for m, rows in zip(self.measured, self.rows, strict=True)]
        return tuple(replace(m, sample_rows=np.searchsorted(few, m.sample_rows)) for m in cut)


@dataclass(frozen=True, eq=False)
class Chain:
    """Arm, effects and instruments over all samples of a session."""

    arm: SerialArm
    q_rad: Floats  # (sample, joint)
    measured: tuple[Measured, ...]
    unknowns: Unknowns  # of geometry, blocks in the order of the instruments
    terms: tuple[Accepted, ...] = ()
    drivers: Drivers | None = None  # needed where there are terms

    @property
    def n_geometry(self) -> int:
        return len(self.unknowns.parameters)

    @property
    def of_effects(self) -> Floats:
        """(value,) that the effects came with."""
        return np.concatenate([np.zeros(0), *(accepted.values for accepted in self.terms)])

    def split(self, values: Floats) -> tuple[Floats, tuple[Accepted, ...]]:
        """Geometry (param,), and the terms with these values."""
        n = self.n_geometry
        out: list[Accepted] = []
        at = n
        for accepted in self.terms:
            end, smooth = at + len(accepted.coefficients), accepted.term.smooth
            inner = accepted.inner.copy()
            inner[smooth] = values[end : end + len(smooth)]
            out.append(Accepted(accepted.term, values[at:end], inner))
            at = end + len(smooth)
        return values[:n], tuple(out)

    def at(self, values: Floats, known: Evaluations | None = None) -> ChainAt:
        """Frames and readings at these values; with `known`, kept there."""
        if known is None:
            return self._at(values)
        key = values.tobytes()
        if key not in known.at:
            known.at.clear()
            known.at[key] = self._at(values)
        return known.at[key]

    def slopes(self, values: Floats, rows: ActiveRows, known: Evaluations) -> list[Floats]:
        """Of each instrument (row, k, value), of the active rows alone where samples are few; those by geometry may
        have been computed at values nearby.
        """
        key = values.tobytes()
        if key not in known.slopes:
            known.slopes.clear()
            at, (geometry, terms) = self.at(values, known), self.split(values)
            seen = self._seen(at, geometry, rows)
            if not (known.near and known.near[0].near(geometry, at.by, rows.few)):
                known.near[:] = [Slopes(geometry, at.by, self._by_geometry(geometry, seen, rows), rows.few)]
                known.added.clear()
            added = [self._added(i, accepted, seen, rows, known) for i, accepted in enumerate(terms)]
            known.slopes[key] = [
                np.concatenate([own, *(columns[i] for columns in added)], axis=-1)
                for i, own in enumerate(known.near[0].slopes)
            ]
        return known.slopes[key]

    def columns(self, port: Port, basis: Floats, at: ChainAt) -> list[Floats]:
        """Of each instrument (row, k, m) derivative of its readings by what a port adds (sample, width, m)."""
        return columns_of(self.measured, port, basis, at)

    def by_joint(self, at: ChainAt, i: int) -> Floats:
        """(row, k, readings) derivative of instrument i's readings by the joint readings of the row's poses."""
        turns, m = by_readings(self.arm.by_reading, at.turns), self.measured[i]
        each = [by @ turns[rows] for by, rows in zip(at.looks[i].by_twists, m.sample_rows.T, strict=True)]
        return np.concatenate(each, axis=-1)

    def _at(self, values: Floats) -> ChainAt:
        geometry, terms = self.split(values)
        added = ((accepted.term.port, accepted.at(self._drivers)) for accepted in terms)
        return self.under(geometry, Perturbation.of_all(len(self.q_rad), self.arm.n_joints, added))

    def under(self, geometry: Floats, by: Perturbation) -> ChainAt:
        """Frames and readings at values of geometry (param,), with what effects add at the samples."""
        frames = perturbed_frames(self.arm, geometry[: len(self.arm.parameters)], self.q_rad, by)
        looks = tuple(look(m, self.unknowns.of_block(i, geometry), frames) for i, m in enumerate(self.measured))
        return ChainAt(by, frames, looks, tuple(map(_read, self.measured, looks, [by] * len(looks))))

    @property
    def _drivers(self) -> Drivers:
        if self.drivers is None:
            raise ValueError("terms need drivers: give those of the last state")
        return self.drivers

    def _seen(self, at: ChainAt, geometry: Floats, rows: ActiveRows) -> ChainAt:
        """What derivatives are taken at: of the samples of the active rows alone, where these are few."""
        few = rows.few
        if few is None:
            return at
        looks = [look(m, self.unknowns.of_block(i, geometry), at.frames[few]) for i, m in enumerate(rows.seen)]
        return ChainAt(at.by.of(few), at.frames[few], tuple(looks), ())

    def _by_geometry(self, geometry: Floats, at: ChainAt, rows: ActiveRows) -> tuple[Floats, ...]:
        """Of each instrument (row, k, param)."""
        q_rad = self.q_rad if rows.few is None else self.q_rad[rows.few]
        arm = twists_by_arm(self.arm, geometry[: len(self.arm.parameters)], q_rad, at.by, at.frames)
        own = (
            np.concatenate([through(s, m, arm), s.by_sensor], axis=-1) for s, m in zip(at.looks, rows.seen, strict=True)
        )
        return tuple(self.unknowns.spread(i, slope) for i, slope in enumerate(own))

    def _added(self, i: int, accepted: Accepted, at: ChainAt, rows: ActiveRows, known: Evaluations) -> list[Floats]:
        """Columns of a term; those that bend with an inner value are computed for every one."""
        if accepted.term.smooth:
            return self._term_columns(accepted, at, rows)
        if i not in known.added:
            known.added[i] = self._term_columns(accepted, at, rows)
        return known.added[i]

    def _term_columns(self, accepted: Accepted, at: ChainAt, rows: ActiveRows) -> list[Floats]:
        """Of each instrument (row, k, coefficients and smooth inner values)."""
        by_inner = accepted.by_inner(lambda inner: replace(accepted, inner=inner).at(self._drivers))
        basis = np.concatenate([accepted.term.basis(self._drivers, accepted.inner), *by_inner], axis=-1)
        return columns_of(rows.seen, accepted.term.port, basis if rows.few is None else basis[rows.few], at)


def _read(measured: Measured, seen: Look, by: Perturbation) -> Floats:
    """(row, k) with reading terms."""
    expected, rows = seen.expected, measured.sample_rows[:, -1]
    if (channels := measured.encoder_channels) is not None:
        expected = expected + by.between_rad[np.ix_(rows, channels)]
    return expected if measured.name not in by.readings else expected + by.readings[measured.name][rows]


def twists_by_arm(arm: SerialArm, theta: Floats, q_rad: Floats, by: Perturbation, frames: Floats) -> Floats:
    """(sample, 6, param) base twist of the flange by the arm's values theta (param,), at the frames (sample, joint + 1,
    4, 4) that a perturbation has moved: each acts before or behind what is added there.
    """
    if not (np.any(by.frames) or np.any(by.surroundings)):
        return arm.twists(theta, q_rad + recoupled(arm.by_reading, by.joints_rad))
    out, body = arm.twists_at(theta, frames), arm.body_twists(theta)
    for i in np.flatnonzero(np.any(by.frames != 0.0, axis=(0, 2))):
        before = ends_of_links(arm) & (np.array(arm.moves_frame) == i)
        out[:, :, before] = twists_of(body[before], frames[:, i] @ inverse(offsets(by.frames[:, i])))
    return out


@lru_cache(maxsize=KEPT)
def ends_of_links(arm: SerialArm) -> NDArray[np.bool_]:
    """(param,) whether each moves its frame from the link's side, hence before what a term adds at that frame; the
    others turn or shift what comes behind it.
    """
    nominal, n = np.zeros(len(arm.parameters)), len(arm.parameters)
    parts = arm.fixed_parts(nominal)
    moved = [np.any(arm.fixed_parts(step) != parts, axis=(1, 2)) for step in PART_STEP * np.eye(n)]
    return np.array([bool(part[frame]) for part, frame in zip(moved, arm.moves_frame, strict=True)], dtype=bool)


def columns_of(measured: Sequence[Measured], port: Port, basis: Floats, at: ChainAt) -> list[Floats]:
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
