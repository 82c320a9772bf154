"""Drawn arms of the compiled loops: published numbers of the generator, laws, and the arm multiplied out here."""

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from calibrate.kernels import perturbed_loops
from calibrate.kernels.perturbed import (
    CELLS,
    CONSTANT,
    NORMAL,
    UNIFORM,
    ArmAtPoses,
    DrawnColumns,
    count_arms,
    draw_block,
    probe_errors,
)

# Random123, examples/kat_vectors: philox4x32, 10 rounds
ONES = 0xFFFFFFFF
KNOWN = [
    (0, 0, 0, 0, 0, (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    (0xFFFFFFFFFFFFFFFF, ONES, ONES, ONES, ONES, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        *(0x85A308D3243F6A88, 0x13198A2E, 0x03707344, 0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


@pytest.mark.parametrize(("arm", "group", "stream", "key0", "key1", "expected"), KNOWN)
def test_random_words_are_the_published_ones(arm, group, stream, key0, key1, expected):
    words = np.empty((4, perturbed_loops.BLOCK), np.uint64)
    perturbed_loops.philox(*(np.uint64(x) for x in (arm, group, stream, key0, key1)), words)
    assert tuple(words[:, 0].tolist()) == expected


def columns(law, polar=()):
    law = np.array(law, dtype=np.int64)
    n, tables = len(law), np.zeros((1, 3, CELLS + 1))
    pairs = np.array(polar, dtype=np.int64).reshape(-1, 2)
    return DrawnColumns(law, np.zeros(n), np.ones(n), tables, np.zeros(n, dtype=np.int64), pairs)


def drawn(law, blocks=400, **more):
    return np.concatenate([draw_block(columns(law, **more), 128 * i, seed=5) for i in range(blocks)])


def test_normal_columns_are_normal_and_independent():
    x = drawn([NORMAL] * 4)
    assert all(stats.kstest(column, "norm").pvalue > 1e-3 for column in x.T)
    assert np.abs(np.corrcoef(x.T) - np.eye(4)).max() < 0.02


def test_uniform_columns_fill_zero_to_one():
    assert stats.kstest(drawn([UNIFORM])[:, 0], "uniform").pvalue > 1e-3


def test_size_and_turn_become_cosine_and_sine():
    columns_of = columns([CONSTANT, UNIFORM], polar=[(0, 1)])
    columns_of.loc[0] = 2.0
    x = draw_block(columns_of, 0, seed=1)
    np.testing.assert_allclose(np.hypot(x[:, 0], x[:, 1]), 2.0, rtol=1e-14)


def arm_of(rng, joints=3, columns_in=4):
    fixed = np.tile(np.eye(4), (joints + 1, 1, 1))
    fixed[:, :3, :3] = Rotation.random(joints + 1, rng=rng).as_matrix()
    fixed[:, :3, 3] = rng.normal(0.0, 0.3, (joints + 1, 3))
    slots = np.arange(7 * (joints + 1) - 1, dtype=np.int64)
    terms = rng.integers(columns_in, size=len(slots))
    weights = rng.normal(0.0, 0.2, (2, len(slots)))
    return ArmAtPoses(fixed, rng.uniform(-3, 3, (2, joints)), rng.normal(0, 0.1, 3), slots, terms, weights)


def multiplied_out(arm, pose, columns_of_arm):
    value = np.zeros(7 * len(arm.fixed))
    for slot, column, weight in zip(arm.slots, arm.columns, arm.weights[pose], strict=True):
        value[slot] += weight * columns_of_arm[column]
    T = np.eye(4)
    for i, fixed in enumerate(arm.fixed):
        jolt = np.eye(4)
        jolt[:3, 3] = value[7 * i : 7 * i + 3]
        jolt[:3, :3] = Rotation.from_rotvec(value[7 * i + 3 : 7 * i + 6]).as_matrix()
        T = T @ fixed @ jolt
        if i < arm.angle_rad.shape[1]:
            turn = np.eye(4)
            turn[:3, :3] = Rotation.from_euler("z", arm.angle_rad[pose, i] + value[7 * i + 6]).as_matrix()
            T = T @ turn
    return T[:3, :3] @ arm.point_m + T[:3, 3]


def test_probe_of_perturbed_arms_is_the_product_of_their_matrices():
    rng = np.random.default_rng(1)
    arm, X = arm_of(rng), rng.normal(0.0, 0.5, (200, 4))
    nominal = arm.nominal_m()
    for pose in range(2):
        expected = [multiplied_out(arm, pose, x) - nominal[pose] for x in X]
        np.testing.assert_allclose(probe_errors(arm, pose, X, nominal[pose]), expected, atol=1e-12)
        np.testing.assert_allclose(nominal[pose], multiplied_out(arm, pose, np.zeros(4)), atol=1e-14)


def test_arms_counted_in_two_parts_are_those_counted_at_once():
    arm, law = arm_of(np.random.default_rng(2)), columns([NORMAL] * 4)
    nominal, bins = arm.nominal_m(), np.full(2, 0.01)
    parts = [count_arms(arm, law, nominal, bins, first, count, seed=9) for first, count in ((0, 256), (256, 300))]
    once = count_arms(arm, law, nominal, bins, 0, 556, seed=9)
    both = parts[0].plus(parts[1])
    np.testing.assert_allclose(both.sums, once.sums, rtol=1e-12)
    assert (both.histogram == once.histogram).all()
    assert (both.worst_arm == once.worst_arm).all()
    assert both.histogram.sum(axis=1).tolist() == [556, 556]
