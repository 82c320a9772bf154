"""Another real robot in motion, of seven joints with torque sensors behind their gears: a Franka Emika Panda.

Recorded by C. Gaz, M. Cognetti, A. Oliva, P. Robuffo Giordano, A. De Luca, "Dynamic identification of the Franka Emika
Panda robot with retrieval of feasible parameters using penalty-based optimization", IEEE RA-L 4(4), 2019; their
repository FrankaEmikaPandaDynModel, GPL-3.0, folder matlab/data/Exciting_Traj/Trajectory_1/rbt_log. Of their 21 s the
first 70 % teach, the rest proves. No mass is stated.
"""

import contextlib
import io
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from acquisition.recording import Recording, read
from acquisition.recording.examination import ExaminationRecord
from benchmarks.motion import SEED, friction_of, left_by_least_squares_nm
from calibeam.cli import run
from calibrate.diagnose.motion import reconcile_motion
from calibrate.diagnose.motion.motion_table import motion_of
from calibrate.diagnose.motion.unseen_motion import motion_in_two

# a_m, alpha in right angles, d_m: Franka Emika, Franka Control Interface documentation, in Craig's notation
TABLE = ((0, 0, 0.333), (0, -1, 0), (0, 1, 0.316), (0.0825, 1, 0), (-0.0825, -1, 0.384), (0, 1, 0), (0.088, 1, 0))
RIGHT_RAD = 1.5707963267948966
AUTHORS_NM = (0.54615, 0.87224, 0.64068, 1.2794, 0.83904, 0.30301, 0.56489)  # FI_1: from full speed back to forth
JOINTS = 7
HEAD = "| joint | torque of the end | model of the start | least squares | noise | friction | of the authors |"


def recording_of(folder: Path, out: Path) -> Recording:
    """As the command line imports it from a table. ValueError where it does not."""
    time_s, q, torque = (np.loadtxt(folder / f"exciting_traj_{name}.txt") for name in ("time", "positions", "torques"))
    table, rig, path = out / "panda.csv", out / "rig.toml", out / "panda.mcap"
    names = ["t_s", *(f"q{i}_rad" for i in range(1, JOINTS + 1)), *(f"tau{i}_nm" for i in range(1, JOINTS + 1))]
    rows = np.column_stack([time_s, q.reshape(-1, JOINTS), torque.reshape(-1, JOINTS)])
    np.savetxt(table, rows, delimiter=",", header=",".join(names), comments="", fmt="%.9g")
    joints = [
        f"[[arm.joint]]\na_m = {a}\nalpha_rad = {alpha * RIGHT_RAD}\nd_m = {d}\ntheta_offset_rad = 0.0\n"
        "lower_rad = -3.8\nupper_rad = 3.8\n"
        for a, alpha, d in TABLE
    ]
    rig.write_text('schema = 1\nname = "panda"\n[arm]\nmodel = "mdh"\n' + "\n".join(joints), encoding="utf-8")
    columns = "q1_rad..q7_rad = q, tau1_nm..tau7_nm = tau"
    command = ["import", str(table), "--streams", "--rig", str(rig), "--yes", "--columns", columns, "--out", str(path)]
    with contextlib.redirect_stdout(io.StringIO()):
        refused = run(command)
    if refused:
        raise ValueError(f"{folder}: not imported")
    return read(path)


def lines(folder: Path) -> Iterator[str]:
    """A line a joint; one line that says so where the recording is not there."""
    if not folder.is_dir():
        yield f"skipped: no folder {folder}; give that of the authors' repository, ending in rbt_log"
        return
    with tempfile.TemporaryDirectory() as work:
        recording = recording_of(folder, Path(work))
    found, motion = reconcile_motion(recording, None, np.random.default_rng(SEED)), motion_of(recording)
    if isinstance(found, ExaminationRecord) or isinstance(motion, ExaminationRecord):
        raise ValueError(f"{folder}: no torques in motion")
    plain = left_by_least_squares_nm(recording.rig, *motion_in_two(motion))
    yield found.found.motion.made
    yield HEAD
    yield "|" + "---|" * (HEAD.count("|") - 1)
    for one, left in zip(found.joints, plain.tolist(), strict=True):
        shares = " | ".join(f"{100 * size / one.torque_nm:.1f} %" for size in (one.after_nm, left, one.noise_nm))
        friction, authors = friction_of(found.found, one.joint), AUTHORS_NM[one.joint - 1] / 2.0
        yield f"| {one.joint} | {one.torque_nm:.2f} Nm | {shares} | {friction} | {authors:.3f} Nm |"
