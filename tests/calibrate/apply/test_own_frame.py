"""Sigma of the tip in the robot's own frame, against arms whose truth is known; in the world it is the base's place.

The recordings hide no effect, and none is searched: what is judged is the covariance of geometry as a prediction maps
it. Truth is moved upon the model over the whole workspace before both are compared: that motion is the frame.
"""

import numpy as np
import pytest

from acquisition.recording import read
from calibeam.notebook import Model
from calibrate.apply.correct.corrected import Arms, Options
from calibrate.diagnose.gross_errors import gross_errors_first
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.diagnose.with_model.from_diagnosis import model_of_fit
from calibrate.model.rigid import transform
from simulators.arm.kinematics import forward
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

NORMAL_95 = 1.959964
POSTURES, JUDGED = 400, 40


def drawn(folder, family, seed):
    """A concealed case without a defect, and the model of its recording."""
    case = conceal(Wanted(family=family, seed=seed, samples=200))
    write_case(case, folder)
    recording = read(folder / "recording")
    cleared = gross_errors_first(recording.rig, recording.samples)
    fit = fit_geometry(session_of(recording.rig, cleared.samples))
    return case, Model(model_of_fit(fit, fit, cleared, recording, "geometry alone"), "with care", "", ())


@pytest.fixture(scope="module")
def tracked(tmp_path_factory):
    """Folder of a tracker's session, its case and its model."""
    folder = tmp_path_factory.mktemp("tracked")
    return folder, *drawn(folder, "tracker", 7100)


def errors_and_sigma(case, model, seed):
    """(posture, 3) true tip in the frame that lies best on the model less the model's, and its sigma."""
    rig, rng = case.drawn.true, np.random.default_rng(seed)
    q = rng.uniform(rig.arm.lower_rad, rig.arm.upper_rad, (POSTURES, rig.arm.n_joints))
    flange = forward(rig.arm, q + rig.arm.zero_rad).flange
    true = flange[:, :3, :3] @ rig.tool_point_m + flange[:, :3, 3]
    return (_upon(true, model.tip(q)) - model.tip(q))[:JUDGED], model.tip_sigma(q[:JUDGED]), q[:JUDGED]


def _upon(points, onto):
    """Least squares, by turns of a small motion: the test's own way."""
    out = points
    for _ in range(5):
        columns = [np.tile(axis, (len(out), 1)) for axis in np.eye(3)] + [np.cross(axis, out) for axis in np.eye(3)]
        A = np.stack([c.ravel() for c in columns], axis=1)
        v = np.linalg.lstsq(A, (onto - out).ravel(), rcond=None)[0]
        T = transform(v[:3], v[3:])
        out = out @ T[:3, :3].T + T[:3, 3]
    return out


def test_the_robots_own_frame_leaves_out_where_the_base_stands(tracked):
    _, case, model = tracked
    error, sigma, q = errors_and_sigma(case, model, 1)
    assert 0.5 < np.sqrt(np.mean((error / sigma) ** 2)) < 1.6
    assert np.max(sigma) < 1e-4
    assert np.median(model.tip_sigma(q, frame="world")) > 100.0 * np.median(sigma)
    assert np.array_equal(model.tip_sigma(q[:3]), sigma[:3])  # of a posture, whatever else is asked
    assert np.all(model.flange_sigma(q, frame="world")[:, :3].max(axis=1) > model.flange_sigma(q)[:, :3].max(axis=1))


def test_a_model_without_effects_holds_the_joint_range_of_its_recording(tracked):
    folder, _, model = tracked
    arms = Arms.of(model.file, Options())
    q_rad = read(folder / "recording").samples.joints()
    assert (arms.low_rad, arms.high_rad) == (pytest.approx(q_rad.min(axis=0)), pytest.approx(q_rad.max(axis=0)))


def test_the_likelihood_of_a_diagnosed_model_names_the_law_it_is_of(tracked):
    _, _, model = tracked
    assert model.file.fit.law == "student-t"


def test_a_frame_of_another_name_is_refused(tracked):
    _, _, model = tracked
    with pytest.raises(ValueError, match="frame 'device': give one of robot, world"):
        model.tip_sigma(np.zeros(6), frame="device")


@pytest.mark.endure
@pytest.mark.parametrize("family", ["tracker", "wire"])
def test_intervals_in_the_robots_own_frame_hold_the_truth(tmp_path, family):
    """What is known worse than a millimetre (one wire and no tolerance) says nothing of intervals and is left out."""
    inside, squares = [], []
    for k in range(40):
        case, model = drawn(tmp_path / str(k), family, 7200 + k)
        error, sigma, _ = errors_and_sigma(case, model, k)
        if np.max(sigma) < 1e-3:
            inside.append(np.mean(np.abs(error) <= NORMAL_95 * sigma))
            squares.append(np.mean((error / sigma) ** 2))
    assert len(inside) >= 20
    assert 0.93 <= np.mean(inside) <= 0.97
    assert 0.9 <= np.sqrt(np.mean(squares)) <= 1.1
