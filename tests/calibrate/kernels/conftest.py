"""A tracked arm with known errors, as a Problem."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibrate.arms.catalogue import arm_of
from calibrate.chain import Chain
from calibrate.kernels import ready
from calibrate.parameters import hold
from calibrate.problem import Problem
from calibrate.rigid import transform
from calibrate.sensors.device import Device
from calibrate.sensors.position import Position
from calibrate.sensors.target import Target

SIGMA_M = 20e-6


@pytest.fixture(autouse=True)
def numpy_models(monkeypatch):
    """The models under comparison never use the loops themselves."""
    monkeypatch.setattr(ready, "worth", lambda poses: False)


@dataclass(frozen=True)
class Tracked:
    problem: Problem
    truth: np.ndarray


@pytest.fixture(scope="package")
def tracked(request):
    """tracked(poses): links and zeros free without any opinion but joint 1 and the tilts between crossing axes."""
    arm = arm_of(load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml"))
    sensor = Position(Target(np.array([0.02, 0.0, 0.08])), Device(transform([1.5, 0.5, 0.3], [0.1, 0.2, 2.3])))
    chain = Chain(arm, sensor)
    free = [replace(p, prior=np.inf, free=True) for p in chain.parameters]
    held = {p.name for p in free if p.name.startswith(("joint1", "link1"))}
    held |= {p.name for p in free if p.name.endswith("tilt") and p.name != "link2.tilt"}
    parameters = hold(tuple(free), held)
    assert sum(p.free for p in parameters) == 30

    def get(poses, seed=0, noise_m=SIGMA_M):
        rng = np.random.default_rng(seed)
        truth = np.array([rng.normal(0, 3e-4 if p.unit == "m" else 1e-3) if p.free else 0.0 for p in parameters])
        q = rng.uniform(-2.5, 2.5, (poses, 6))
        observed = chain.expect(truth, q) + rng.normal(0, noise_m, (poses, 3))
        return Tracked(Problem(chain, parameters, q, observed, np.tile(np.eye(3) / SIGMA_M, (poses, 1, 1))), truth)

    return get
