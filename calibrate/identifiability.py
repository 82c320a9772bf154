"""What the data can determine at all, before any number: rank, singular values, and combinations in words.

The whitened Jacobian is scaled by the plausible size of each parameter, so a singular value s says: the data (with
priors, where there are any) know this combination to 1/s of its plausible size. Below WEAK it is treated as unseen.
Source: Schroer, Theory of kinematic modelling, 1993 (column scaling, rank by singular values); the rule that a
parameter outside the range of J' has no estimate is Rao, Linear Statistical Inference, 2nd ed. 1973, ch. 4a.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.parameters import Parameter, plausible_sizes, priors

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

WEAK = 0.5  # sigma of twice the plausible size: the data say nothing; pure priors give exactly 1, so not 1
STRUCTURAL = 1e-9  # of the largest singular value: not weak data but geometry; rounding leaves about 1e-12
TRACE = 1e-5  # share of an unseen direction below which a parameter is not part of it
SPOKEN = 0.02  # share of its largest member below which a member is not worth saying


@dataclass(frozen=True)
class Combination:
    """Parameters that can be changed together without the data noticing."""

    words: str  # "joint1.zero + placement x, y, yaw"
    members: tuple[str, ...]  # strongest first
    representative: str  # the one to hold
    structural: bool  # geometry forbids it; False: these poses are too few or too alike

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
    rows = np.concatenate([jacobian[:, free] * scale, np.diag(np.where(np.isfinite(prior), scale / prior, 0.0))])
    _, s, Vt = np.linalg.svd(rows, full_matrices=False)
    seen = s > max(WEAK, STRUCTURAL * s[0])
    unseen = Vt[~seen].T  # (free, k)
    invisible = np.linalg.norm(unseen, axis=1) > TRACE if unseen.shape[1] else np.zeros(len(free), dtype=bool)
    sigma = scale * np.sqrt(np.sum((Vt[seen].T / s[seen]) ** 2, axis=1))
    sigma[invisible] = np.inf
    n_structural = int(np.sum(s < STRUCTURAL * s[0]))
    return Identifiability(
        names,
        int(seen.sum()),
        s,
        float(s[0] / s[seen][-1]) if seen.any() else float("inf"),
        _combinations(unseen[:, ::-1], names, n_structural),
        sigma,
    )


def _combinations(unseen: Floats, names: tuple[str, ...], n_structural: int) -> tuple[Combination, ...]:
    """Simplest basis of the unseen directions (weakest first): each has a representative that no other contains.

    Joint zeros are taken as representatives first, because they are what is asked for. What geometry forbids is
    separated first and kept free of what is only weak.
    """
    basis = unseen.T.copy()
    zeros = np.array([name.endswith(".zero") for name in names])
    pivots: list[int] = []
    for k in range(len(basis)):
        first, end = (0, n_structural) if k < n_structural else (n_structural, len(basis))
        rest = np.abs(basis[k:end])
        among_zeros = np.where(zeros, rest, 0.0)
        candidates = among_zeros if among_zeros.max() > TRACE else rest
        row, column = divmod(int(np.argmax(candidates)), rest.shape[1])
        basis[[k, k + row]] = basis[[k + row, k]]
        basis[k] /= basis[k, column]
        others = np.arange(len(basis)) >= first
        others[k] = False
        basis[others] -= np.outer(basis[others, column], basis[k])
        pivots.append(column)
    return tuple(_combination(v, names, pivots[k], k < n_structural) for k, v in enumerate(basis))


def _combination(direction: Floats, names: tuple[str, ...], pivot: int, structural: bool) -> Combination:
    size = np.abs(direction) / np.abs(direction).max()
    order = [int(i) for i in np.argsort(-size, kind="stable") if size[i] > TRACE]
    spoken = [names[pivot]] + [names[i] for i in sorted(order) if size[i] > SPOKEN and i != pivot]
    return Combination(in_words(spoken), tuple(names[i] for i in order), names[pivot], structural)


def in_words(names: Sequence[str]) -> str:
    """Names joined for a person; what several placements, or the laser mount, have in common is said once.

    >>> in_words(["joint1.zero", "placement1.x", "placement1.yaw", "placement2.x", "placement2.yaw"])
    'joint1.zero + placement x, yaw'
    """
    groups: dict[str, list[str]] = {}
    for name in names:
        owner, _, what = name.partition(".")
        if owner.startswith("placement"):
            owner = "placement"
        elif owner == "laser":
            owner = "laser mount"
        else:
            owner, what = name, ""
        listed = groups.setdefault(owner, [])
        if what and what not in listed:
            listed.append(what)
    return " + ".join(f"{owner} {', '.join(what)}" if what else owner for owner, what in groups.items())
