"""Pictures of the workspace: measured by poses left out, predicted only where the data support it, one even scale."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from calibrate.fit.solvers import solve
from calibrate.report.evidence.session_evidence import session_evidence
from calibrate.report.workspace.cells import (
    ABOVE,
    SIDE,
    Grid,
    grid_of,
    paint_measured,
    paint_poses,
    steps_for,
)
from calibrate.report.workspace.session_workspace import deleted_misfit, session_measured, workspace
from calibrate.report.workspace.workspace_errors import room_of, session_arm


@pytest.fixture(scope="module")
def known(arm_session):
    session = arm_session(60)
    recording = session.recording(session.positions())
    return session_evidence(recording, session.model(recording))


@pytest.fixture(scope="module")
def arm(known):
    found = session_arm(known)
    assert not isinstance(found, str), found
    return found


@pytest.fixture(scope="module")
def room(arm):
    return room_of(arm)


def test_a_model_of_a_diagnosis_has_the_tool_error_of_the_same_identification(arm_session, known, room):
    session = arm_session(60)
    recording = session.recording(session.positions())
    diagnosed = session_arm(session_evidence(recording, session.model_of_diagnosis(recording)))
    assert not isinstance(diagnosed, str), diagnosed
    of_both = [float(np.sqrt(np.mean(r.found_m[r.supported] ** 2))) for r in (room, room_of(diagnosed))]
    assert of_both[1] == pytest.approx(of_both[0], rel=0.25)


def test_a_model_without_covariance_has_none(known):
    without = replace(known, model=msgspec.structs.replace(known.model, free_space=None, covariance=None))
    assert isinstance(session_arm(without), str)


@pytest.mark.parametrize("row", [0, 31])
def test_a_pose_left_out_is_missed_as_by_a_fit_of_the_others(known, arm, row):
    held = {n for n, v in zip((p.name for p in arm.parameters), np.diag(arm.covariance), strict=True) if v == 0.0}
    parameters = tuple(replace(p, free=p.free and p.name not in held) for p in known.problem.parameters)
    others = np.delete(np.arange(known.problem.rows), row)
    refitted = solve(known.problem.with_parameters(parameters).select(others), start=known.theta).theta
    missed = known.problem.blocks[0].misfit(known.problem.of_block(0, refitted))[row]
    lines = deleted_misfit(known.problem, 0, known.theta, arm.covariance)
    assert lines is not None
    np.testing.assert_allclose(lines[row], missed, atol=0.02 * np.linalg.norm(missed))


def test_errors_of_poses_left_out_are_larger_than_those_of_the_fit(known, arm):
    measured = session_measured(known, arm)
    assert measured is not None
    fitted = known.readings[0].error_after
    assert np.all(measured.found_m > fitted)
    assert np.sqrt(np.mean(measured.found_m**2)) == pytest.approx(known.model.proofs[0].rms_distance_after_m, rel=0.35)


def test_no_pose_beyond_the_angles_or_the_leverage_of_the_session_is_supported(known, arm, room):
    assert np.all(room.q_rad > known.q_rad.min(axis=0))
    assert np.all(room.q_rad < known.q_rad.max(axis=0))
    assert 0.2 < room.supported.mean() < 1.0
    assert room.found_m[room.supported].max() < room.found_m.max()


def test_the_arm_as_drawn_is_never_better_and_off_by_what_it_was_drawn_wrong(known, arm, room):
    assert np.all(room.drawn_m >= room.found_m)
    exact = room_of(replace(arm, drawn=arm.theta))
    np.testing.assert_allclose(exact.drawn_m, exact.found_m, rtol=1e-6)
    assert np.sqrt(np.mean(room.drawn_m**2)) > 3.0 * np.sqrt(np.mean(room.found_m**2))


def test_what_the_data_cannot_determine_is_not_drawn(known):
    hidden = msgspec.structs.replace(
        known.model.free_space, status="UNDETERMINED", says="an unseen combination moves the target", rms_m=None
    )
    model = msgspec.structs.replace(known.model, free_space=hidden)
    why = session_arm(replace(known, model=model))
    assert isinstance(why, str)
    lines = workspace(why, None, "")
    assert "an unseen combination moves the target" in lines
    assert "<svg" not in lines


@pytest.mark.parametrize("view", [SIDE, ABOVE])
def test_cells_hold_the_rms_of_their_points_and_nothing_where_there_is_none(view):
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (400, 3))
    grid = grid_of(view, points)
    chosen = points[:, 0] > 0.0
    cells = grid.rms(points, np.full(400, 3e-4), chosen)
    np.testing.assert_allclose(cells[np.isfinite(cells)], 3e-4)
    assert np.array_equal(np.isfinite(cells), grid.reached(points[chosen]))
    left, right, bottom, top = grid.box_m
    flat = view.flat(points)
    assert left <= flat[:, 0].min() <= flat[:, 0].max() <= right
    assert bottom <= flat[:, 1].min() <= flat[:, 1].max() <= top


@pytest.mark.parametrize(("low", "high"), [(1e-6, 1.5e-6), (2e-5, 8e-4), (1e-7, 1e-1), (5e-5, 5e-5)])
def test_steps_are_round_hold_the_largest_and_darken_with_it(low, high):
    steps = steps_for(np.geomspace(low, high, 50))
    bounds = np.array(steps.bounds_m)
    assert np.all(np.diff(bounds) > 0.0)
    assert bounds[-1] >= high
    assert len(steps.colours) == len(bounds) - 1 <= 12
    grey = [np.dot(to_rgb(colour), (0.2126, 0.7152, 0.0722)) for colour in steps.colours]
    assert np.all(np.diff(grey) < 0.0)
    assert steps.of(np.array([np.nan, high])).tolist() == [-1, len(steps.colours) - 1]


def test_of_no_pose_at_all_nothing_is_drawn():
    axes, grid = Figure().add_subplot(), Grid(ABOVE, 0.1, (0, 0), (2, 2))
    steps = steps_for(np.array([1e-5, 2e-5]))
    paint_poses(axes, grid, np.zeros((0, 3)))
    paint_measured(axes, grid, np.zeros((0, 3)), np.zeros(0), steps)
    assert not any(len(line.get_xdata()) for line in axes.lines)
