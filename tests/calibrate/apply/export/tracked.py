"""A shipped rig before a tracker, turned joint by joint from the numbers of its file, with hidden offsets.

An elastic arm yields at every joint under a weight at its flange.
"""

import csv
import tomllib

import numpy as np
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import parse_rig, rig_text
from calibeam.commands.rig import shipped_rigs

TARGET_M = (0.06, 0.03, 0.05)  # beside the last axis
SIGMA_M = 20e-6
LOAD_N = np.array([0.0, 0.0, -98.1])  # at the flange
HIDDEN_DEG = np.array([0.11, -0.08, 0.13, 0.05, -0.20, 0.09])  # true reading less the controller's


def tracked(folder, name, *, lengths_m=0.0, rows=60, seed=1, yields_rad_nm=0.0):
    """Session folder of the arm `name`; `lengths_m`: scatter of its joints' origins, and of their axes in rad;
    `yields_rad_nm`: by which each joint yields under LOAD_N.

    Beside it stands axes.npy, (joint, 2, 3) a point of every axis and its direction with all readings at zero.
    """
    text, rng = rig_text(shipped_rigs()[name]), np.random.default_rng(seed)
    arm, joints = tomllib.loads(text)["arm"], parse_rig(text, name).arm.joints
    hidden = np.radians(np.resize(HIDDEN_DEG, len(joints)))
    ends = np.array([(j.lower_rad, j.upper_rad) for j in joints])
    q = rng.uniform(0.7 * ends[:, 0], 0.7 * ends[:, 1], (rows, len(joints)))
    real, sense = q + hidden, [joint.get("sign", 1) for joint in arm["joint"]]
    real = np.concatenate([real, hidden[None]])
    turns = np.empty_like(real)
    for i, joint in enumerate(arm["joint"]):
        follows = joint.get("follows", {"joint": 1, "by": 0.0})
        turns[:, i] = sense[i] * (real[:, i] + follows["by"] * real[:, follows["joint"] - 1])
    fixed, flange = [], _pose(*(arm.get("flange", {}).get(k, [0.0] * 3) for k in ("origin_m", "rotation_rad")))
    for part in _parts(arm, joints):
        part[:3, 3] += rng.normal(0.0, lengths_m, 3)
        fixed.append(part @ _pose(np.zeros(3), rng.normal(0.0, lengths_m, 3)))
    flange = fixed.pop() @ flange if len(fixed) > len(joints) else flange
    T, frames = _turned(fixed, flange, turns)
    axes = [(B[-1, :3, 3], s * B[-1, :3, 2]) for B, s in zip(frames, sense, strict=True)]
    if yields_rad_nm:
        moments = [np.cross(T[:, :3, 3] - B[:, :3, 3], LOAD_N) for B in frames]
        torques = [np.einsum("nj,nj->n", B[:, :3, 2], moment) for B, moment in zip(frames, moments, strict=True)]
        T, _ = _turned(fixed, flange, turns + yields_rad_nm * np.stack(torques, axis=1))
    T = T[:-1]
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


def with_discs(folder, eccentricity_rad, seed=1):
    """The same session with encoder discs off centre, which the rig file leaves open to an identification."""
    table, rng = folder / "samples.csv", np.random.default_rng(seed)
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    columns = [name for name in rows[0] if name.startswith("q")]
    sizes = rng.normal(0.0, eccentricity_rad, (len(columns), 2))
    for row in rows:
        for name, (sine, cosine) in zip(columns, sizes.tolist(), strict=True):
            q = float(row[name])
            row[name] = q + sine * np.sin(q) + cosine * np.cos(q)
    with table.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    with (folder / "rig.toml").open("a") as file:
        file.write("\n[tolerance]\nlength_m = 1e-3\nangle_rad = 2e-3\neccentricity_rad = 1e-3\n")
    return folder


def _parts(arm, joints):
    """(4, 4) in front of each joint; of a Denavit-Hartenberg table also the one behind the last."""
    if arm["model"] == "local-poe":
        return [_pose(joint["origin_m"], joint["rotation_rad"]) for joint in arm["joint"]]
    none = [np.eye(4)]
    along_x = [_pose([j.a_m, 0.0, 0.0], [j.alpha_rad, 0.0, 0.0]) for j in joints]
    along_z = [_pose([0.0, 0.0, j.d_m], [0.0, 0.0, 0.0]) for j in joints]
    turned = [*(_pose([0.0, 0.0, 0.0], [0.0, 0.0, j.theta_offset_rad or 0.0]) for j in joints), np.eye(4)]
    if arm["model"] == "mdh":
        return [a @ b @ c for a, b, c in zip(none + along_z, along_x + none, turned, strict=True)]
    return [a @ b @ c for a, b, c in zip(none + along_z, none + along_x, turned, strict=True)]


def _turned(fixed, flange, turns):
    """Flange (pose, 4, 4) and the frame that each joint turns in, for turns (pose, joint)."""
    T, frames = np.tile(np.eye(4), (len(turns), 1, 1)), []
    for part, turn in zip(fixed, turns.T, strict=True):
        T = T @ part
        frames.append(T.copy())
        T[:, :3, :3] = T[:, :3, :3] @ Rotation.from_rotvec(turn[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    return T @ flange, frames


def _pose(origin_m, rotation_rad):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec(rotation_rad).as_matrix(), origin_m
    return T
