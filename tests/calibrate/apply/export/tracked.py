"""A shipped rig before a tracker, turned joint by joint from the numbers of its file, with hidden offsets."""

import csv
import tomllib

import numpy as np
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import parse_rig, rig_text
from calibeam.commands.rig import shipped_rigs

TARGET_M = (0.06, 0.03, 0.05)  # beside the last axis
SIGMA_M = 20e-6
HIDDEN_DEG = np.array([0.11, -0.08, 0.13, 0.05, -0.20, 0.09])  # true reading less the controller's


def tracked(folder, name, *, lengths_m=0.0, rows=60, seed=1):
    """Session folder of the arm `name`; `lengths_m`: scatter of its joints' origins, and of their axes in rad.

    Beside it stands axes.npy, (joint, 2, 3) a point of every axis and its direction with all readings at zero.
    """
    text, rng = rig_text(shipped_rigs()[name]), np.random.default_rng(seed)
    arm, joints = tomllib.loads(text)["arm"], parse_rig(text, name).arm.joints
    ends = np.array([(j.lower_rad, j.upper_rad) for j in joints])
    q = rng.uniform(0.7 * ends[:, 0], 0.7 * ends[:, 1], (rows, len(joints)))
    real, sense = q + np.radians(HIDDEN_DEG), [joint.get("sign", 1) for joint in arm["joint"]]
    real = np.concatenate([real, np.radians(HIDDEN_DEG)[None]])
    T, axes = np.tile(np.eye(4), (rows + 1, 1, 1)), []
    for i, joint in enumerate(arm["joint"]):
        follows = joint.get("follows", {"joint": 1, "by": 0.0})
        turn = sense[i] * (real[:, i] + follows["by"] * real[:, follows["joint"] - 1])
        T = T @ _pose(np.array(joint["origin_m"]) + rng.normal(0.0, lengths_m, 3), joint["rotation_rad"])
        T = T @ _pose(np.zeros(3), rng.normal(0.0, lengths_m, 3))
        axes.append((T[-1, :3, 3], sense[i] * T[-1, :3, 2]))
        T[:, :3, :3] = T[:, :3, :3] @ Rotation.from_rotvec(turn[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    T = T[:-1] @ _pose(arm["flange"]["origin_m"], arm["flange"]["rotation_rad"])
    seen = Rotation.from_rotvec([0.0, 0.1, 2.0]).apply(T[:, :3, 3] + T[:, :3, :3] @ TARGET_M)
    seen += np.array([1.0, 2.0, 0.5]) + rng.normal(0.0, SIGMA_M, seen.shape)
    folder.mkdir(parents=True)
    np.save(folder.parent / "axes.npy", axes)
    (folder / "rig.toml").write_text(text.replace("point_m = [0.0, 0.0, 0.05]", f"point_m = {list(TARGET_M)}"))
    with (folder / "samples.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["t_s", *(f"q{i}_rad" for i in range(1, len(joints) + 1)), "x_m", "y_m", "z_m"])
        writer.writerows([t, *row.tolist(), *at.tolist()] for t, (row, at) in enumerate(zip(q, seen, strict=True)))
    return folder


def _pose(origin_m, rotation_rad):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec(rotation_rad).as_matrix(), origin_m
    return T
