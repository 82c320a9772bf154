"""Unseen combinations followed along their own path: what bends into them is not determined either.

Turning everything about axis 1 moves a fixture on a circle. Where the circle happens to run along one of its axes the
Jacobian alone shows that the other axis is determined; a finite turn, which the data do not see, shifts it all the
same. So the analysis is repeated some way along each combination that geometry forbids, both ways.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.rank.identifiability import Identifiability, analyse
from calibrate.model.parameters import Parameter
from calibrate.model.problem import LeastSquares

Floats = NDArray[np.float64]

HALF_WAY = 0.5  # of the plausible size: a distance that the truth may well be off along an unseen combination


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
