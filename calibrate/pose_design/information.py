"""What every candidate pose would tell: whitened rows of its readings, beside what is believed, in scaled unknowns.

Unknowns are divided by what is believed of them, so that what is known before any data is the unit matrix. The error
over the workspace is that of calibrate/uncertainty/free_space.py: J C J' over the workspace, rigid motions taken out.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.arms.catalogue import arm_of
from calibrate.identifiability import STRUCTURAL
from calibrate.identification.session import instruments_for_fit
from calibrate.parameters import Parameter, priors
from calibrate.pose_design.candidates import Candidates
from calibrate.pose_design.target import target_of

Floats = NDArray[np.float64]

NO_OPINION = 3.0  # plausible sizes: believed of an unknown of which nobody has an opinion; far above any sigma found


@dataclass(frozen=True, eq=False)
class Information:
    """Over the free unknowns."""

    parameters: tuple[Parameter, ...]  # the free ones
    rows: Floats  # (pose, k, param) of the candidates, whitened and scaled
    known: Floats  # (row, param) of known distances of the rig, whitened and scaled
    by_target: Floats  # (row, param) of the target by the scaled unknowns (target.py)
    by_scale: Floats  # (param,) of the scale of the workspace, by the scaled unknowns
    target: str  # what the target is
    hidden: Floats  # (param, k) orthonormal directions that no candidate shows, whatever their number

    @property
    def n(self) -> int:
        return len(self.parameters)

    @property
    def before(self) -> Floats:
        """(param, param) what is known before any pose."""
        return np.eye(self.n) + self.known.T @ self.known

    @cached_property
    def target_weight(self) -> Floats:
        """(param, param) W with trace(C W) the mean square of the target's error, m^2; hidden directions aside."""
        shown = self.by_target - (self.by_target @ self.hidden) @ self.hidden.T
        return shown.T @ shown

    @property
    def hidden_m(self) -> float:
        """Rms of the target by what no candidate shows, as far as it is believed: 0 where it moves no target."""
        return float(np.linalg.norm(self.by_target @ self.hidden))

    def of(self, poses: NDArray[np.intp], known: bool = True) -> Floats:
        """(param, param) what is known with these poses, and with the rig's known distances or without."""
        X = self.rows[poses].reshape(-1, self.n)
        return X.T @ X + (self.before if known else np.eye(self.n))

    def free_space_m(self, information: Floats) -> float:
        """Rms of the target over the workspace that this leaves, three axes together."""
        return float(np.sqrt(np.trace(np.linalg.solve(information, self.target_weight))))

    def scale_sigma(self, information: Floats) -> float:
        """One sigma of the scale of the workspace (no unit), hidden directions aside."""
        shown = self.by_scale - (self.by_scale @ self.hidden) @ self.hidden.T
        return float(np.sqrt(shown @ np.linalg.solve(information, shown)))


def information_of(rig: Rig, candidates: Candidates, rng: Generator) -> Information:
    """At the nominal rig, under its assumed noise, with the unknowns that an identification would have."""
    found = instruments_for_fit(rig, candidates.samples())
    weighting, every = found.weighting, found.weighting.parameters
    free = np.flatnonzero([p.free for p in every])
    parameters = tuple(_believed(every[i]) for i in free)
    size = priors(parameters)
    J = weighting.problem(found.start).jacobian(found.start)[:, free] * size
    k = candidates.reading.shape[1]
    order = np.concatenate([m.sample_rows[:, -1] for m in weighting.measured])
    rows = np.zeros((len(candidates), k, len(free)))
    rows[order] = J[: len(order) * k].reshape(len(order), k, -1)
    target = target_of(rig, arm_of(rig), every, found.start, rng)
    by_target, by_scale = target.by[:, free] * size, target.by_scale[free] * size
    return Information(parameters, rows, J[len(order) * k :], by_target, by_scale, target.says, _hidden(J))


def _believed(p: Parameter) -> Parameter:
    """Nobody has an opinion: many plausible sizes, so that every information matrix has an inverse."""
    return p if np.isfinite(p.prior) else replace(p, prior=NO_OPINION * p.plausible)


def _hidden(J: Floats) -> Floats:
    """(param, k) right null space of the rows."""
    _, s, Vt = np.linalg.svd(np.linalg.qr(J, mode="r"))
    return Vt[s < STRUCTURAL * s[0]].T
