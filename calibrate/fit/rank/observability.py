"""How well a set of poses shows the parameters, and what becomes of those that it does not show.

Observability indices, of the singular values s_1 >= ... >= s_m of the whitened data Jacobian in columns of plausible
size, without priors, at n poses: O1 = (s_1 ... s_m)^(1/m) / sqrt(n); O2 = s_m / s_1; O3 = s_m; O4 = s_m^2 / s_1; O5 = 1
/ sum(1 / s). Sources: Borm, Menq, Int. J. Robotics Research 10(5), 1991 (O1); Driels, Pathre, J. Robotic Systems 7(1),
1990 (O2); Nahvi, Hollerbach, Hayward, ICRA 1994 (O3) and Nahvi, Hollerbach, ICRA 1996 (O4); Sun, Hollerbach, ICRA 2008
(O5).

`analyse_along` follows unseen combinations along their own path: what bends into them is not determined either.
Turning everything about axis 1 moves a fixture on a circle. Where the circle happens to run along one of its axes the
Jacobian alone shows that the other axis is determined; a finite turn, which the data do not see, shifts it all the
same. So the analysis is repeated some way along each combination that geometry forbids, both ways.

`reduced` takes parameters that do not change what is measured out before solving, or holds them by weak priors. Source:
patent CN114523474B (Lu, Shi), step 5: columns that do not change E are removed first. Which columns these are is the
null space of the whitened Jacobian, as `identifiability.analyse` finds it. Either way no member of an unseen
combination has a value to report: `Identifiability.reason` keeps the reason.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.rank.identifiability import STRUCTURAL, Identifiability, analyse, in_words
from calibrate.model.parameters import Parameter, plausible_sizes
from calibrate.model.problem import LeastSquares
from calibrate.model.sensors.catalogue import FRAMES

Floats = NDArray[np.float64]
WELL_CONDITIONED = 100.0  # of the scaled Jacobian: Schroer's rule, quoted by Nahvi and Hollerbach, ICRA 1996
HALF_WAY = 0.5  # of the plausible size: a distance that the truth may well be off along an unseen combination
OWNERS = {
    "device": "where the measuring device stands",
    "tool": "where the target sits on the flange",
    **{frame.prefix: frame.where for frame in FRAMES},
    "placement": "where the fixture stands",
    "laser mount": "how the laser sits on the flange",
    "laser": "how the laser sits on the flange",
    "psd1": "the gains of PSD 1",
    "psd2.gain": "the gains of PSD 2",
    "psd2": "how PSD 2 sits to PSD 1",
}
NUMBERED = {**{f.prefix: f.one for f in FRAMES if f.one}, "placement": "where fixture station"}  # one of them alone


@dataclass(frozen=True)
class Observability:
    """Indices of the free parameters; all zero (condition infinite) where the data leave a combination unseen."""

    o1: float
    o2: float
    o3: float
    o4: float
    o5: float
    condition: float  # largest over smallest singular value
    rank: int
    n_free: int
    sigma: Floats  # (free,) predicted of each free parameter by these data alone; inf for all where rank is short

    @property
    def well_conditioned(self) -> bool:
        """Below the usual limit of 100."""
        return self.condition < WELL_CONDITIONED


def observability(jacobian: Floats, parameters: tuple[Parameter, ...], poses: int) -> Observability:
    """Indices from the whitened Jacobian (row, param) of `poses` poses. Hold redundant parameters first."""
    free = np.flatnonzero([p.free for p in parameters])
    scale = plausible_sizes(parameters)[free]
    n = len(free)
    padded = np.concatenate([jacobian[:, free] * scale, np.zeros((n, n))])  # fewer rows than columns: zeros at the end
    _, s, Vt = np.linalg.svd(np.linalg.qr(padded, mode="r"))
    rank = int(np.sum(s > STRUCTURAL * s.max(initial=0.0)))
    if rank < n or n == 0:
        return Observability(0.0, 0.0, 0.0, 0.0, 0.0, float("inf"), rank, n, np.full(n, np.inf))
    return Observability(
        float(np.exp(np.mean(np.log(s))) / np.sqrt(poses)),
        float(s[-1] / s[0]),
        float(s[-1]),
        float(s[-1] ** 2 / s[0]),
        float(1.0 / np.sum(1.0 / s)),
        float(s[0] / s[-1]),
        rank,
        n,
        scale * np.linalg.norm(Vt.T / s, axis=1),
    )


def analyse_along(problem: LeastSquares, theta: Floats, parameters: tuple[Parameter, ...]) -> Identifiability:
    """Identifiability of `parameters` at theta (param,), with everything that its unseen combinations bend into.

    Values that are held stay as they are; the rest of the answer is that of `analyse` at theta.
    """
    here = analyse(problem.jacobian(theta), parameters)
    for there in points_along(here, theta, parameters):
        here = _with_members(here, analyse(problem.jacobian(there), parameters))
    return here


def points_along(here: Identifiability, theta: Floats, parameters: tuple[Parameter, ...]) -> tuple[Floats, ...]:
    """Values (param,) some way from theta along each combination that geometry forbids, both ways."""
    free = np.flatnonzero([p.free for p in parameters])
    structural = sum(c.structural for c in here.combinations)
    out: list[Floats] = []
    for direction in here.unseen.T[here.unseen.shape[1] - structural :]:
        for way in (-HALF_WAY, HALF_WAY):
            there = theta.copy()
            there[free] += way * direction
            out.append(there)
    return tuple(out)


def _with_members(here: Identifiability, there: Identifiability) -> Identifiability:
    """Members of structural combinations over there join the combination here that they share most members with."""
    combinations, sigma = list(here.combinations), here.sigma.copy()
    known = {name for c in combinations for name in c.members}
    for other in (c for c in there.combinations if c.structural):
        new = tuple(name for name in other.members if name not in known)
        if new:
            shared = [len(set(c.members) & set(other.members)) if c.structural else -1 for c in combinations]
            k = int(np.argmax(shared))
            combinations[k] = replace(combinations[k], members=combinations[k].members + new)
            sigma[[here.names.index(name) for name in new]] = np.inf
            known.update(new)
    return replace(here, combinations=tuple(combinations), sigma=sigma)


class Redundant(Enum):
    """What is done with a combination that the data do not see."""

    REMOVED = "one member of each unseen combination is held where it starts"
    HELD_BY_PRIORS = "members of unseen combinations are pulled to their start by their plausible size"


def reduced(
    parameters: tuple[Parameter, ...], seen: Identifiability, how: Redundant = Redundant.REMOVED
) -> tuple[Parameter, ...]:
    """The same parameters, in order, such that the data with the priors determine all free ones."""
    if how is Redundant.REMOVED:
        held = {c.representative for c in seen.combinations}
        return tuple(replace(p, free=False) if p.name in held else p for p in parameters)
    members = {name for c in seen.combinations for name in c.members}
    return tuple(replace(p, prior=min(p.prior, p.plausible)) if p.name in members else p for p in parameters)


class Inseparable(Protocol):
    """Parameters that can only be determined together: a combination of the analysis, or of a model.json."""

    @property
    def words(self) -> str: ...

    @property
    def members(self) -> tuple[str, ...]: ...

    @property
    def structural(self) -> bool: ...


def plain_reason(name: str, seen: Identifiability, fallback: str | None) -> str:
    """Sentence for a parameter that was not determined; `fallback` where rank is not the reason."""
    return reason_among(name, seen.combinations, fallback)


def reason_among(name: str, combinations: Sequence[Inseparable], fallback: str | None) -> str:
    """The same from the combinations alone."""
    for combination in combinations:
        if name in combination.members:
            return _says(name, combination)
    return fallback or "not determined"


def kind_of(combination: Inseparable) -> str:
    """Why nothing separates its members."""
    if len(combination.members) == 1:
        return "the measurement does not depend on it"
    if combination.structural:
        return "cannot be separated by geometry, whatever the poses"
    return "hardly separated by these poses; others might"


def in_plain_words(words: str) -> str:
    """'link2.offset + device z' -> 'the offset of link 2 and where the measuring device stands (z)'."""
    return " and ".join(_plain(part) for part in words.split(" + "))


def _says(name: str, combination: Inseparable) -> str:
    if len(combination.members) == 1:
        return "the measurement does not depend on it"
    others = combination.words.split(" + ")
    rest = " and ".join(_plain(words) for words in others if words != in_words([name]))
    if combination.structural:
        return f"no data of this kind can separate it from {rest}"
    return f"these poses hardly separate it from {rest}"


def _plain(words: str) -> str:
    """'placement x, y' -> 'where the fixture stands (x, y)'; 'seat2.z' -> 'where cone 2 is (z)'."""
    owner, _, what = words.partition(".")
    kind = owner.rstrip("0123456789")
    number = owner.removeprefix(kind)
    if kind in NUMBERED and number:
        return f"{NUMBERED[kind]} {number} is ({what})"
    for start, said in OWNERS.items():
        if words.startswith(start):
            axes = words.removeprefix(start).strip(" .")
            return f"{said} ({axes})" if axes else said
    return f"the {what} of {kind} {number}" if kind in ("joint", "link") and what else words
