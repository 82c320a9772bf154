"""A tracker session of a concealed truth, and the fit of it."""

from dataclasses import dataclass

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from benchmarks.drawn_sessions import POSITION_SIGMA_M, T_BASE_DEVICE, TARGET_M, Bench
from calibrate.fit.rank.identifiability import Identifiability, analyse
from calibrate.fit.rank.observability import reduced
from calibrate.fit.solvers import Fit, solve
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.chain import SensorChain
from calibrate.model.placement import Device, Target
from calibrate.model.problem import Problem
from calibrate.model.rigid import transform
from calibrate.model.sensors.position import Position


@dataclass(frozen=True)
class Fitted:
    problem: Problem  # with what its data do not see removed
    fit: Fit
    seen: Identifiability  # before that
    truth: dict[str, float]
    model: object


@pytest.fixture(scope="session")
def bench(request):
    """One for all: the poses of its pool are looked for once."""
    return Bench(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")


@pytest.fixture(scope="session")
def fitted(request, bench):
    """fitted(seed, poses, extra noise factor): the session and its fit under the stated noise."""
    rig = load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")

    def get(seed, poses=40, noise=1.0):
        session = bench.tracker(np.random.default_rng(seed), poses)
        chain = SensorChain(arm_of(rig), Position(Target(TARGET_M), Device(transform(*T_BASE_DEVICE))))
        extra = np.random.default_rng(seed + 1).normal(size=session.observed.shape)
        observed = session.observed + np.sqrt(max(noise**2 - 1.0, 0.0)) * POSITION_SIGMA_M * extra
        weights = np.tile(np.eye(3) / POSITION_SIGMA_M, (poses, 1, 1))
        everything = Problem(chain, chain.parameters, session.q_rad, observed, weights)
        seen = analyse(everything.jacobian(solve(everything).theta), chain.parameters)
        problem = everything.with_parameters(reduced(chain.parameters, seen))
        fit = solve(problem)
        seen = analyse(problem.jacobian(fit.theta), chain.parameters)
        return Fitted(problem, fit, seen, session.truth, chain.model)

    return get
