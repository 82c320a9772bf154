"""Several blocks as one problem: shared names are one unknown, and what disagrees is refused."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from calibrate.errors import DataError
from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.solvers import Status, solve
from calibrate.model.parameters import Parameter, hold


@dataclass(frozen=True)
class Line:
    """Rows a x = b of named unknowns."""

    parameters: tuple
    a: np.ndarray
    b: np.ndarray

    @property
    def rows(self):
        return len(self.b)

    def residual(self, theta):
        return self.a @ theta - self.b

    def jacobian(self, theta):
        return self.a

    def select(self, rows):
        return Line(self.parameters, self.a[rows], self.b[rows])


X, Y, Z = (Parameter(name, "m", 1.0) for name in ("arm.x", "arm.y", "tool.z"))


@pytest.fixture
def joint():
    one = Line((X, Y), np.array([[1.0, 1.0], [1.0, -1.0], [2.0, 1.0]]), np.array([3.0, -1.0, 4.0]))
    two = Line((Y, Z), np.array([[1.0, 1.0], [0.0, 2.0]]), np.array([5.0, 6.0]))
    return JointProblem((one, two))


def test_unknowns_of_one_name_are_one_column(joint):
    assert [p.name for p in joint.parameters] == ["arm.x", "arm.y", "tool.z"]
    expected = [[1, 1, 0], [1, -1, 0], [2, 1, 0], [0, 1, 1], [0, 0, 2]]
    assert_array_equal(joint.jacobian(np.zeros(3)), expected)
    fit = solve(joint)
    assert fit.status is Status.CONVERGED
    assert_allclose(fit.theta, [1.0, 2.0, 3.0], atol=1e-7)


def test_rows_are_chosen_through_all_blocks(joint):
    cut = joint.select(np.array([1, 2, 4]))
    assert (joint.rows, cut.rows, cut.first_rows) == (5, 3, (0, 2))
    theta = np.array([0.3, -0.2, 0.9])
    assert_allclose(cut.residual(theta), joint.residual(theta)[[1, 2, 4]])
    assert_allclose(cut.jacobian(theta), joint.jacobian(theta)[[1, 2, 4]])
    assert_allclose(cut.by_row(theta), joint.by_row(theta)[[1, 2, 4]])


def test_a_block_may_lose_all_its_rows_and_the_unknowns_stay(joint):
    cut = joint.select(np.array([0, 1]))
    assert [p.name for p in cut.parameters] == ["arm.x", "arm.y", "tool.z"]
    assert cut.jacobian(np.zeros(3)).shape == (2, 3)
    assert cut.by_row(np.zeros(3)).shape == (2,)


def test_held_parameters_stay_held_in_a_selection(joint):
    held = joint.with_parameters(hold(joint.parameters, ["arm.y"]))
    assert [p.free for p in held.select(np.array([0])).parameters] == [True, False, True]


def test_what_one_block_leaves_idle_another_may_free():
    idle = Line((replace(X, free=False),), np.ones((1, 1)), np.ones(1))
    busy = Line((X,), np.ones((1, 1)), np.ones(1))
    assert JointProblem((idle, busy)).parameters[0].free
    assert not JointProblem((idle, idle)).parameters[0].free


@pytest.mark.parametrize("change", [{"prior": 1e-3}, {"lower": -1.0}, {"start": 2.0}, {"unit": "rad"}])
def test_disagreement_about_a_shared_unknown_is_refused(change):
    one = Line((X,), np.ones((1, 1)), np.ones(1))
    other = Line((replace(X, **change),), np.ones((1, 1)), np.ones(1))
    with pytest.raises(DataError, match=f"arm.x has {next(iter(change))}"):
        JointProblem((one, other))


def test_parameters_of_other_names_and_no_blocks_are_refused(joint):
    with pytest.raises(DataError, match="not those of the blocks"):
        joint.with_parameters((X,))
    with pytest.raises(DataError, match="no blocks"):
        JointProblem(())
