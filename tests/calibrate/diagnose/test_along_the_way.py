"""A positioner of two axes that is measured on its way: what neighbours share there is not called noise."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import Recording, read
from acquisition.recording.rig import load_rig
from calibrate.diagnose.assess.assessment import _unseen_squares
from calibrate.diagnose.assess.diagnosis import Verdict
from calibrate.diagnose.from_recording import diagnose_samples
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import start_values

POSES = 144
NOISE_M, ERROR_M = 15e-6, 60e-6
RIG = """schema = 1
name = "positioner"

[arm]
model = "local-poe"

[[arm.joint]]
origin_m = [0.0, 0.0, 0.5]
rotation_rad = [0.0, 0.0, 0.0]
lower_rad = -3.2
upper_rad = 3.2

[[arm.joint]]
origin_m = [0.3, 0.0, 0.2]
rotation_rad = [1.5707963, 0.0, 0.0]
lower_rad = -3.2
upper_rad = 3.2

[arm.flange]
origin_m = [0.4, 0.0, 0.0]
rotation_rad = [0.0, 0.0, 0.0]

[tool]
point_m = [0.1, 0.2, 0.1]
"""


def positioner(folder: Path, error_m: float) -> Recording:
    """Poses along a slow way, with an error that is smooth in the angles and in no catalogue."""
    (folder / "rig.toml").write_text(RIG, encoding="utf-8")
    rig, rng = load_rig(folder / "rig.toml"), np.random.default_rng(1)
    way = np.linspace(0.0, 1.0, POSES)
    q = np.stack([-1.2 + 2.4 * way, np.sin(14.0 * way)], axis=1)
    arm = arm_of(rig)
    flange = arm.flange(start_values(arm.parameters), q)
    points = flange[:, :3, :3] @ np.array(rig.tool.point_m) + flange[:, :3, 3]
    wave = np.stack([np.sin(5.0 * q[:, 0] + 3.0 * q[:, 1] + phase) for phase in (0.0, 1.0, 2.5)], axis=1)
    points += rng.normal(0.0, NOISE_M, points.shape) + error_m * wave
    rows = [",".join(f"{v:.9f}" for v in (10.0 * i, *q[i], *points[i])) for i in range(POSES)]
    (folder / "samples.csv").write_text("\n".join(["t_s,q1_rad,q2_rad,x_m,y_m,z_m", *rows]) + "\n", encoding="utf-8")
    return read(folder)


@pytest.mark.parametrize(("error_m", "verdict"), [(ERROR_M, Verdict.UNDECIDABLE), (0.0, Verdict.CONSISTENT)])
def test_residuals_that_neighbours_along_a_way_share_are_left_over(tmp_path, error_m, verdict):
    recording = positioner(tmp_path, error_m)
    found = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1)).physics
    assert found.diagnosis.verdict is verdict
    assert any("in random order" in one.why for one in found.diagnosis.unexplained) == (error_m > 0.0)


def test_errors_of_rows_left_out_are_those_of_the_singular_values_also_where_columns_are_next_to_zero():
    rng = np.random.default_rng(2)
    basis, _ = np.linalg.qr(rng.normal(size=(60, 9)))
    geometry = np.concatenate([basis[:, :4], np.zeros((60, 5)), 1e-20 * rng.normal(size=(60, 1))], axis=1)
    residual, folds = rng.normal(size=60), [np.arange(0, 30), np.arange(30, 60)]
    expected = np.empty(60)
    for fold in folds:
        Q = basis[fold]
        error = residual[fold] + Q @ np.linalg.solve(np.eye(9) - Q.T @ Q, Q.T @ residual[fold])
        U, s, _ = np.linalg.svd(geometry[fold], full_matrices=False)
        expected[fold] = (error - U @ ((1.0 - np.sqrt(1.0 - s**2)) * (U.T @ error))) ** 2
    assert _unseen_squares(basis, residual, folds, geometry) == pytest.approx(expected, rel=1e-6)
