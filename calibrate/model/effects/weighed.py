"""Terms that follow weight: by stated masses, by stated masses with what they may be off by, and by unknown masses.

Masses of a rig file are wrong by a tenth or more, and geometry swallows most of a soft part's pattern, so what is left
over may be as much the error of the masses as the effect. Every port gets the same freedom: otherwise a soft joint with
free masses imitates the link behind it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.loads import (
    Load,
    carried,
    payload,
    uncertain_loads,
    unit_loads,
)
from calibrate.model.effects.ports import Port
from calibrate.model.effects.term import Form, Shape
from calibrate.model.effects.time_laws import varies

Floats = NDArray[np.float64]
By = Callable[[Drivers, Sequence[Load]], Floats]  # (pose, width, load) what each load adds per unit of compliance
Where = tuple[Port, tuple[str, ...], Shape, str]  # of a term: what it moves, by which drivers, its shape and physics

COMPLIANCE = "compliance_rad_nm"
STRONGEST = 4  # combinations of unknown masses
CORRECTIONS = 3  # strongest combinations of what stated masses may be off by
WEAKEST = 0.03  # of the strongest: below, a combination is not worth its column
UNSEEN = 0.01  # of the stated pattern: a smaller correction is not worth its column
UNLIKELY = 4.0  # sigmas by which no stated mass is off
KEPT = 2  # sessions whose columns are remembered: a fit asks for them at every step


@dataclass(frozen=True, eq=False)
class Weighed:
    """Columns of one variant; combinations are chosen once, so that coefficients keep their meaning."""

    at: Callable[[Drivers], Floats]  # (pose, width, m)
    names: tuple[str, ...]  # (m,) of the coefficients
    variant: str = ""
    corrections: int = 0  # last columns, which mend the first one, in sigmas of the stated masses
    stated: bool = True  # whether masses are

    def believable(self, coefficients: Floats, inner: Floats) -> bool:
        """Springs give way along their load; where masses are unknown, only the payload's column shows it."""
        if self.stated:
            return yields(coefficients, self.corrections)
        return self.names[-1] != COMPLIANCE or bool(coefficients[-1] >= 0.0)


def soft(where: Where, weighed: Weighed, limit: float, sentence: str) -> Form:
    """The term of a part that yields by these columns at all six coordinates of its port."""
    return Form(
        *where,
        variant=weighed.variant,
        function=lambda drivers, inner: weighed.at(drivers),
        names=weighed.names,
        limit=limit,
        sentence=sentence,
        believable=weighed.believable,
    )


def by_stated(by: By) -> Weighed:
    """One column: of stated masses and the payload."""

    def at(drivers: Drivers) -> Floats:
        return by(drivers, carried(drivers)).sum(axis=2, keepdims=True)

    return Weighed(lru_cache(maxsize=KEPT)(at), (COMPLIANCE,))


def by_corrected(drivers: Drivers, by: By) -> Weighed | None:
    """As by_stated, and the strongest combinations of the uncertainties of the masses that it does not hold itself.

    A coefficient of one of these, over the first, is a number of sigmas. None where they add nothing.
    """
    stated = by(drivers, carried(drivers)).sum(axis=2).ravel()
    # kept: a rig with one more mass stated has other uncertainties, but these columns keep their meaning
    off = uncertain_loads(drivers)
    each = by(drivers, off)
    each = each.reshape(-1, each.shape[2])
    along = stated @ each / max(float(stated @ stated), 1e-300)
    _, s, Vt = np.linalg.svd(each - np.outer(stated, along), full_matrices=False)
    kept = int(np.sum(s[:CORRECTIONS] > UNSEEN * np.linalg.norm(stated)))
    if kept == 0:
        return None
    mix = Vt[:kept].T

    def at(drivers: Drivers) -> Floats:
        plain = by(drivers, carried(drivers)).sum(axis=2, keepdims=True)
        moved = by(drivers, off) @ mix - plain * (along @ mix)
        return np.concatenate([plain, moved], axis=2)

    names = (COMPLIANCE, *(f"mass_correction{k}_rad_nm" for k in range(1, kept + 1)))
    return Weighed(lru_cache(maxsize=KEPT)(at), names, "masses corrected", kept)


def by_unknown(drivers: Drivers, by: By, first: int) -> Weighed | None:
    """Strongest combinations of masses at the frames from `first` on, each of rms 1; last the payload, where its mass
    is recorded: the only column that shows a compliance. None where no mass would show.
    """
    ones = by(drivers, unit_loads(drivers, first))
    flat = ones.reshape(-1, ones.shape[2])
    _, s, Vt = np.linalg.svd(flat, full_matrices=False)
    if s[0] <= 1e-9 * np.sqrt(len(ones)):
        return None
    kept = int(np.sum(s[:STRONGEST] > WEAKEST * s[0]))
    mix = Vt[:kept].T / s[:kept] * np.sqrt(len(ones))
    carries = drivers.payload_kg is not None and varies(drivers.payload_kg)

    def at(drivers: Drivers) -> Floats:
        columns = by(drivers, unit_loads(drivers, first)) @ mix
        if not carries:
            return columns
        carried_kg = np.zeros(len(drivers.t_s)) if drivers.payload_kg is None else drivers.payload_kg
        return np.concatenate([columns, by(drivers, [payload(drivers, carried_kg)])], axis=2)

    names = tuple(f"combination{k}_rad" for k in range(1, kept + 1))
    known = (COMPLIANCE,) if carries else ()
    return Weighed(lru_cache(maxsize=KEPT)(at), (*names, *known), "unknown masses", stated=False)


def yields(coefficients: Floats, corrections: int = 0) -> bool:
    """Whether all compliances are those of springs, which give way along the load, and no mass is off unbelievably."""
    springs = coefficients[: len(coefficients) - corrections]
    off = np.abs(coefficients[len(springs) :])
    return bool(np.all(springs >= 0.0) and np.all(off <= UNLIKELY * springs[0]))
