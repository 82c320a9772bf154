"""Exciting motions: within every limit, better than drawn ones, with sigmas that a fit of drawn noise confirms."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.rig import load_rig, parse_rig
from calibeam.motion.exciting_motion import check_motion, clear_motion
from calibrate.diagnose.motion import planned_drivers
from calibrate.diagnose.motion.links_alone import torque_state
from calibrate.diagnose.motion.motion_table import planned_motion
from calibrate.diagnose.motion.torque_state import with_noise
from calibrate.diagnose.motion.torques import usual_friction
from calibrate.errors import DataError
from calibrate.excitation import ExcitationWish, excite, fourier, torque_information
from calibrate.fit.solvers import solve

PATH = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"
RIG = load_rig(PATH)
WISH = ExcitationWish(length_s=10.0, repeats=2)
NOISE_NM = 0.5


@pytest.fixture(scope="module")
def made():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fourier, "DRAWN", 10)
        patch.setattr(fourier, "STEPS", 25)
        return excite(RIG, WISH, clear_motion(RIG))


def test_the_motion_keeps_within_speed_range_and_the_gate(made) -> None:
    t_s = np.linspace(0.0, WISH.length_s, 5000)
    speed = np.abs(made.plan.at(t_s, 1)).max(axis=0)
    assert np.all(speed <= WISH.speed_share * RIG.motion.speed_rad_s)
    assert np.all(np.abs(made.plan.at(t_s, 2)).max(axis=0) <= RIG.motion.acceleration_rad_s2)
    assert made.speed_share == pytest.approx(speed / RIG.motion.speed_rad_s, rel=1e-2)
    assert np.all(made.room_rad > 0.0)
    check_motion(RIG, made.plan)


def test_it_is_better_than_the_drawn_ones(made) -> None:
    assert made.drawn > 5
    assert made.gain > 1.2


def test_all_of_it_is_determined_with_masses(made) -> None:
    assert all(np.isfinite(value) and value > 0.0 for value in made.information.sigma.values())


def test_without_masses_payload_and_lean_are_not_determined_and_friction_is(made) -> None:
    text = re.sub(r"mass_kg = .*\n|com_m = .*\n", "", PATH.read_text(encoding="utf-8"))
    bare = parse_rig(text, "bare.toml")
    found = torque_information(bare, made.plan, NOISE_NM).sigma
    assert np.isnan(found["tool.load", "mass_kg"])
    assert "base.lean" not in {place for place, name in found if np.isfinite(found[place, name])}
    assert all(np.isfinite(found[f"joint{j}.torque", "friction_nm"]) for j in range(1, 7))
    with pytest.raises(DataError, match="give --torque-noise-nm"):
        torque_information(bare, made.plan)


def test_sigmas_are_those_of_a_fit_to_drawn_noise(made) -> None:
    """Dry friction of joint 3, fitted by the diagnosis's own problem to torques of the same motion with white noise."""
    plan, rng, estimates = made.plan, np.random.default_rng(2), list[float]()
    t_s = np.linspace(0.0, plan.total_s, 400, endpoint=False)
    q, qd, qdd, jerk = (plan.at(t_s, k) for k in range(4))
    still = 0.02 * np.abs(qd).max(axis=0)
    links = planned_drivers(RIG, t_s, (q, qd, qdd, jerk)).torque_nm
    for _ in range(16):
        torque = np.where(np.abs(qd) < still, np.nan, links + NOISE_NM * rng.standard_normal(q.shape))
        state = torque_state(RIG, replace(planned_motion(t_s, q, qd, qdd, jerk), torque_nm=torque))
        problem = state.refitted(usual_friction(state)).problem
        problem, _ = with_noise(problem, solve(problem).theta)
        names = [p.name for p in problem.parameters]
        estimates.append(float(solve(problem).theta[names.index("term2.c0")]))
    predicted = torque_information(RIG, plan, NOISE_NM).sigma["joint3.torque", "friction_nm"]
    rows = min(600.0, 40.0 * plan.total_s)
    assert np.std(estimates) == pytest.approx(predicted * np.sqrt(rows / len(t_s)), rel=0.4)


def test_where_nothing_is_clear_the_boxes_are_named() -> None:
    with pytest.raises(DataError, match="check home_rad and the boxes"):
        excite(RIG, WISH, lambda q_rad, step_s: False)
