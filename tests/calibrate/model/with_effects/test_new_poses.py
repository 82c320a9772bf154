"""Terms told at poses that were not measured: where a new pose is a measured one, they say what they said there."""

from dataclasses import replace

import numpy as np
import pytest

from calibrate.diagnose.assess import limits
from calibrate.diagnose.assess.free_space_change import free_space_change
from calibrate.diagnose.new_poses.longer_session import NewPoses, at_new_poses
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.model.effects.term import Accepted
from calibrate.model.with_effects.new_poses import (
    alike,
    carried_over,
    extended,
    moves_tool,
)
from tests.calibrate.diagnose.concealed import recording_of

AGAIN = 10
BY_POSES = 0.1  # of a term's size: columns chosen by the poses are nearly, not exactly, the same


@pytest.fixture(scope="module", params=["dual-psd", "cones"])
def fitted(request, tmp_path_factory):
    recording = recording_of(tmp_path_factory.mktemp("s"), family=request.param, seed=61, samples=100)
    return fit_geometry(session_of(recording.rig, recording.samples))


def drawn(term, drivers, rng):
    inner = np.array([one.grid[len(one.grid) // 2] for one in term.inner])
    return Accepted(term, rng.normal(0.0, 1e-4, term.basis(drivers, inner).shape[-1]), inner)


def kinds_of(state):
    """One term of every kind that moves the arm."""
    first = {}
    for term in state.candidates():
        if moves_tool(term):
            first.setdefault((term.physics, term.variant, term.shape), term)
    return list(first.values())


def test_every_cause_is_reported_where_it_was_measured_as_it_was_there(fitted):
    drivers, rng = fitted.drivers, np.random.default_rng(3)
    again = rng.choice(len(drivers.q_rad), AGAIN, replace=False)
    copies = int(limits.POSES_FOR_ONE_NEW * AGAIN / len(drivers.q_rad))
    longer = extended(drivers, drivers.q_rad[again], drivers.frames[again], again, copies)
    kinds = kinds_of(fitted)
    assert len(kinds) > 15
    for term in kinds:
        one = drawn(term, drivers, rng)
        was = term.basis(drivers, one.inner) @ one.coefficients
        carried = carried_over(one, drivers, longer)
        assert carried is not None, term.key
        away = carried[-AGAIN:] @ one.coefficients - was[again]
        assert np.max(np.abs(away)) <= BY_POSES * np.max(np.abs(was)), term.key


def test_a_term_counted_from_the_mean_keeps_its_level():
    x = np.linspace(0.0, 1.0, 20)
    more = np.concatenate([x, [5.0]])
    was, now = (x - x.mean())[:, None, None], (more - more.mean())[:, None, None]
    same, level = alike(now[:20], was)
    assert same == pytest.approx(np.ones((1, 1)))
    assert level == pytest.approx(np.array([[more.mean() - x.mean()]]))


def test_causes_that_are_the_same_have_no_level():
    basis = np.random.default_rng(1).normal(size=(12, 6, 2))
    same, level = alike(basis, basis @ np.array([[2.0], [3.0]]))
    assert same.ravel() == pytest.approx([2.0, 3.0])
    assert np.all(level == 0.0)


def test_free_space_is_reported_with_a_joint_that_yields_whatever_its_masses(fitted):
    """Columns may be chosen by the poses of the session; the error that they made anywhere is told all the same."""
    soft = [t for t in fitted.candidates() if (t.physics, t.port.where) == ("joint-compliance", "joint2.angle")]
    one = max((drawn(t, fitted.drivers, np.random.default_rng(1)) for t in soft), key=lambda a: len(a.coefficients))
    after = fitted.refitted([replace(one, coefficients=np.zeros(len(one.coefficients)))])
    change = free_space_change(fitted, after, np.random.default_rng(2))
    assert change is not None
    assert 0.0 < change.after_m <= change.before_m


def test_new_poses_are_as_warm_as_those_they_are_like(fitted):
    drivers = fitted.drivers
    like = np.array([3, 7])
    there = at_new_poses(fitted, NewPoses(drivers.q_rad[like], np.ones((2, drivers.n_joints)), like))
    for place, values in drivers.temperatures_degC.items():
        assert there.drivers.temperatures_degC[place][-2:] == pytest.approx(values[like])
