"""Tool calibration by turning one axis at a time: circles, axis lines, flange, and the tool by distances.

Source: patent CN114523474B, step 3. The circles of the last two joints place the flange, hence a start for the target
in it; the target is then fitted to the distances of point pairs, which need no frame. The arm is taken as drawn.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.arms.model import KinematicModel
from calibrate.fit import Status, solve
from calibrate.identifiability import Identifiability, analyse
from calibrate.parameters import hold
from calibrate.problem import Problem
from calibrate.rigid import inverse
from calibrate.sensors.pair import PairChain
from calibrate.sensors.target import UNKNOWN_PLAUSIBLE_M, Target
from calibrate.sensors.tip_distance import TipDistance
from calibrate.tool_axes.circle import fit_circle
from calibrate.tool_axes.flange_frame import FlangeFrame, flange_frame
from calibrate.tool_axes.segments import Segment, single_axis_segments
from calibrate.tool_axes.wrist import AxisFound, wrist

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

STRIDES = (1, 2, 3, 5, 8, 13)  # partners of each row: near and far ones, without the square of all pairs
SHORTEST_SHARE = 0.05  # of the longest distance: shorter pairs have no direction worth having


@dataclass(frozen=True)
class ToolCalibration:
    """The target in the flange with its doubt, and what it was found from."""

    status: Status
    tool_m: Floats | None  # (3,) in the flange; None where these rotations do not tell it
    tool_sigma_m: Floats | None  # (3,) from the scatter of the distances about the drawn arm
    why: str | None  # why not determined
    by_axes_m: Floats  # (3,) as the axis lines alone say
    flange: FlangeFrame
    axes: tuple[AxisFound, ...]
    identifiability: Identifiability  # of the three coordinates by distances
    distance_rms_m: float


def calibrate_tool(
    arm: KinematicModel, q_rad: Floats, position_m: Floats, file_rows: Indices | None = None
) -> ToolCalibration:
    """From readings (row, joint) and positions (row, 3) in any frame.

    `file_rows` (row,), from 0, says where these rows stand in the file, for errors. DataError without the rotations
    it needs.
    """
    where = np.arange(len(q_rad)) if file_rows is None else file_rows
    axes = tuple(
        AxisFound(s, fit_circle(position_m[s.rows], q_rad[s.rows, s.joint - 1])) for s in single_axis_segments(q_rad)
    )
    before, last = wrist(axes, q_rad, lambda row: int(where[row]) + 1)
    flange = flange_frame(arm, before.circle, last.circle, last.segment.held(q_rad))
    by_axes_m = _seen_from_flange(arm, flange, last.segment, q_rad, position_m)
    rows = np.unique(np.concatenate([axis.segment.rows for axis in axes]))
    return _by_distances(arm, q_rad[rows], position_m[rows], by_axes_m, flange, axes)


def _seen_from_flange(
    arm: KinematicModel, flange: FlangeFrame, segment: Segment, q_rad: Floats, position_m: Floats
) -> Floats:
    """(3,) mean of the target in the flange over the last joint's rotation."""
    theta = np.array([p.start for p in arm.parameters])
    T_base_flange = arm.flange(theta, np.concatenate([flange.q_rad[None], q_rad[segment.rows]]))
    T_device_base = flange.T_device_flange @ inverse(T_base_flange[0])
    T_flange_device = inverse(T_device_base @ T_base_flange[1:])
    seen = np.einsum("nij,nj->ni", T_flange_device[:, :3, :3], position_m[segment.rows]) + T_flange_device[:, :3, 3]
    return seen.mean(axis=0)


def _by_distances(
    arm: KinematicModel,
    q_rad: Floats,
    position_m: Floats,
    start_m: Floats,
    flange: FlangeFrame,
    axes: tuple[AxisFound, ...],
) -> ToolCalibration:
    a, b = _pairs(position_m)
    length_m = np.linalg.norm(position_m[a] - position_m[b], axis=1)[:, None]
    chain = PairChain(arm, TipDistance(Target(start_m, UNKNOWN_PLAUSIBLE_M)))
    parameters = hold(chain.parameters, [p.name for p in arm.parameters])
    size_m = np.sqrt(2.0) * float(np.median([axis.circle.scatter_m for axis in axes]))
    size_m = max(size_m, 1e-12)  # exact data: any weight will do
    weight = np.full((len(a), 1, 1), 1.0 / size_m)
    problem = Problem(chain, parameters, np.concatenate([q_rad[a], q_rad[b]], axis=1), length_m, weight)
    fit = solve(problem)
    scatter = max(fit.chi2_per_dof, 1.0)  # the drawn arm misfits more than the instrument: that is doubt, too
    seen = analyse(problem.jacobian(fit.theta) / np.sqrt(scatter), parameters)
    told = fit.status is Status.CONVERGED and not seen.combinations
    why = None if told else "; ".join(c.says for c in seen.combinations) or fit.status.value
    return ToolCalibration(
        Status.RANK_DEFICIENT if seen.combinations and fit.status is Status.CONVERGED else fit.status,
        start_m + fit.theta[-3:] if told else None,
        np.sqrt(np.diag(_covariance(problem, fit.theta, position_m, a, b))) if told else None,
        why,
        start_m,
        flange,
        axes,
        seen,
        float(np.sqrt(np.mean(problem.misfit(fit.theta) ** 2))),
    )


def _pairs(position_m: Floats) -> tuple[Indices, Indices]:
    n = len(position_m)
    a = np.concatenate([np.arange(n - s) for s in STRIDES if s < n])
    b = np.concatenate([np.arange(s, n) for s in STRIDES if s < n])
    length_m = np.linalg.norm(position_m[a] - position_m[b], axis=1)
    far = length_m > SHORTEST_SHARE * length_m.max()
    return a[far], b[far]


def _covariance(problem: Problem, theta: Floats, position_m: Floats, a: Indices, b: Indices) -> Floats:
    """(3, 3) of the target by equal independent noise of all positions, each of which is in many pairs.

    Its size is that of the misfit, so what the drawn arm misses counts as doubt, too.
    """
    gain = np.linalg.pinv(problem.jacobian(theta)[:, -3:]) * problem.whitener[0, 0, 0]  # (3, pair) d target / d length
    span = position_m[b] - position_m[a]
    along = span / np.linalg.norm(span, axis=1, keepdims=True)
    by_length = gain.T[:, :, None] * along[:, None]  # (pair, 3, 3)
    by_position = np.zeros((len(position_m), 3, 3))
    np.add.at(by_position, b, by_length)
    np.add.at(by_position, a, -by_length)
    degrees = max(len(a) - 3, 1)
    noise_m2 = float(np.sum(problem.misfit(theta) ** 2)) / degrees / 2.0  # a length has the noise of two positions
    return noise_m2 * np.einsum("pij,pkj->ik", by_position, by_position)
