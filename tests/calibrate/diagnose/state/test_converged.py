"""Refits converge: exact derivatives beside terms, no step along what no reading shows, none worse than its start."""

import numpy as np
import pytest

from calibrate.diagnose import limits
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import solved
from calibrate.diagnose.state.fitted import AT_REST, _turn, fit_geometry
from calibrate.diagnose.state.in_sight import in_sight
from calibrate.diagnose.state.session import session_of
from calibrate.fit.solvers import Stop
from calibrate.model.effects.term import Accepted
from tests.calibrate.diagnose.concealed import recording_of

WANTED = {"family": "tracker", "seed": 31, "samples": 120, "arm": "irb120", "defects": ("encoder-eccentricity",)}
NOTHING = np.zeros(0)


@pytest.fixture(scope="module")
def geometry(tmp_path_factory):
    rec = recording_of(tmp_path_factory.mktemp("converged"), **WANTED, enr=2.0)
    return fit_geometry(session_of(rec.rig, rec.samples))


def with_terms(state, *wanted):
    accepted = []
    for physics, where in wanted:
        term = next(t for t in state.candidates() if (t.physics, t.port.where) == (physics, where))
        inner = np.array([spec.grid[len(spec.grid) // 2] for spec in term.inner])
        accepted.append(Accepted(term, solved(Bench(state), term, inner)[0], inner))
    return state.refitted((*state.accepted, *accepted))


BENT = (("axis-wobble", "link3.tilt"), ("joint-compliance", "joint2.angle"))


def test_derivatives_are_exact_where_terms_bend_the_chain(geometry):
    """Else exact degeneracies (joint 6 and the tool) seem to be seen, at 1e-4 of the stiffest direction."""
    state = with_terms(geometry, *BENT)
    problem, at = state.problem, state.values.copy()
    first = len(state.session.parameters)
    at[first:] *= 1e-3 / max(float(np.max(np.abs(at[first:]))), 1e-300)  # a milliradian: far more than any finding
    slope = problem.jacobian(at)
    for i, parameter in enumerate(problem.parameters[:first]):
        step = np.zeros(len(at))
        step[i] = 1e-4 * parameter.plausible
        numeric = (problem.residual(at + step) - problem.residual(at - step)) / (2.0 * step[i])
        assert numeric == pytest.approx(slope[:, i], abs=2e-6 * np.max(np.abs(slope))), parameter.name


def test_exact_degeneracies_are_no_directions(geometry):
    """Link 6, joint 6 and the target; link 1, joint 1 and the device: only one of each group is seen."""
    parameters = geometry.problem.parameters
    found = in_sight(geometry.problem, geometry.values)
    free = sum(p.free for p in parameters)
    assert found.moves.shape[1] <= free - 8
    felt = geometry.problem.jacobian(geometry.values) @ found.moves
    assert np.linalg.svd(felt, compute_uv=False)[-1] >= 1.0


def test_settled_is_said_only_where_the_solver_is_at_rest(geometry):
    for state in (
        geometry,
        with_terms(geometry, ("encoder-eccentricity", "joint2.angle")),
        with_terms(geometry, *BENT),
    ):
        assert state.stop is Stop.LIKELIHOOD
        again = _turn(state.problem, state.active, state.values, state.noise)
        assert again.stop in AT_REST
        assert again.minus_two_log_likelihood == pytest.approx(state.minus_two_log_likelihood, abs=limits.SETTLED)


def test_a_refit_never_ends_worse_than_its_start(geometry):
    """Of its own terms from its own values, and with a term more."""
    state = with_terms(geometry, ("encoder-eccentricity", "joint2.angle"))
    assert state.refitted(state.accepted).minus_two_log_likelihood <= state.minus_two_log_likelihood + limits.SETTLED
    for term in (("axis-wobble", "link3.tilt"), ("joint-coupling", "joint4.angle")):
        more = with_terms(state, term)
        assert more.minus_two_log_likelihood <= state.minus_two_log_likelihood + limits.SETTLED


def test_a_bracket_that_gives_way_alike_is_a_device_that_stands_lower(geometry):
    """The trace of a symmetric compliance moves the target along gravity wherever the flange is."""
    term = next(t for t in geometry.candidates() if t.physics == "tool-sag" and t.variant == "bracket of any shape")
    state = geometry.refitted((Accepted(term, np.zeros(6), NOTHING),))
    found = in_sight(state.problem, state.values)
    own = np.flatnonzero(state.problem.owner == 0)
    moved = np.any(found.moves[own] != 0.0, axis=0)
    assert moved.sum() == 5


def test_derivatives_of_few_samples_are_those_rows_of_all(geometry):
    """A fit to few of them computes no others."""
    state = with_terms(geometry, *BENT)
    few = np.arange(0, state.samples, 3)
    cut = state.select(few)
    (whole,), (own,) = (one.problem.forgetting().slopes(state.values) for one in (state, cut))
    assert len(own) == len(few) < len(whole)
    assert own == pytest.approx(whole[cut.problem.rows[0]], abs=1e-12 * np.max(np.abs(whole)))


def test_drivers_are_those_of_the_fit_itself_once_it_is_renewed(geometry):
    """On the way a refit may go on from drivers that are hardly others; sizes and the model file may not."""
    last = with_terms(geometry, *BENT).renewed()
    used, now = last.problem.drivers, last.predicted
    assert np.abs(used.frames - now.frames).max() < 1e-5  # rad, m: 1e-5 of a gravity torque
    assert all(np.nanmax(np.abs(used.readouts[k].predicted - now.readouts[k].predicted)) < 1e-6 for k in now.readouts)


def test_states_with_the_same_drivers_list_the_catalogue_once(geometry):
    one = with_terms(geometry, BENT[1])
    other = one.refitted(one.accepted)
    assert other.drivers is one.drivers
    assert other.listed is one.listed
    assert one.renewed().listed is not one.listed
