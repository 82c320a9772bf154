"""The shipped rig, emulated in process: every test gets a bench over a world of its own seed."""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Rig, load_rig
from tests.support.direct_bench import DirectBench, direct_bench

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture(scope="session")
def rig() -> Rig:
    return load_rig(RIG)


@pytest.fixture(scope="session")
def plain_rig() -> dict[str, Any]:
    return tomllib.loads(RIG.read_text())


@pytest.fixture
def bench_of(rig: Rig, plain_rig: dict[str, Any]) -> Callable[[int], DirectBench]:
    return lambda seed: direct_bench(rig, plain_rig, seed=seed)


def true_fixture(bench: DirectBench, placement: int) -> np.ndarray:
    pose = next(place.psd1_in_base for place in bench.world.truth.placements if place.id == placement)
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(pose.rotation_rad).as_matrix()
    T[:3, 3] = pose.origin_m
    return T
