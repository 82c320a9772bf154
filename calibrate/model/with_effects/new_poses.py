"""Drivers at poses that were not measured: joints given, all else as at measured poses drawn at random.

Many terms scale their drivers by what the session holds, or choose their columns by it (strongest combinations of
unknown masses, knots), so new poses stand behind the measured ones, and a term is asked for both: coefficients are then
those that give the measured poses what they had. The measured ones may stand there many times, so that new poses hardly
change what is chosen.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.catalogue import terms_of
from calibrate.model.effects.drivers import Drivers, Readout
from calibrate.model.effects.ports import Place
from calibrate.model.effects.term import Accepted, Term

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

BASE = "base.pose"
SAME = 1e-6  # of a term's size: what rounding may leave between the two sets of coefficients
NEARLY = 0.05  # of a term's size: columns that are chosen by the poses may leave that much, a tenth of any sigma


def moves_tool(term: Term) -> bool:
    """Whether the tool stands elsewhere in the cell by it: by joints, links, and a base that leans under the arm.

    A fixture or a device that moves leaves the tool where it was; a base that was knocked moves all that follows alike.
    """
    if term.port.place is Place.SURROUNDINGS:
        return term.port.where == BASE and "t" not in term.depends_on
    return term.port.place is not Place.READING


def extended(drivers: Drivers, q_rad: Floats, frames: Floats, like: Ints, copies: int = 1) -> Drivers:
    """With poses (new, joint) and their frames behind; of everything else the new ones are like measured poses."""
    measured = np.tile(np.arange(len(drivers.q_rad)), copies)
    return replace(
        rearranged(drivers, np.concatenate([measured, like])),
        q_rad=np.concatenate([drivers.q_rad[measured], q_rad]),
        frames=np.concatenate([drivers.frames[measured], frames]),
    )


def rearranged(drivers: Drivers, order: Ints) -> Drivers:
    """Some of the poses, in this order."""
    return replace(drivers, **{f.name: _rows(getattr(drivers, f.name), order) for f in fields(drivers)})


def _rows(held: object, order: Ints) -> Any:
    """Of everything that is held for each pose."""
    if isinstance(held, np.ndarray):
        return held[order]
    if isinstance(held, Mapping):
        return {name: _rows(one, order) for name, one in held.items()}
    if isinstance(held, Readout):
        return replace(held, **{f.name: _rows(getattr(held, f.name), order) for f in fields(held)})
    return held


def carried_over(accepted: Accepted, old: Drivers, new: Drivers) -> Floats | None:
    """(new pose, width, coefficient) what the coefficients add at the poses behind those of `old`.

    None: it would have to give the measured poses something else than they had.
    """
    was, now = accepted.term.basis(old, accepted.inner), _basis(accepted, new)
    return None if now is None else with_meaning(now, was, accepted.coefficients)


def with_meaning(now: Floats, was: Floats, coefficients: Floats) -> Floats | None:
    """(new pose, width, coefficient) of a basis (pose, width, m) at the measured and the new poses, as the coefficients
    mean it that were found with `was` at the measured ones. None as above.
    """
    n = len(was)
    same, level = alike(now[:n], was)
    size, left = was @ coefficients, (was - now[:n] @ same - level) @ coefficients
    return now[n:] @ same + level if np.linalg.norm(left) <= NEARLY * np.linalg.norm(size) else None


def alike(basis: Floats, was: Floats) -> tuple[Floats, Floats]:
    """(m, k) coefficients of `basis` (pose, width, m) that come nearest to `was` (pose, width, k); (width, k) a level.

    The level is zero but for terms that count from the mean of their driver, which more poses move.
    """
    n, width, m = basis.shape
    k = was.shape[-1]
    columns, wanted = basis.reshape(-1, m), was.reshape(-1, k)
    same, *_ = np.linalg.lstsq(columns, wanted, rcond=None)
    if np.linalg.norm(columns @ same - wanted) <= SAME * np.linalg.norm(wanted):
        return np.asarray(same, dtype=np.float64), np.zeros((width, k))
    both, *_ = np.linalg.lstsq(np.concatenate([columns, np.tile(np.eye(width), (n, 1))], axis=1), wanted, rcond=None)
    return np.asarray(both[:m], dtype=np.float64), np.asarray(both[m:], dtype=np.float64)


def _basis(accepted: Accepted, new: Drivers) -> Floats | None:
    """Of the term, or of its like in the longer session: some know the poses that they were listed for."""
    own = accepted.term.basis(new, accepted.inner)
    if len(own) == len(new.q_rad):
        return own
    listed: Term | None = next((t for t in terms_of(new) if t.key == accepted.term.key), None)
    return None if listed is None else listed.basis(new, accepted.inner)
