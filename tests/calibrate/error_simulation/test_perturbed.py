"""Columns of drawn numbers and the perturbed arm, multiplied out here."""

import numpy as np
from scipy import stats
from scipy.spatial.transform import Rotation

from calibrate.error_simulation.machine import (
    ArmAtPoses,
    Columns,
    columns_of,
    probe_errors,
)
from calibrate.error_simulation.monte_carlo import CHUNK, count_chunk
from calibrate.error_simulation.sources import (
    ErrorSource,
    Law,
    SourceTerm,
    Wave,
)

NORMAL = Law("normal", 1.0)


def test_normal_columns_are_normal_and_independent():
    x = Columns((NORMAL,) * 4, np.array([[i, -1] for i in range(4)])).draw(np.random.default_rng(5), 51_200)
    assert all(stats.kstest(column, "norm").pvalue > 1e-3 for column in x)
    assert np.abs(np.corrcoef(x) - np.eye(4)).max() < 0.02


def test_a_phased_source_is_its_size_at_a_phase_anywhere_in_the_turn():
    source = ErrorSource("one", "group", "rad", Law("constant", 2.0), (SourceTerm(6, wave=Wave(0, 1.0)),))
    x = columns_of([source]).draw(np.random.default_rng(1), 20_000)
    np.testing.assert_allclose(np.hypot(x[0], x[1]), 2.0, rtol=1e-14)
    assert stats.kstest(np.arctan2(x[1], x[0]) / (2.0 * np.pi) + 0.5, "uniform").pvalue > 1e-3


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


def test_angles_beyond_half_a_turn_and_a_reading_that_is_no_number():
    arm = arm_of(np.random.default_rng(3))
    arm.angle_rad[0] = [np.pi, -np.pi, 5.0]
    arm.angle_rad[1, 1] = np.nan
    np.testing.assert_allclose(arm.probes_m(0, np.zeros((4, 1)))[:, 0], multiplied_out(arm, 0, np.zeros(4)), atol=1e-14)
    assert np.isnan(arm.probes_m(1, np.zeros((4, 1)))).any()


def test_arms_of_two_chunks_add_up():
    arm, columns = arm_of(np.random.default_rng(2)), Columns((NORMAL,) * 4, np.array([[i, -1] for i in range(4)]))
    nominal, bins = arm.nominal_m(), np.full(2, 0.01)
    first, second = (count_chunk(arm, columns, nominal, bins, k, n, seed=9) for k, n in ((0, CHUNK), (1, 300)))
    both = first.plus(second)
    assert both.arms == CHUNK + 300
    assert both.histogram.sum(axis=1).tolist() == [CHUNK + 300] * 2
    np.testing.assert_allclose(both.mean_sum, first.mean_sum + second.mean_sum)
    longer = np.where(second.worst_m > first.worst_m, second.worst_arm, first.worst_arm)
    assert (both.worst_arm == longer).all()
    assert (second.worst_arm >= CHUNK).all()
