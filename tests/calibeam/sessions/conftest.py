"""Samples of the shipped nominal rig, made up without a world: the believed spots, and noise as assumed."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.bench import Look, Spot
from acquisition.recording.rig import Rig, load_rig
from acquisition.session.plan import PlanOptions, blocks
from acquisition.session.records import Sample
from calibeam.sessions.forecast import Ahead, ahead_of_blocks
from calibrate.model.assumed_rig import AssumedRig

RIG_FILE = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"
MEAN_OF = 200  # readings in a dwell: sigma of their mean


@pytest.fixture(scope="session")
def rig() -> Rig:
    return load_rig(RIG_FILE)


@pytest.fixture(scope="session")
def ahead(rig: Rig) -> Ahead:
    """The plan of a whole session."""
    return ahead_of_blocks(rig, tuple(blocks(tuple(rig.placements), 0.01, PlanOptions())))


@pytest.fixture(scope="session")
def samples(rig: Rig, ahead: Ahead) -> list[Sample]:
    """Of every pose of the plan."""
    rng, assumed = np.random.default_rng(4), AssumedRig(rig)
    sigma_m = (rig.noise.psd_m or 0.0) / np.sqrt(MEAN_OF)
    out: list[Sample] = []
    for k, key in enumerate(ahead.keys):
        q_rad = ahead.poses.q_rad[k]
        shaken = q_rad + rng.normal(0.0, rig.noise.joint_rad or 0.0, 6)
        x1, y1, x2, y2 = assumed.expect(shaken, key.placement, key.first).spots_m + rng.normal(0.0, sigma_m, 4)
        psd1, psd2 = (Spot(x, y, 4.0, sigma_m, sigma_m, lit=True) for x, y in ((x1, y1), (x2, y2)))
        look = Look(8.0 * k, 8.0 * k, q_rad, np.zeros(6), q_rad, None, {}, True, psd1, psd2, None, 0.1)
        out.append(Sample(look, key.placement, key.first, np.zeros(6, dtype=np.int64), None, False))
    return out
