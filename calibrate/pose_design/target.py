"""What has to be right over the workspace: the tool's point where a rig names one, else the beam of its laser, else the
flange's origin; by the unknowns, over poses drawn evenly between the joint limits.

A beam has no point that is its own: its error is that across it, at points where detectors stand. What only moves the
whole workspace rigidly is taken out (calibrate/uncertainty/free_space.py).
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.arms.model import KinematicModel
from calibrate.arms.rig_arm import limits_of
from calibrate.dual_psd_rig import laser_of
from calibrate.parameters import Parameter, index_of
from calibrate.rigid import cross_matrix

Floats = NDArray[np.float64]

POSES = 400  # the mean settles to about 2 %
ALONG_M = (0.08, 0.45)  # of a beam: from the nearest to the farthest detector of a session
TOOL = ("tool.x", "tool.y", "tool.z")


@dataclass(frozen=True)
class Target:
    """Derivatives by all unknowns of a fit, rigid motions taken out."""

    says: str
    by: Floats  # (row, param), over the root of the points: squares add up to the mean square
    by_scale: Floats  # (param,) of the scale of the workspace (no unit)


def target_of(
    rig: Rig, arm: KinematicModel, parameters: tuple[Parameter, ...], start: Floats, rng: Generator
) -> Target:
    """By the `parameters` of a fit, at their values `start`; those of the arm are among them."""
    q = rng.uniform(*limits_of(rig), (POSES, rig.n_joints))
    column = index_of(parameters)
    own = [column[p.name] for p in arm.parameters]
    theta = start[own]
    T, twists = arm.flange(theta, q), arm.twists(theta, q)
    points, across, extra = _points(rig, T, column, start)
    by = np.zeros((len(points), 3, len(column)))
    reps = len(points) // len(q)
    twists = np.tile(twists, (reps, 1, 1))
    by[:, :, own] = twists[:, :3] - cross_matrix(points) @ twists[:, 3:]
    for index, moves in extra.items():
        by[:, :, index] += moves
    return _shaped(_says(rig), points, across @ by, across)


def _says(rig: Rig) -> str:
    if rig.tool.point_m is not None:
        return "the tool's point"
    if rig.tool.laser_origin_m is not None:
        return f"the beam, {ALONG_M[0]:g} and {ALONG_M[1]:g} m in front of the laser, across it"
    return "the flange's origin"


def _points(rig: Rig, T: Floats, column: dict[str, int], start: Floats) -> tuple[Floats, Floats, dict[int, Floats]]:
    """Points (point, 3), projections (point, 3, 3) of what counts, and their motion by unknowns that are no arm's."""
    R, n = T[:, :3, :3], len(T)
    if rig.tool.point_m is not None or rig.tool.laser_origin_m is None:
        point = np.array(rig.tool.point_m or (0.0, 0.0, 0.0))
        tool = {column[name]: R[:, :, i] for i, name in enumerate(TOOL) if name in column}
        return R @ point + T[:, :3, 3], np.broadcast_to(np.eye(3), (n, 3, 3)), tool
    mount = laser_of(rig)
    beam = mount.beam(start[[column[p.name] for p in mount.parameters]], T)
    direction = beam.direction / np.linalg.norm(beam.direction, axis=1, keepdims=True)
    points = np.concatenate([beam.origin_m + s * beam.direction for s in ALONG_M])
    across = np.eye(3) - direction[:, :, None] * direction[:, None, :]
    moves: dict[int, Floats] = {}
    for name, axis in (("u", mount.u), ("v", mount.v)):
        shift = R @ axis
        moves[column[f"laser.shift_{name}"]] = np.tile(shift, (len(ALONG_M), 1))
        moves[column[f"laser.tilt_{name}"]] = np.concatenate([s * shift for s in ALONG_M])
    return points, np.tile(across, (len(ALONG_M), 1, 1)), moves


def _shaped(says: str, points: Floats, by: Floats, across: Floats) -> Target:
    n, _, params = by.shape
    rigid = across @ np.concatenate([np.tile(np.eye(3), (n, 1, 1)), -cross_matrix(points)], axis=2)
    Q = np.linalg.qr(rigid.reshape(3 * n, 6))[0]
    flat = by.reshape(3 * n, params)
    flat = flat - Q @ (Q.T @ flat)
    spread = (across @ (points - points.mean(axis=0))[:, :, None]).ravel()
    spread = spread - Q @ (Q.T @ spread)
    return Target(says, flat / np.sqrt(n), spread @ flat / (spread @ spread))
