"""The reference arm of mission 1: the shipped rig against the paper's matrices, multiplied out here."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.rig import ArmModel, load_rig
from calibrate.model.arms.catalogue import arm_of

RIG = Path(__file__).parents[4] / "rigs" / "arm-cmm-reference.toml"
# T[i-1,i](0) of the paper, mm, row by row
PAPER = """
1 0 0 0 / 0 1 0 0 / 0 0 1 0
0 1 0 74 / 0 0 1 0 / 1 0 0 176
0 0 1 0 / 1 0 0 0 / 0 1 0 0
0 1 0 69.5 / 0 0 1 0 / 1 0 0 585
0 0 1 0 / 1 0 0 0 / 0 1 0 0
0 1 0 0 / 0 0 1 0 / 1 0 0 475
1 0 0 146.5 / 0 1 0 0 / 0 0 1 76
"""


def paper_parts():
    for line in PAPER.strip().splitlines():
        T = np.eye(4)
        T[:3] = [[float(cell) for cell in row.split()] for row in line.split("/")]
        T[:3, 3] *= 1e-3
        yield T


def paper_probe(angles):
    """Equation 3: the product of fixed parts and turns about z, times (0, 0, 0, 1)."""
    *links, flange = paper_parts()
    T = np.eye(4)
    for fixed, a in zip(links, angles, strict=True):
        T = T @ fixed @ [[np.cos(a), -np.sin(a), 0, 0], [np.sin(a), np.cos(a), 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    return (T @ flange)[:3, 3]


@pytest.fixture
def arm():
    rig = load_rig(RIG)
    assert rig.arm.model is ArmModel.LOCAL_POE
    assert rig.tool.point_m == (0.0, 0.0, 0.0)
    return arm_of(rig)


def test_probe_of_the_reference_arm_is_the_papers_product(arm):
    q = np.vstack([np.zeros(6), np.random.default_rng(7).uniform(-3.1, 3.1, (50, 6))])
    probe = arm.flange(np.zeros(len(arm.parameters)), q)[:, :3, 3]
    np.testing.assert_allclose(probe, [paper_probe(row) for row in q], atol=1e-15)


def test_an_encoder_zero_adds_to_its_angle(arm):
    rng = np.random.default_rng(8)
    q, zeros = rng.uniform(-3, 3, 6), rng.normal(0, 0.01, 6)
    theta = np.zeros(len(arm.parameters))
    theta[[i for i, p in enumerate(arm.parameters) if p.name.endswith(".zero")]] = zeros
    np.testing.assert_allclose(arm.flange(theta, q[None])[0, :3, 3], paper_probe(q + zeros), atol=1e-15)


def test_straight_up_the_probe_is_where_the_lengths_add(arm):
    """All angles zero: L1 ... L7 along the base axes, as the product of the paper's matrices says."""
    probe = arm.flange(np.zeros(len(arm.parameters)), np.zeros((1, 6)))[0, :3, 3]
    np.testing.assert_allclose(probe, [0.074 + 0.0695, 0.076, 0.176 + 0.585 + 0.475 + 0.1465], atol=1e-15)
