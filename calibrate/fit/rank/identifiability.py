"""What the data can determine at all, before any number: rank, singular values, and combinations in words.

The whitened Jacobian is scaled by the plausible size of each parameter, so a singular value s means: the data (with
priors, where there are any) know this combination to 1/s of its plausible size. Below WEAK it is treated as unseen.
Source: Schroer, Theory of kinematic modelling, 1993 (column scaling, rank by singular values); the rule that a
parameter outside the range of J' has no estimate is Rao, Linear Statistical Inference, 2nd ed. 1973, ch. 4a.

Parameter names put together for a person: what several frames have in common stands once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.solvers.least_squares import triangle_of
from calibrate.model.parameters import Parameter, plausible_sizes, priors
from calibrate.model.sensors.catalogue import FRAMES

__all__ = ["STRUCTURAL", "WEAK", "Combination", "Identifiability", "analyse", "combinations_of", "in_words"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

WEAK = 0.5  # sigma of twice the plausible size: the data show nothing; pure priors give exactly 1, so not 1
STRUCTURAL = 1e-9  # of the largest singular value: not weak data but geometry; rounding leaves about 1e-12
TRACE = 1e-5  # share of an unseen direction below which a parameter is not part of it
NEGLIGIBLE = 0.1  # of a sigma: what an unseen combination, off by its plausible size, may shift a parameter by
EQUAL = 1e-6  # of a length: two that differ by less are equally long
SPOKEN = 0.02  # share of its largest member below which a member is not named

SINGLE = ("device", "tool", *(f.prefix for f in FRAMES if not f.one))
SYMBOLS = {"offset": "d", "length": "a", "twist": "alpha", "tilt": "beta"}  # of a D-H table, Hayati's beta included
NOUNS = {"placement": "fixture", "laser": "laser mount", "device": "base", **{f.prefix: f.noun for f in FRAMES}}
NUMBERED = ("placement", *(f.prefix for f in FRAMES if f.one))  # the number does not matter to the reason


@dataclass(frozen=True)
class Combination:
    """Parameters that can be changed together without the data noticing."""

    spoken: tuple[str, ...]  # the representative, then the members to be named
    members: tuple[str, ...]  # strongest first
    representative: str  # the one to hold
    structural: bool  # geometry forbids it; False: these poses are too few or too alike

    @property
    def words(self) -> str:
        """As in "joint1.zero + placement x, y, yaw"."""
        return in_words(self.spoken)

    @property
    def plain(self) -> str:
        """The same for who calibrates: "d2 + d3", "joint 1 zero with base yaw"."""
        return plainly(self.spoken)

    @property
    def says(self) -> str:
        if len(self.members) == 1:
            return "the measurement does not depend on it"
        if self.structural:
            return f"only in combination: {self.words}"
        return f"these poses hardly move it apart from: {self.words}"


@dataclass(frozen=True)
class Identifiability:
    """Answer for the free parameters of a problem at one point."""

    names: tuple[str, ...]  # free parameters, in order
    rank: int
    singular_values: Floats  # (free,) falling, of the scaled whitened Jacobian with priors
    condition: float  # largest over smallest of the seen ones
    combinations: tuple[Combination, ...]
    sigma: Floats  # (free,) predicted, inf where not determined
    unseen: Floats  # (free, k) directions that the data do not see, each of plausible size, in the parameters' units

    @property
    def n_free(self) -> int:
        return len(self.names)

    def reason(self, name: str) -> str | None:
        """Why a parameter is not determined, None if it is."""
        for combination in self.combinations:
            if name in combination.members:
                return combination.says
        return None


def analyse(jacobian: Floats, parameters: tuple[Parameter, ...]) -> Identifiability:
    """Identifiability from the whitened Jacobian (row, param) and the priors of the parameters."""
    free = np.flatnonzero([p.free for p in parameters])
    names = tuple(parameters[i].name for i in free)
    scale, prior = plausible_sizes(parameters)[free], priors(parameters)[free]
    s, Vt = directions(jacobian[:, free] * scale, scale / prior)
    structural = STRUCTURAL * float(s.max(initial=0.0))  # no free parameter at all has no values
    seen = s > max(WEAK, structural)
    unseen = Vt[~seen].T  # (free, k)
    shift, spread = np.linalg.norm(unseen, axis=1), np.linalg.norm(Vt[seen].T / s[seen], axis=1)
    invisible = (shift > TRACE) & (shift > NEGLIGIBLE * spread)
    sigma = np.where(invisible, np.inf, scale * spread)
    n_structural = int(np.sum(s < structural))
    return Identifiability(
        names,
        int(seen.sum()),
        s,
        float(s[0] / s[seen][-1]) if seen.any() else float("inf"),
        combinations_of(unseen[:, ::-1], names, n_structural, invisible),
        sigma,
        scale[:, None] * unseen,
    )


def directions(jacobian: Floats, one_over_prior: Floats) -> tuple[Floats, Floats]:
    """Singular values (free,), falling, and their directions (free, free), row by row, of data and priors.

    For the scaled whitened Jacobian (row, free) and the plausible sizes over the prior sigmas (free,).
    """
    n = len(one_over_prior)
    with_prior = np.flatnonzero(one_over_prior)
    prior_rows = np.zeros((max(len(with_prior), n - len(jacobian)), n))  # at least as many rows as columns
    prior_rows[range(len(with_prior)), with_prior] = one_over_prior[with_prior]
    rows = np.concatenate([jacobian, prior_rows])
    _, s, Vt = np.linalg.svd(triangle_of(rows))  # the triangle has the same values and directions
    return s, Vt


def combinations_of(
    unseen: Floats, names: tuple[str, ...], n_structural: int, invisible: Bools
) -> tuple[Combination, ...]:
    """Simplest basis of the unseen directions (weakest first): each has a representative that no other contains.

    Joint zeros are taken as representatives first, because they are what is asked for. What geometry forbids is
    separated first and kept free of what is only weak. Which orthonormal basis `unseen` is makes no difference.
    """
    structural, weak = unseen.T[:n_structural], unseen.T[n_structural:]
    zeros = np.array([name.endswith(".zero") for name in names])
    first = _representatives(structural, zeros)
    structural = np.linalg.solve(structural[:, first], structural)
    weak = weak - weak[:, first] @ structural
    then = _representatives(weak, zeros)
    basis = np.concatenate([structural, np.linalg.solve(weak[:, then], weak)])
    size, pivots = np.abs(basis) * invisible, first + then
    share = (size / size.max(axis=1, keepdims=True, initial=0.0)).tolist()
    return tuple(_combination(share[k], names, pivots[k], k < n_structural) for k in range(len(share)))


def _representatives(basis: Floats, zeros: Bools) -> list[int]:
    """Columns of a basis (k, free), as many as rows and independent: each the longest of what those before leave.

    Of equally long ones the first, however they are rounded. Source: Businger, Golub, Numer. Math. 7, 1965 (column
    pivoting), by projection.
    """
    rest, square = basis, np.sum(basis**2, axis=0)
    out: list[int] = []
    for _ in range(len(basis)):
        loud = zeros & (square > SPOKEN**2 * square.max())  # less would not hold it
        candidates = np.where(loud, square, 0.0)
        longest = candidates.max()
        if longest <= TRACE**2:
            candidates, longest = square, square.max()
        column = int(np.argmax(candidates >= (1.0 - EQUAL) * longest))
        along = rest[:, column] / np.sqrt(square[column])
        share = along @ rest
        rest, square = rest - along[:, None] * share, square - share**2
        out.append(column)
    return out


def _combination(share: list[float], names: tuple[str, ...], pivot: int, structural: bool) -> Combination:
    """`share` (free,) of what the largest member moves by."""
    order = sorted((i for i, size in enumerate(share) if size > TRACE), key=lambda i: -round(share[i], 6))
    others = [i for i in order if i != pivot]
    loud = SPOKEN * (share[others[0]] if others and share[others[0]] < SPOKEN else 1.0)  # a pair is never named as one
    spoken = (names[pivot], *(names[i] for i in sorted(others) if share[i] > loud))
    return Combination(spoken, tuple(names[i] for i in order), names[pivot], structural)


def in_words(names: Sequence[str]) -> str:
    """Names joined; what several placements or seats, a device, a tool or the laser mount share stands once.

    >>> in_words(["joint1.zero", "placement1.x", "placement1.yaw", "placement2.x", "placement2.yaw"])
    'joint1.zero + placement x, yaw'
    """
    groups: dict[str, list[str]] = {}
    for name in names:
        owner, _, what = name.partition(".")
        kind = owner.rstrip("0123456789")
        if kind in NUMBERED:
            owner = kind
        elif owner == "laser":
            owner = "laser mount"
        elif owner not in SINGLE:
            owner, what = name, ""
        listed = groups.setdefault(owner, [])
        if what and what not in listed:
            listed.append(what)
    return " + ".join(f"{owner} {', '.join(what)}" if what else owner for owner, what in groups.items())


def plainly(names: Sequence[str]) -> str:
    """The same in the words of who calibrates: D-H letters add up, the first of unlike things goes with the others.

    >>> plainly(["link2.offset", "link3.offset"]), plainly(["joint1.zero", "device.yaw"])
    ('d2 + d3', 'joint 1 zero with base yaw')
    """
    groups: dict[str, list[str]] = {}
    for name in names:
        owner, what = _owner_and_what(name)
        listed = groups.setdefault(owner, [])
        if what and what not in listed:
            listed.append(what)
    said = [f"{owner} {', '.join(what)}" if what else owner for owner, what in groups.items()]
    if all(_is_letter(name) for name in names) or len(said) == 1:
        return " + ".join(said)
    return f"{said[0]} with {' and '.join(said[1:])}"


def _is_letter(name: str) -> bool:
    owner, _, what = name.partition(".")
    return owner.startswith("link") and what in SYMBOLS


def _owner_and_what(name: str) -> tuple[str, str]:
    """'link2.offset' -> 'd2', ''; 'placement3.yaw' -> 'fixture', 'yaw'; 'joint1.zero' -> 'joint 1 zero', ''."""
    owner, _, what = name.partition(".")
    kind = owner.rstrip("0123456789")
    number = owner.removeprefix(kind)
    if _is_letter(name):
        return f"{SYMBOLS[what]}{number}", ""
    if kind in NOUNS:
        return NOUNS[kind], what
    if kind == "joint":
        return f"joint {number} {what}".strip(), ""
    return f"{kind} {number}".strip(), what
