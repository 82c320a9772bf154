"""Is what a model leaves the noise that the rig file states? Three answers: yes, the statement is wrong, or no.

Only a stated noise, or repeats taken close in time, may be called noise. Scatter beyond it by half is either a wrong
statement or physics without a column. A wrong statement looks the same at every posture, whatever the lever of the
joints, and at every time: each of these is tested, and what speaks for and against is listed with the answer.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.spatial import KDTree

from calibrate.diagnose.assess import limits
from calibrate.diagnose.assess.joint_scatter import innocent
from calibrate.diagnose.search.null import Tail
from calibrate.diagnose.state.fitted import Fitted
from calibrate.diagnose.state.linearised import UnseenMisfits, tame
from calibrate.diagnose.state.noise_of_fit import freedom
from calibrate.fit.identify.session import assumed_sigma
from calibrate.model.checks.gross_error import postures
from calibrate.model.effects.term import Missing
from calibrate.model.sensors.catalogue import kind_of
from calibrate.model.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE
from calibrate.model.sensors.kind import Quantity, SensorKind, Trait

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

HIDDEN = ("cmd_minus_q", "approach", "qd", "payload")  # drivers that make poses scatter when they are not recorded


class Statement(Enum):
    """Words of docs/formats.md, of the noise that the rig file states."""

    AGREES = "agrees"
    WRONG = "wrong"  # what is left is noise, but of another size
    EXCEEDED = "exceeded"  # what is left is more than noise
    ABSENT = "absent"
    UNTESTED = "untested"  # too few readings to show more than how large it is


@dataclass(frozen=True)
class NoiseFound:
    """What a model leaves of one quantity of an instrument, beside the noise that is stated of it."""

    instrument: str
    quantity: str  # as in calibrate/model/sensors/kind.py, "" where the reading is one quantity
    unit: str  # of `stated` and `found`: "m" or "rad"
    stated: float | None  # rms of one coordinate; None where the rig file states nothing
    found: float
    times: float | None  # found over stated
    times_sigma: float | None
    statement: Statement
    supports: tuple[str, ...]  # that what is left is noise
    opposes: tuple[str, ...]

    @property
    def says(self) -> str:
        """One sentence; empty where there is nothing to report."""
        noun = _noun(kind_of(self.instrument), self.quantity)
        if self.times is None or self.stated is None or self.statement not in (Statement.WRONG, Statement.EXCEEDED):
            return ""
        size = f"({_size(self.found, self.unit)}; stated {_size(self.stated, self.unit)})"
        if self.statement is Statement.WRONG:
            return f"noise of the {noun} is {_times(self.times)} × the stated value {size}"
        why = f": {'; '.join(self.opposes)}" if self.opposes else ""
        return f"{_times(self.times)} × the stated noise of the {noun} is left {size}{why}"


def noise_found(model: Fitted, rng: Generator, *, unnamed: bool) -> tuple[NoiseFound, ...]:
    """Of every instrument that reads the arm. `unnamed`: structure is known to be left, so that nothing is noise."""
    larger = freedom(model.problem, model.values, model.covariance)
    out: list[NoiseFound] = []
    seen = {u.instrument: u for u in model.held_out(model.active)}
    for i, measured in enumerate(model.session.measured):
        if measured.name == ENCODER_DIFFERENCE or measured.name not in seen:
            continue
        for quantity in kind_of(measured.name).quantities:
            out.append(_found(model, i, quantity, seen[measured.name], float(larger[i]), rng, unnamed=unnamed))
    return tuple(out)


def missing_words(missing: Sequence[Missing]) -> str:
    """The columns that make poses scatter when they are absent, for the end of a sentence; empty without any."""
    columns = ", ".join(dict.fromkeys(m.column for m in hidden_of(missing)))
    return f"; missing columns that could explain it: {columns}" if columns else ""


def hidden_of(missing: Sequence[Missing]) -> tuple[Missing, ...]:
    """Of what is not recorded, that which would scatter a pose from one visit to the next."""
    return tuple(m for m in missing if m.driver in HIDDEN)


def _found(
    model: Fitted, i: int, quantity: Quantity, unseen: UnseenMisfits, larger: float, rng: Generator, *, unnamed: bool
) -> NoiseFound:
    name, misfit = unseen.instrument, unseen.misfit[:, quantity.part]
    stated = _stated(model, i, quantity)
    by = np.full_like(misfit, np.sqrt(np.mean(misfit**2))) if stated is None else stated
    good = tame(misfit / np.maximum(by, 1e-300), 1e-300)
    found = float(np.sqrt(larger * np.mean(misfit[good] ** 2)))
    if stated is None:
        return NoiseFound(name, quantity.name, quantity.unit, None, found, None, None, Statement.ABSENT, (), ())
    square = larger * np.mean((misfit[good] / stated[good]) ** 2, axis=1)
    mean, error = float(np.mean(square)), float(np.std(square) / np.sqrt(len(square)))
    times = float(np.sqrt(mean))
    answer, supports, opposes = Statement.AGREES, (), ()
    if times > limits.MORE_THAN_STATED and mean - 1.0 > limits.MORE_THAN_STATED_SIGMAS * error:
        supports, opposes = _evidence(model, i, quantity, unseen, good, rng)
        if supports + opposes and times > limits.STATEMENT_WRONG_BY:
            opposes = (f"no statement is wrong by more than {limits.STATEMENT_WRONG_BY:.0f} times", *opposes)
        noise = Statement.EXCEEDED if opposes or unnamed else Statement.WRONG
        answer = noise if supports + opposes else Statement.UNTESTED
    said, sigma = float(np.sqrt(np.mean(stated**2))), float(error / max(2.0 * times, 1e-300))
    return NoiseFound(name, quantity.name, quantity.unit, said, found, times, sigma, answer, supports, opposes)


def _stated(model: Fitted, i: int, quantity: Quantity) -> Floats | None:
    """(row, k) sigma as the rig file states it, joints included where it states them; None where it does not."""
    kind, noise = kind_of(model.session.measured[i].name), model.session.rig.noise
    if any(getattr(noise, key, None) is None for key in _keys(kind, quantity)):
        return None
    own = _own(model, i, quantity)
    if noise.joint_rad is None:
        return None if Trait.CONES in kind.traits else own  # a seated probe is read by its joints
    return np.asarray(np.sqrt(own**2 + noise.joint_rad**2 * np.sum(_levers(model, i, quantity) ** 2, axis=0)))


def _keys(kind: SensorKind, quantity: Quantity) -> set[str]:
    """Of the rig's [noise], in the unit of the quantity."""
    return {s.key for s in kind.noise if s.unit == quantity.unit}


