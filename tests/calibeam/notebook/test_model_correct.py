"""`model.correct` gives what `calibeam correct` writes; what it cannot take is refused."""

import csv

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import calibeam
from calibeam.cli import run
from calibrate.model.model_file import write_model
from tests.calibrate.apply.correct.six_joints import drawn, model, postures, real
from tests.calibrate.model.with_effects.two_joints import two_joints

Q = postures(5)
T = drawn().frames(Q)[:, -1]
FIGURES = ("error_m", "s_error_m", "error_rad", "s_error_rad")


@pytest.fixture
def folder(tmp_path):
    """model.json, and poses.csv with a last pose that is out of reach."""
    write_model(tmp_path / "model.json", model())
    table = np.concatenate([T[:, :3, 3], Rotation.from_matrix(T[:, :3, :3]).as_rotvec(), Q], axis=1)
    table[-1, :3] *= 10.0
    with (tmp_path / "poses.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad", *(f"q{j + 1}_rad" for j in range(6))])
        writer.writerows(table.tolist())
    return tmp_path


def written(folder, *more):
    """corrected.csv, row by row; 3: one pose has no command."""
    out = folder / "corrected.csv"
    assert run(["correct", str(folder / "model.json"), str(folder / "poses.csv"), "--out", str(out), *more]) == 3
    with out.open() as file:
        return list(csv.DictReader(file))


def column(rows, name):
    return np.array([float(row[name] or "nan") for row in rows])


@pytest.mark.parametrize("approach", [None, "positive"])
def test_it_is_what_the_command_writes(folder, approach):
    rows = written(folder, *(["--approach", approach] if approach else []))
    found = calibeam.open_model(folder / "model.json").correct(folder / "poses.csv", approach=approach)
    poses = [row for row in rows if row["kind"] == "pose"]
    for j in range(6):
        assert np.array_equal(found.q_rad[:, j], column(poses, f"q{j + 1}_rad"), equal_nan=True)
    for name in FIGURES:
        for when, errors in (("before", found.before), ("after", found.after)):
            stem, unit = name.rsplit("_", 1)
            assert np.array_equal(getattr(errors, name), column(poses, f"{stem}_{when}_{unit}"), equal_nan=True)
    assert list(found.status) == [row["status"] for row in poses] == ["ok"] * 4 + ["unreachable"]
    assert list(found.says) == [row["says"] for row in poses]
    if approach:
        via = [row for row in rows if row["kind"] == "approach"]
        assert np.array_equal(found.via_rad[:4, 1], column(via, "q2_rad"))


def test_arrays_are_corrected_as_the_table_is(folder):
    known = calibeam.open_model(folder / "model.json")
    of_arrays = known.correct(T[:4], near_rad=Q[:4])
    assert np.allclose(of_arrays.q_rad, known.correct(str(folder / "poses.csv")).q_rad[:4], atol=1e-9)
    assert np.allclose(real().frames(of_arrays.q_rad)[:, -1, :3, 3], T[:4, :3, 3], atol=1e-8)
    assert np.allclose(known.correct(T[0], near_rad=Q[0]).q_rad, of_arrays.q_rad[:1], atol=1e-12)


def test_a_condition_that_an_effect_needs_is_named():
    """Play of a joint: without an approach side, nothing is known of the first pose."""
    known = calibeam.Model(two_joints(), "unknown", "", ())
    flange = known.flange(np.array([[0.3, 0.4]]), {"approach1": 1.0, "approach2": 1.0})
    near_rad = np.array([0.3, 0.4])
    assert any("approach" in note for note in known.correct(flange, near_rad=near_rad).notes)
    assert not any("approach" in note for note in known.correct(flange, near_rad=near_rad, approach="positive").notes)


@pytest.mark.parametrize("poses", [np.zeros((2, 3)), np.zeros((2, 4, 4)), "no-such.csv"])
def test_what_is_no_pose_is_refused(folder, poses):
    with pytest.raises(calibeam.DataError):
        calibeam.open_model(folder / "model.json").correct(poses)


def test_a_model_is_not_opened_as_a_recording(folder):
    with pytest.raises(calibeam.RecordingError, match="open_model"):
        calibeam.open(folder / "model.json")
    assert calibeam.open_model(folder / "model.json").trust == "unknown"
