"""Intervals: a number with its doubt, or the reason for none; never both, never neither."""

from dataclasses import replace

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from benchmarks.intervals import intervals
from calibrate.fit.identify.point_constraint import BOUND_RAD, Constraint, PointConstraint
from calibrate.fit.rank.identifiability import analyse
from calibrate.fit.rank.observability import Redundant, reduced
from calibrate.fit.solvers import Status, solve
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.dual_psd_rig import laser_of
from calibrate.model.parameters import Parameter, hold


def by_name(fit, seen):
    return {one.name: one for one in intervals(fit, seen)}


def test_every_parameter_has_a_number_or_a_reason(fitted):
    one = fitted(80)
    for found in intervals(one.fit, one.seen):
        assert (found.value is None) == (found.low is None) == (found.sigma is None) == (found.why is not None)
        assert found.value is None or found.low < found.value < found.high


def test_a_wider_level_is_a_wider_interval(fitted):
    one = fitted(80)
    narrow, wide = (intervals(one.fit, one.seen, level) for level in (0.5, 0.99))
    for a, b in zip(narrow, wide, strict=True):
        assert a.value is None or b.low < a.low < a.high < b.high


def test_what_only_counts_together_has_no_number_whatever_holds_it(fitted):
    one = fitted(80)
    held_by_priors = reduced(one.problem.chain.parameters, one.seen, Redundant.HELD_BY_PRIORS)
    for fit in (one.fit, solve(one.problem.with_parameters(held_by_priors), start=one.fit.theta)):
        assert fit.status is Status.CONVERGED
        found = by_name(fit, one.seen)
        for name in ("joint1.zero", "device.yaw", "joint6.zero", "tool.x"):
            assert found[name].value is None
            assert "only in combination" in found[name].why
        assert found["joint3.zero"].value == pytest.approx(one.truth["joint3.zero"], abs=5e-4)


def test_a_fit_that_did_not_end_well_has_no_numbers(fitted):
    one = fitted(80)
    broken = replace(one.fit, status=Status.OUT_OF_STEPS)
    assert all(found.value is None for found in intervals(broken, one.seen))


def test_the_papers_joints_at_the_bound_are_no_result_and_silence_the_others(request, sessions):
    """Four poses, each pair alike, links not as drawn: joint 2 runs into its bound, as it did in the paper."""
    rig = load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")
    session = sessions(24, n=40, spread=0.0, places=(1,))
    rows = np.concatenate([most_alike(session.q_rad, np.flatnonzero(session.first_psd == k)) for k in (1, 2)])
    arm, laser = arm_of(rig), laser_of(rig)
    listed = tuple(
        Parameter(p.name, p.unit, p.plausible, lower=-BOUND_RAD, upper=BOUND_RAD)
        if p.name.endswith(".zero")
        else Parameter(p.name, p.unit, p.plausible, free=False)
        for p in arm.parameters + laser.parameters
    )
    q_rad, first = session.q_rad[rows], session.first_psd[rows]
    problem = PointConstraint(arm, laser, q_rad, first, 5e-6, Constraint.PAIR_POINTS, listed)
    seen = analyse(problem.jacobian(np.zeros(len(listed))), listed)
    fit = solve(replace(problem, parameters=hold(listed, (c.representative for c in seen.combinations))))
    assert fit.status is Status.AT_BOUND
    assert "joint2.zero" in fit.at_bound
    found = by_name(fit, seen)
    assert all(one.value is None for one in found.values())
    assert found["joint2.zero"].why == "at its bound: no result"
    assert "ran into the bound" in found["joint4.zero"].why


def most_alike(q_rad, rows):
    """The two of these poses that are nearest to each other."""
    apart = np.linalg.norm(q_rad[rows][:, None] - q_rad[rows][None], axis=2) + 1e9 * np.eye(len(rows))
    return rows[list(np.unravel_index(np.argmin(apart), apart.shape))]