def _own(model: Fitted, i: int, quantity: Quantity) -> Floats:
    """(row, k) sigma of the instrument alone. What a row states of itself is the scatter within its own average, and
    what the rig file states that of a reading: a reading may be as bad as the worse of the two.
    """
    measured, noise = model.session.measured[i], model.session.rig.noise
    own = assumed_sigma(measured)[model.problem.rows[i]][:, quantity.part]
    for key in _keys(kind_of(measured.name), quantity):
        own = np.maximum(own, getattr(noise, key, None) or 0.0)
    return own


def _levers(model: Fitted, i: int, quantity: Quantity) -> Floats:
    """(joint reading, row, k) by which the readings follow each joint."""
    by_joint = model.problem.chain.by_joint(model.around, i)[model.problem.rows[i]]
    return np.moveaxis(by_joint[:, quantity.part], 2, 0)


def _evidence(
    model: Fitted, i: int, quantity: Quantity, unseen: UnseenMisfits, good: NDArray[np.bool_], rng: Generator
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What supports that the scatter is noise, and what opposes it; nothing of either where rows are too few."""
    misfit, sample, drivers = unseen.misfit[good][:, quantity.part], unseen.sample[good], model.drivers
    if len(misfit) < limits.NOISE_OBSERVATIONS:
        return (), ()
    tried = [
        _close_in_time(misfit, np.array([]) if drivers.repeat is None else drivers.repeat[sample], sample),
        _by_lever(*_whitened(model, i, quantity, misfit, good), stated=model.session.rig.noise.joint_rad is not None),
        _by_posture(misfit, drivers.q_rad[sample], sample, rng),
    ]
    given = [one for one in tried if one is not None]
    return tuple(words for good, words in given if good), tuple(words for good, words in given if not good)


def _whitened(
    model: Fitted, i: int, quantity: Quantity, misfit: Floats, good: NDArray[np.bool_]
) -> tuple[Floats, Floats]:
    """Misfit (row, k) and levers (joint, row, k) by the noise as stated, which may be that of the joints."""
    own = _own(model, i, quantity)[good]
    levers, joint_rad = _levers(model, i, quantity)[:, good], model.session.rig.noise.joint_rad or 0.0
    form = joint_rad**2 * np.einsum("jok,jol->okl", levers, levers) + own[:, :, None] ** 2 * np.eye(own.shape[1])
    L = np.linalg.cholesky(form)
    return np.linalg.solve(L, misfit[..., None])[..., 0], np.linalg.solve(L, levers[..., None])[..., 0]


def _close_in_time(misfit: Floats, repeat: Ints, sample: Ints) -> tuple[bool, str] | None:
    """Repeats that follow one another within a few rows: nothing but noise has changed between them."""
    pairs = close_pairs(repeat, sample)
    if len(pairs) < limits.CLOSE_PAIRS:
        return None
    close = float(np.sqrt(np.mean((misfit[pairs[:, 0]] - misfit[pairs[:, 1]]) ** 2) / 2.0))
    ratio = float(np.sqrt(np.mean(misfit**2))) / max(close, 1e-300)
    if ratio <= limits.BEYOND_REPEATS * (1.0 + 1.0 / np.sqrt(len(pairs) * misfit.shape[1])):
        return True, f"{len(pairs)} repeats taken close in time scatter as much"
    return False, f"{len(pairs)} repeats taken close in time scatter {ratio:.2g} times less"


def close_pairs(repeat: Ints, sample: Ints) -> Ints:
    """(pair, 2) rows that repeat one pose within a few samples; `repeat` (row,) -1 where none, `sample` (row,)."""
    out: list[tuple[int, int]] = []
    for group in np.unique(repeat[repeat >= 0]):
        mine = np.flatnonzero(repeat == group)
        mine = mine[np.argsort(sample[mine], kind="stable")]
        out += [(int(a), int(b)) for a, b in pairwise(mine) if sample[b] - sample[a] <= limits.ROWS_CLOSE_IN_TIME]
    return np.array(out, dtype=np.intp).reshape(-1, 2)


def _by_lever(misfit: Floats, joints: Floats, *, stated: bool) -> tuple[bool, str]:
    """Noise of an instrument does not know how far the joints are. `stated`: how well joints come back is."""
    through, plain = innocent(misfit, joints), innocent(misfit, 0.0 * joints)
    if (
        through.two_log_likelihood - plain.two_log_likelihood > limits.THROUGH_JOINTS
        and through.share > limits.STRUCTURE_SHARE
    ):
        size = np.sqrt(through.share * np.mean(misfit**2) / np.mean(np.sum(joints**2, axis=0)))
        back = f" as if each came back within {_size(size, 'rad')}; state [noise] joint_rad where the arm is known to"
        return False, f"the scatter follows the levers of the joints{'' if stated else back}"
    return True, "it does not follow the levers of the joints"


def _by_posture(misfit: Floats, q_rad: Floats, sample: Ints, rng: Generator) -> tuple[bool, str]:
    """Noise does not come back at the same posture. Null: rows exchanged."""
    near = neighbours(q_rad, sample)
    z = misfit / np.sqrt(np.mean(misfit**2))
    drawn = np.array(
        [_alike(z[order], near) for order in (rng.permutation(len(z)) for _ in range(limits.NEIGHBOURS_DRAWS))]
    )
    seen = _alike(z, near)
    if seen > limits.STRUCTURE_SHARE and Tail(drawn).p(seen) < limits.NEIGHBOURS_ALPHA:
        return False, "neighbours in posture taken at other times err alike"
    return True, "neighbours in posture taken at other times do not err alike"


def neighbours(q_rad: Floats, sample: Ints) -> Ints:
    """(row, few) the rows nearest in posture, of those taken at other times."""
    posture = postures(q_rad)
    near = KDTree(posture).query(posture, k=min(len(q_rad), limits.NEIGHBOURS + 2 * limits.ROWS_CLOSE_IN_TIME + 1))[1]
    soon = np.abs(sample[near] - sample[:, None]) <= limits.ROWS_CLOSE_IN_TIME
    return np.take_along_axis(near, np.argsort(soon, axis=1, kind="stable"), axis=1)[:, : limits.NEIGHBOURS]


def _alike(z: Floats, near: Ints) -> float:
    """Mean product of a row and its neighbours."""
    return float(np.mean(np.sum(z * np.mean(z[near], axis=1), axis=1)))


def _noun(kind: SensorKind, quantity: str) -> str:
    return kind.noun if quantity == kind.quantities[0].name else f"{quantity}s"


def _size(value: float, unit: str) -> str:
    return f"{1e6 * value:.3g} {'µm' if unit == 'm' else 'µrad'}"


def _times(value: float) -> str:
    return f"{value:.2g}" if value < 10.0 else f"{value:.0f}"
