"""The reference arm, with errors of every kind or none but those of a test."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibrate.error_simulation.error_plan import ErrorPlan, SourceEntry, sources_of
from calibrate.error_simulation.machine import machine_of

RIGS = Path(__file__).parents[3] / "rigs"


@pytest.fixture(scope="session")
def rig():
    return load_rig(RIGS / "arm-cmm-reference.toml")


@pytest.fixture(scope="session")
def machine(rig):
    return machine_of(rig)


@pytest.fixture(scope="session")
def poses(machine):
    return machine.drawn_poses(6, np.random.default_rng(3))


@pytest.fixture(scope="session")
def stated(rig, machine):
    """Sources of (names, law, sizes) and nothing else."""

    def build(*entries, expansion_per_k=None):
        listed = tuple(SourceEntry(**entry) for entry in entries)
        plan = ErrorPlan(schema=1, source=listed, expansion_per_k=expansion_per_k, believed=False)
        return sources_of(machine, rig, plan)

    return build


@pytest.fixture(scope="session")
def every(stated):
    """All kinds at once, in sizes of a real arm."""
    return stated(
        {"what": ("link*.x", "link*.y", "link*.z"), "scale_m": 5e-5},
        {"what": ("link*.roll", "link*.pitch", "link*.yaw", "joint*.zero"), "scale_rad": 1e-4},
        {"what": ("joint*.noise",), "scale_rad": 1e-5},
        {"what": ("joint*.quantisation",), "law": "uniform", "scale_rad": 5e-5},
        {"what": ("joint*.eccentricity",), "law": "rayleigh", "scale_rad": 8e-5},
        {"what": ("joint*.graduation",), "law": "uniform", "scale_rad": 5e-5, "order": 4.0},
        {"what": ("joint*.runout-*",), "law": "constant", "scale_m": 2e-5},
        {"what": ("joint*.wobble",), "law": "halfnorm", "scale_rad": 3e-5},
        {"what": ("heat.*",), "law": "triang", "shape": (0.3,), "scale_k": 5.0, "loc_k": -1.0},
        expansion_per_k=23e-6,
    )
