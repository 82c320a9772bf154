"""Other methods on the cases of a proof of motions: each predicts torques, and finds the size of what it can model."""

import importlib

import mujoco
import numpy as np
import pytest

from acquisition.recording import Recording
from benchmarks.drawn_motion import Hidden, recorded
from benchmarks.motion import by_least_squares
from benchmarks.motion_rivals import METHODS, Answer, size_error, table, without_masses
from benchmarks.rival_sysid import every_key, fitted, inverse_nm, keys_of, spec_of
from calibeam.prove.record import TrueDefect
from calibrate.diagnose.motion import expected_nm, torques_of_rig
from calibrate.diagnose.motion.motion_table import Motion, motion_of
from calibrate.diagnose.motion.unseen_motion import motion_in_two

FRICTION = TrueDefect("coulomb", "coulomb-friction", "joint3.torque", ("qd3",), {"friction_nm": 2.0}, 5.0)
DELAY = TrueDefect("late-torque", "torque-delay", "joint3.torque", ("dtau3",), {"delay_s": 5e-3}, 5.0)
LEAN = TrueDefect(
    "leaning-gravity", "gravity-direction", "base.lean", ("q1",), {"lean_x_rad": 3e-3, "lean_y_rad": 4e-3}, 5.0
)


@pytest.fixture(scope="module")
def recording() -> Recording:
    return recorded(Hidden(coulomb={3: 2.0}, payload_kg=0.5), length_s=8.0)


@pytest.fixture(scope="module")
def motion(recording: Recording) -> Motion:
    found = motion_of(recording)
    assert found is not None
    return found


def test_mujoco_starts_from_the_torques_that_the_rig_file_states(recording: Recording, motion: Motion) -> None:
    stated = torques_of_rig(recording.rig, "rig")
    assert stated is not None
    model = spec_of(recording.rig).compile()
    assert inverse_nm(model, motion) == pytest.approx(expected_nm(recording.rig, motion, stated), abs=1e-3)


def test_dry_friction_of_mujoco_has_the_sense_of_the_speed(recording: Recording, motion: Motion) -> None:
    spec = spec_of(recording.rig)
    without = inverse_nm(spec.compile(), motion)
    spec.joint("joint3").frictionloss = 2.0
    more = (inverse_nm(spec.compile(), motion) - without)[:, 2]
    moves = np.isfinite(motion.torque_nm[:, 2])
    assert more[moves] == pytest.approx(2.0 * np.sign(motion.qd_rad_s[moves, 2]), abs=1e-3)


def test_every_parameter_of_the_right_list_is_among_all_and_a_delay_is_in_none() -> None:
    assert keys_of(FRICTION, 6) == ("joint3.frictionloss",)
    assert {*keys_of(FRICTION, 6), *keys_of(LEAN, 6)} < set(every_key(6))
    assert keys_of(DELAY, 6) == ()


def test_mujoco_finds_the_size_of_what_it_is_given(recording: Recording, motion: Motion) -> None:
    if not hasattr(importlib.import_module("mujoco.sysid"), "optimize"):
        pytest.skip("mujoco.sysid needs the packages of requirements/bench.txt")
    payload = TrueDefect("unstated-payload", "payload", "tool.load", ("q1",), {"mass_kg": 0.5}, 5.0)
    hidden = (FRICTION, payload)
    seen, unseen = motion_in_two(motion)
    fit = fitted(recording.rig, seen, np.full(6, 0.035), [key for one in hidden for key in keys_of(one, 6)])
    for one in hidden:
        error = size_error(one, fit.figures(one, 6))
        assert error is not None
        assert error < 0.05
    assert fit.figures(DELAY, 6) is None
    assert np.nanstd(unseen.torque_nm - inverse_nm(fit.model, unseen)) < 0.05
    start = inverse_nm(spec_of(recording.rig).compile(), unseen)
    assert np.nanstd(unseen.torque_nm - start) > 0.5


def test_least_squares_finds_dry_friction_without_stated_masses(recording: Recording, motion: Motion) -> None:
    plain = by_least_squares(without_masses(recording.rig), *motion_in_two(motion))
    assert plain.friction["coulomb-friction", "joint3.torque"] == pytest.approx(2.0, rel=0.05)
    assert plain.left_nm.max() < 0.1


def test_a_size_that_is_not_found_is_wrong_by_all_of_it_and_one_outside_the_model_has_no_error() -> None:
    assert size_error(LEAN, {"lean_x_rad": 3e-3}) == pytest.approx(0.8)
    assert size_error(FRICTION, {}) == pytest.approx(1.0)
    assert size_error(FRICTION, None) is None


def test_the_table_counts_what_lies_outside_a_model_as_not_within_a_tenth() -> None:
    first, second = Answer(1.0, (0.05, None)), Answer(2.0, (0.5,))
    rows = list(table([dict.fromkeys(METHODS, first), dict.fromkeys(METHODS, second)]))
    assert len(rows) == 2 + len(METHODS)
    assert rows[2] == "| calibeam | 1.50, 1.9 | 2 of 3 | 28 % | 1 of 3 |"


def test_an_arm_without_stated_masses_is_refused(recording: Recording) -> None:
    with pytest.raises(ValueError, match="mass_kg is missing"):
        spec_of(without_masses(recording.rig))
    assert isinstance(spec_of(recording.rig), mujoco.MjSpec)
