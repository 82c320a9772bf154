"""Each parameter of the arm now and then: only what both determine, and only what is of the arm itself.

Where base, target, laser, fixture or cones stand differs from session to session without any drift of the arm. Several
parameters are looked at, so one is called changed only where chance would bring such a change to any of them in one
comparison of a hundred (Bonferroni: Dunn, J. American Statistical Association 56, 1961). Both sigmas add in quadrature;
where both owe something to the same drawing that is too careful, never too bold.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from acquisition.recording.rig import Rig
from calibrate.model_file import Covariance, ModelFile, ModelParameter
from calibrate.report.drift.drawing import drawn_values, redrawn

Floats = NDArray[np.float64]

FAMILY = 0.01  # chance that any of all unchanged parameters is called changed
OF_THE_ARM = ("joint", "link")
SPARE = 1e-12  # of the largest: a direction in which the doubt is rounding


@dataclass(frozen=True)
class Change:
    """One parameter, drawing and correction together; angles differ by less than half a turn."""

    name: str
    unit: str
    now: float
    then: float
    sigma: float  # of the change
    significant: bool

    @property
    def change(self) -> float:
        off = self.now - self.then
        return math.remainder(off, 2.0 * math.pi) if self.unit == "rad" else off

    @property
    def sigmas(self) -> float:
        """Size of the change over its doubt."""
        return abs(self.change) / self.sigma


@dataclass(frozen=True)
class Together:
    """All changes at once: chi-square of as many, and the chance of one as large where nothing changed."""

    chi2: float
    dof: int
    p: float

    @property
    def significant(self) -> bool:
        return self.p < FAMILY


@dataclass(frozen=True)
class Compared:
    """What can be compared, and what cannot, with the reason."""

    changes: tuple[Change, ...]
    limit_sigmas: float  # from here on a change is no chance
    together: Together | None  # None where nothing can be compared, or a covariance is missing
    left_out: tuple[tuple[str, str], ...]  # name, why

    @property
    def significant(self) -> tuple[Change, ...]:
        """The clearest first."""
        return tuple(sorted((c for c in self.changes if c.significant), key=lambda c: -c.sigmas))


def compared(now: ModelFile, rig_now: Rig, then: ModelFile, rig_then: Rig) -> Compared:
    """Of two models of one kind of arm with as many joints; rigs as in their models."""
    ours, theirs = ({p.name: p for p in model.parameters if _of_the_arm(p.name)} for model in (now, then))
    moved = redrawn(rig_now, rig_then)
    whys = {name: _why_not(ours.get(name), theirs.get(name), moved) for name in dict.fromkeys((*ours, *theirs))}
    both = [name for name, why in whys.items() if why is None]
    limit = float(norm.isf(FAMILY / (2.0 * max(len(both), 1))))
    drawn_now, drawn_then = drawn_values(rig_now), drawn_values(rig_then)
    changes = tuple(
        _change(ours[name], theirs[name], drawn_now.get(name, 0.0), drawn_then.get(name, 0.0), limit) for name in both
    )
    left_out = tuple((name, why) for name, why in whys.items() if why is not None)
    return Compared(changes, limit, _together(changes, now, then), left_out)


def _of_the_arm(name: str) -> bool:
    return name.partition(".")[0].rstrip("0123456789") in OF_THE_ARM


def _why_not(now: ModelParameter | None, then: ModelParameter | None, moved: frozenset[str]) -> str | None:
    told = [p is not None and p.value is not None and p.sigma is not None for p in (now, then)]
    if not any(told):
        return "determined by neither"
    if not all(told):
        return "determined only then" if told[1] else "determined only now"
    if now is not None and now.name.partition(".")[0] in moved:
        return "drawn differently in the two rig files"
    return None


def _change(now: ModelParameter, then: ModelParameter, drawn_now: float, drawn_then: float, limit: float) -> Change:
    values = drawn_now + (now.value or 0.0), drawn_then + (then.value or 0.0)
    sigma = math.hypot(now.sigma or 0.0, then.sigma or 0.0)
    one = Change(now.name, now.unit, *values, sigma, significant=False)
    return Change(now.name, now.unit, *values, sigma, significant=one.sigmas > limit)


def doubt_of(changes: tuple[Change, ...], now: ModelFile, then: ModelFile) -> Floats | None:
    """(change, change) covariance of the changes; None where one of the models has none."""
    if now.covariance is None or then.covariance is None:
        return None
    names = [c.name for c in changes]
    return _among(now.covariance, names) + _among(then.covariance, names)


def _among(record: Covariance, names: list[str]) -> Floats:
    at = [record.names.index(name) for name in names]
    return np.array(record.rows)[np.ix_(at, at)]


def _together(changes: tuple[Change, ...], now: ModelFile, then: ModelFile) -> Together | None:
    covariance = doubt_of(changes, now, then)
    if covariance is None or not changes:
        return None
    scale = np.sqrt(np.diag(covariance))
    size, directions = np.linalg.eigh(covariance / np.outer(scale, scale))
    seen = size > SPARE * size[-1]
    along = directions[:, seen].T @ (np.array([c.change for c in changes]) / scale)
    total, dof = float(np.sum(along**2 / size[seen])), int(seen.sum())
    return Together(total, dof, float(chi2.sf(total, dof)))
