"""What the data can determine at all, before any number: rank, singular values, and combinations in words.

The whitened Jacobian is scaled by the plausible size of each parameter, so a singular value s says: the data (with
priors, where there are any) know this combination to 1/s of its plausible size. Below WEAK it is treated as unseen.
Source: Schroer, Theory of kinematic modelling, 1993 (column scaling, rank by singular values); the rule that a
parameter outside the range of J' has no estimate is Rao, Linear Statistical Inference, 2nd ed. 1973, ch. 4a.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.parameters import Parameter, plausible_sizes, priors
from calibrate.words import in_words, plainly

__all__ = ["WEAK", "Combination", "Identifiability", "analyse", "in_words"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

WEAK = 0.5  # sigma of twice the plausible size: the data say nothing; pure priors give exactly 1, so not 1
STRUCTURAL = 1e-9  # of the largest singular value: not weak data but geometry; rounding leaves about 1e-12
TRACE = 1e-5  # share of an unseen direction below which a parameter is not part of it
NEGLIGIBLE = 0.1  # of a sigma: what an unseen combination, off by its plausible size, may shift a parameter by
SPOKEN = 0.02  # share of its largest member below which a member is not worth saying


@dataclass(frozen=True)
class Combination:
    """Parameters that can be changed together without the data noticing."""

    words: str  # "joint1.zero + placement x, y, yaw"
    members: tuple[str, ...]  # strongest first
    representative: str  # the one to hold
    structural: bool  # geometry forbids it; False: these poses are too few or too alike
    plain: str = ""  # the same for who calibrates: "d2 + d3", "joint 1 zero with base yaw"

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
    rows = np.concatenate([jacobian[:, free] * scale, np.diag(np.where(np.isfinite(prior), scale / prior, 0.0))])
    _, s, Vt = np.linalg.svd(np.linalg.qr(rows, mode="r"))  # the triangle has the same values and directions
    seen = s > max(WEAK, STRUCTURAL * s[0])
    unseen = Vt[~seen].T  # (free, k)
    shift, doubt = np.linalg.norm(unseen, axis=1), np.linalg.norm(Vt[seen].T / s[seen], axis=1)
    invisible = (shift > TRACE) & (shift > NEGLIGIBLE * doubt)
    sigma = np.where(invisible, np.inf, scale * doubt)
    n_structural = int(np.sum(s < STRUCTURAL * s[0]))
    return Identifiability(
        names,
        int(seen.sum()),
        s,
        float(s[0] / s[seen][-1]) if seen.any() else float("inf"),
        _combinations(unseen[:, ::-1], names, n_structural, invisible),
        sigma,
        scale[:, None] * unseen,
    )


def _combinations(
    unseen: Floats, names: tuple[str, ...], n_structural: int, invisible: Bools
) -> tuple[Combination, ...]:
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
        worth_saying = rest > SPOKEN * rest.max(axis=1, keepdims=True)  # holding less would not hold the combination
        among_zeros = np.where(zeros & worth_saying, rest, 0.0)
        candidates = among_zeros if among_zeros.max() > TRACE else rest
        row, column = divmod(int(np.argmax(candidates)), rest.shape[1])
        basis[[k, k + row]] = basis[[k + row, k]]
        basis[k] /= basis[k, column]
        others = np.arange(len(basis)) >= first
        others[k] = False
        basis[others] -= np.outer(basis[others, column], basis[k])
        pivots.append(column)
    return tuple(_combination(v * invisible, names, pivots[k], k < n_structural) for k, v in enumerate(basis))


def _combination(direction: Floats, names: tuple[str, ...], pivot: int, structural: bool) -> Combination:
    size = np.abs(direction) / np.abs(direction).max()
    order = [int(i) for i in np.argsort(-size, kind="stable") if size[i] > TRACE]
    others = [i for i in order if i != pivot]
    loud = SPOKEN * (size[others[0]] if others and size[others[0]] < SPOKEN else 1.0)  # a pair is never said as one
    spoken = [names[pivot]] + [names[i] for i in sorted(others) if size[i] > loud]
    return Combination(in_words(spoken), tuple(names[i] for i in order), names[pivot], structural, plainly(spoken))
