"""What each kind of error does to the probe, by laws that need no model of the arm."""

import numpy as np
import pytest

from calibrate.error_simulation.machine import arm_at, columns_of, probe_errors
from calibrate.error_simulation.sensitivity import alone, propagate


def errors(machine, sources, q_rad, values):
    """(pose, 3) of one arm with these values of its sources, a phased one with (size, phase)."""
    columns = columns_of(sources)
    arm, X = arm_at(machine, sources, columns, q_rad), np.zeros((1, columns.count))
    for (own, other), value in zip(columns.of_source, values, strict=True):
        size, phase = value if other >= 0 else (value, 0.0)
        X[0, own] = size * np.cos(phase)
        if other >= 0:
            X[0, other] = size * np.sin(phase)
    nominal = arm.nominal_m()
    return np.concatenate([probe_errors(arm, i, X, nominal[i]) for i in range(len(q_rad))])


def test_an_arm_that_is_warmer_all_over_is_the_same_arm_larger(machine, poses, stated):
    source = stated({"what": ("heat.arm",), "scale_k": 1.0}, expansion_per_k=23e-6)
    grown = errors(machine, source, poses, [10.0])
    np.testing.assert_allclose(grown, 230e-6 * machine.tip_m(poses), atol=1e-15)


def test_an_eccentric_encoder_is_a_zero_that_goes_round(machine, poses, stated):
    sources = stated({"what": ("joint3.zero", "joint3.eccentricity"), "scale_rad": 1e-4})
    for i in range(len(poses)):
        pose = poses[i : i + 1]
        turned = errors(machine, sources, pose, [2e-4 * np.sin(pose[0, 2] + 0.7), (0.0, 0.0)])
        seen = errors(machine, sources, pose, [0.0, (2e-4, 0.7)])
        np.testing.assert_allclose(seen, turned, atol=1e-15)


@pytest.mark.parametrize("kind", ["runout-radial", "runout-axial"])
def test_runout_shifts_the_probe_by_its_size_or_less(machine, poses, stated, kind):
    sources = stated({"what": (f"joint2.{kind}",), "scale_m": 1e-5})
    sizes = np.array([np.linalg.norm(errors(machine, sources, poses, [(1e-5, f)]), axis=1) for f in (0.0, 1.0, 2.0)])
    largest = 1e-5 if kind == "runout-radial" else 1e-5 * np.abs(np.sin(poses[:, 1] + np.array([[0.0], [1.0], [2.0]])))
    np.testing.assert_allclose(sizes, np.broadcast_to(largest, sizes.shape), atol=1e-17)


def test_the_probe_does_not_feel_how_the_last_frame_is_turned(machine, poses, stated):
    assert alone(machine, stated({"what": ("link6.yaw",), "scale_rad": 1e-3})[0], poses).max_m.max() < 1e-15


def test_yaw_of_a_part_and_the_zero_behind_it_are_one(machine, poses, stated):
    sources = stated({"what": ("link2.yaw", "joint3.zero"), "scale_rad": 1e-3})
    np.testing.assert_allclose(*(errors(machine, sources, poses, v) for v in ([0.01, 0], [0, 0.01])), atol=1e-15)


def test_derivatives_by_slots_are_the_differences(machine, poses, every):
    step, columns = 1e-6, columns_of(every)
    arm, by_slot = arm_at(machine, every, columns, poses), machine.by_slot(poses)
    nominal = arm.nominal_m()
    X = np.concatenate([step * np.eye(columns.count), -step * np.eye(columns.count)])
    for pose in range(len(poses)):
        plus, minus = np.split(probe_errors(arm, pose, X, nominal[pose]), 2)
        difference = (plus - minus) / (2.0 * step)
        for source, own in zip(every, columns.of_source, strict=True):
            by = source.by_column(by_slot, poses)[pose].T
            np.testing.assert_allclose(difference[own[own >= 0]], by, atol=3e-9)


def test_shares_of_linear_propagation_add_up(machine, poses, every):
    linear = propagate(machine, every, poses)
    assert linear.shares.sum() == pytest.approx(1.0)
    total = np.sqrt(np.mean(linear.rms_m**2))
    bias = linear.mean_m.sum(axis=0)
    spread = np.sum(linear.alone_m**2) - np.mean(np.sum(linear.mean_m**2, axis=(0, 2)))
    assert total == pytest.approx(np.sqrt(spread + np.mean(np.sum(bias**2, axis=1))))
