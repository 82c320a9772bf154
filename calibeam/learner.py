"""The assumed rig during a session: refitted to the samples so far, so that the next pose is hit.

Not the identification that is reported: joint zeros, laser mount and places are improved under wide priors, links
stay nominal.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from acquisition.session.records import Sample
from calibrate.fit.solvers import solve
from calibrate.model.assumed_rig import AssumedArm, AssumedFixture, AssumedRig
from calibrate.model.dual_psd_rig import dual_psd_chain
from calibrate.model.parameters import Parameter
from calibrate.model.problem import Problem

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PriorSigmas:
    """One sigma of what may be wrong before anything was measured."""

    zero_rad: float = 0.02  # a zero within 2 deg
    mount_m: float = 1e-3
    mount_rad: float = 4e-3
    place_m: float = 1e-2  # a fixture set down by hand where the rig file has it
    place_rad: float = 0.03
    links_m: float = 3e-4  # links are held nominal; this much of the spots they leave unexplained

    def of(self, parameter: Parameter) -> float | None:
        """The prior sigma; None for what is held."""
        metres = parameter.unit == "m"
        if parameter.name.endswith(".zero"):
            return self.zero_rad
        if parameter.name.startswith("laser."):
            return self.mount_m if metres else self.mount_rad
        if parameter.name.startswith("placement"):
            return self.place_m if metres else self.place_rad
        return None


class FittedLearner:
    """Implements acquisition.session.records.Learner on the models of `calibrate`."""

    def __init__(self, rig: Rig, priors: PriorSigmas | None = None) -> None:
        self._rig, self._priors = rig, priors or PriorSigmas()
        self._corrections: dict[str, float] = {}
        self._assumed = AssumedRig(rig)

    @property
    def arm(self) -> AssumedArm:
        return self._assumed.arm

    @property
    def optics(self) -> AssumedFixture:
        return self._assumed.fixture

    def T_base_fixture(self, placement: int) -> Floats:
        return self._assumed.T_base_psd1(placement)

    def learn(self, samples: list[Sample]) -> None:
        if not samples:
            return
        placement = np.array([s.placement for s in samples], dtype=np.int64)
        chain = dual_psd_chain(self._rig, placement, np.array([s.first for s in samples], dtype=np.int64))
        parameters = tuple(self._with_prior(p) for p in chain.parameters)
        whitener = np.broadcast_to(np.eye(4) / self._priors.links_m, (len(samples), 4, 4))
        spots_m = np.array([s.look.spots_m() for s in samples])
        problem = Problem(chain, parameters, np.array([s.look.q_rad for s in samples]), spots_m, whitener)
        start = np.array([self._corrections.get(p.name, p.start) for p in parameters])
        fit = solve(problem, start=start, max_steps=30)
        self._corrections = {p.name: float(v) for p, v in zip(parameters, fit.theta, strict=True)}
        self._assumed = AssumedRig(self._rig, self._corrections)

    def _with_prior(self, parameter: Parameter) -> Parameter:
        sigma = self._priors.of(parameter)
        return replace(parameter, free=False) if sigma is None else replace(parameter, free=True, prior=sigma)
