"""Bases and work objects: measured with the corrected arm, or as they were taught."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibeam.cli import run
from calibrate.apply.correct.corrected import Arms, Options, taken_up
from calibrate.apply.correct.tables import measured_frame
from calibrate.errors import DataError
from calibrate.model.model_file import write_model
from tests.calibrate.apply.correct.six_joints import drawn, model, postures, real

Q = postures(6, seed=4)
TOOL = np.eye(4)
FRAME = np.eye(4)
FRAME[:3, :3], FRAME[:3, 3] = Rotation.from_rotvec([0.1, -0.2, 0.7]).as_matrix(), [0.4, 0.1, 0.2]


def touched(count=6):
    """(point, 3) in the frame, that the real flange touches at `Q`; the model draws its flange best on the nominal."""
    arms_flange = real().frames(Q)[:, -1]
    best = mounted()
    at_m = (arms_flange @ best)[:count, :3, 3]
    return (at_m - FRAME[:3, 3]) @ FRAME[:3, :3]


def mounted():
    return Arms.of(model(), Options(tool=TOOL)).flange.T


def test_a_frame_is_where_the_touched_points_have_it():
    found = measured_frame(model(), touched(), Q, {}, Options(tool=TOOL))
    np.testing.assert_allclose(found.T_base_frame, FRAME, atol=1e-9)
    assert found.rms_m < 1e-9
    assert np.all((found.sigma > 0.0) & (found.sigma < 1e-3))


def test_a_point_that_lies_at_another_place_is_named_and_two_points_are_too_few():
    points = touched()
    points[2] += [0.0, 0.0, 0.05]
    with pytest.raises(DataError, match="point 3"):
        measured_frame(model(), points, Q, {}, Options(tool=TOOL))
    with pytest.raises(DataError, match="3 touched points"):
        measured_frame(model(), touched(2), Q[:2], {}, Options(tool=TOOL))


def test_a_taught_frame_holds_the_rigid_part_of_the_old_errors():
    rng = np.random.default_rng(1)
    goal_m = rng.uniform(-0.3, 0.3, (20, 3))
    shift_m = np.array([1e-3, 0.0, -5e-4]) + np.cross([1e-3, 2e-3, 0.0], goal_m)
    frames = np.zeros(20, dtype=int)
    np.testing.assert_allclose(taken_up(frames, goal_m, shift_m), np.linalg.norm(shift_m, axis=1), atol=1e-12)
    random_m = 1e-3 * rng.standard_normal((20, 3))
    assert np.nanmean(taken_up(frames, goal_m, random_m) ** 2) < 0.3 * np.mean(np.sum(random_m**2, axis=1))


def test_poses_without_a_command_say_nothing_of_a_frame():
    rng = np.random.default_rng(3)
    goal_m, shift_m = rng.uniform(-0.3, 0.3, (8, 3)), np.tile([2e-4, 0.0, 1e-4], (8, 1))
    goal_m[2], shift_m[5] = np.nan, np.nan
    held_m = taken_up(np.zeros(8, dtype=int), goal_m, shift_m)
    assert np.isnan(held_m[[2, 5]]).all()
    assert held_m[[0, 1, 3, 4, 6, 7]] == pytest.approx(np.hypot(2e-4, 1e-4))


def test_a_frame_is_fitted_to_a_table_of_points_and_a_bad_frame_is_refused(tmp_path, capsys):
    write_model(tmp_path / "model.json", model())
    header = "x_m,y_m,z_m," + ",".join(f"q{j}_rad" for j in range(1, 7))
    rows = [",".join(map(repr, [*map(float, p), *map(float, q)])) for p, q in zip(touched(), Q, strict=True)]
    (tmp_path / "points.csv").write_text("\n".join([header, *rows]) + "\n")
    T = np.linalg.inv(FRAME) @ drawn().frames(Q[:1])[0, -1]
    place = ",".join(map(repr, map(float, [*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_rotvec()])))
    (tmp_path / "poses.csv").write_text(f"x_m,y_m,z_m,rx_rad,ry_rad,rz_rad\n{place}\n")
    asked = ["correct", str(tmp_path / "model.json"), str(tmp_path / "poses.csv"), "--out", str(tmp_path / "out.csv")]
    start = ["--tool", *"000000", "--start", *map(str, np.degrees(Q[0]))]
    points = ["--points", str(tmp_path / "points.csv")]
    assert run([*asked, *start, "--frame", "table", *points]) == 0
    printed = capsys.readouterr().out
    assert "frame table: 0.400000 0.100000 0.200000" in printed.replace("\n", " ")
    assert "measure again" not in printed  # it was just now
    stated = [*map(str, FRAME[:3, 3]), "0.1", "-0.2", "0.7"]
    assert run([*asked, *start, "--frame", *stated]) == 0
    assert "\nmeasure again: the frame of --frame: " in capsys.readouterr().out
    assert run([*asked, *start, "--frame", "table"]) == 1
    assert run([*asked, *start, *points]) == 1
