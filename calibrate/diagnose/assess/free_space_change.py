"""What the missing physics does where nobody measures: predicted error over the workspace, before and after.

Before: how far the arm of geometry alone misses the arm of geometry and terms, and the sigma of the latter; after:
that sigma alone (law of propagation, JCGM 100:2008, 5.1.2). A small misfit of the readings can hide a large one of
these, since geometry bends to imitate what is missing. Where base and target frames stand is no error of the arm (and
spots alone do not show it): the best of both is taken out. Poses are drawn evenly between the smallest and largest
angle that each joint had: beyond, a term found from these samples shows nothing.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.diagnose.assess import limits
from calibrate.diagnose.state.fitted import Fitted
from calibrate.model.checks.rough_fit import rough_fit
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Perturbation
from calibrate.model.effects.term import Accepted
from calibrate.model.rigid import cross_matrix
from calibrate.model.with_effects.new_poses import carried_over, extended, moves_tool
from calibrate.model.with_effects.ported_chain import flange_twists, perturbed_frames

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

AT_ONCE = 30  # poses


@dataclass(frozen=True)
class FreeSpaceChange:
    """Rms of the target's error over the poses, three axes together."""

    before_m: float
    after_m: float
    poses: int


def free_space_change(before: Fitted, after: Fitted, rng: Generator) -> FreeSpaceChange | None:
    """Of geometry alone and with terms, of one session. None where a term cannot be evaluated at other poses."""
    session, n_arm = after.session, len(after.session.arm.parameters)
    measured = session.samples.joints()
    q_rad = rng.uniform(measured.min(axis=0), measured.max(axis=0), (limits.WORKSPACE_POSES, measured.shape[1]))
    like = rng.integers(len(measured), size=limits.WORKSPACE_POSES)
    nothing = Perturbation.none(limits.WORKSPACE_POSES, measured.shape[1])
    frames = perturbed_frames(session.arm, after.geometry[:n_arm], q_rad, nothing)
    by, slopes, columns = nothing, list[Floats](), list[int]()
    for i, accepted in enumerate(after.accepted):
        if not moves_tool(accepted.term):
            continue
        basis = _moved_by(accepted, after.drivers, q_rad, frames, like)
        if basis is None:
            return None
        by = by.plus(accepted.term.port, basis @ accepted.coefficients)
        slopes.append(flange_twists(frames, accepted.term.port, basis))
        columns += np.flatnonzero(after.problem.owner == i)[: basis.shape[-1]].tolist()
    arm = session.arm.twists(after.geometry[:n_arm], q_rad)
    truth = perturbed_frames(session.arm, after.geometry[:n_arm], q_rad, by)[:, -1]
    alone = perturbed_frames(session.arm, before.geometry[:n_arm], q_rad, nothing)[:, -1]
    point_m = _target_m(after)
    # At the poses of the twists: frames that are unknown would else be taken out a little askew, and they are far off.
    variance = _variance(
        after, frames[:, -1], point_m, np.concatenate([arm, *slopes], axis=2), [*range(n_arm), *columns]
    )
    missed = _missed(alone, truth, point_m)
    return FreeSpaceChange(float(np.sqrt(missed + variance)), float(np.sqrt(variance)), limits.WORKSPACE_POSES)


def _moved_by(accepted: Accepted, drivers: Drivers, q_rad: Floats, frames: Floats, like: Ints) -> Floats | None:
    """(pose, width, coefficient) what a term adds at the poses, some at a time; None: it has no value there."""
    copies = max(1, int(np.ceil(limits.POSES_FOR_ONE_NEW * AT_ONCE / len(drivers.q_rad))))
    parts: list[Floats] = []
    for i in range(0, len(like), AT_ONCE):
        some = slice(i, i + AT_ONCE)
        basis = carried_over(accepted, drivers, extended(drivers, q_rad[some], frames[some], like[some], copies))
        if basis is None:
            return None
        parts.append(basis[-len(like[some]) :])
    return np.concatenate(parts)


def _target_m(state: Fitted) -> Floats:
    """(3,) in the flange frame: the probe, else the laser, else the flange itself."""
    tool = state.session.rig.tool
    drawn = tool.point_m if tool.point_m is not None else tool.laser_origin_m
    return np.zeros(3) if drawn is None else np.array(drawn)


def _variance(state: Fitted, T_base_flange: Floats, point_m: Floats, twists: Floats, columns: list[int]) -> float:
    """Mean square of the target's uncertainty over the poses, three axes together."""
    points = _at(T_base_flange, point_m)
    slope = twists[:, :3] - cross_matrix(points) @ twists[:, 3:]
    flat = _without_frames(T_base_flange, points, slope.reshape(-1, slope.shape[-1]))
    covariance = state.covariance[np.ix_(columns, columns)]
    return max(float(np.einsum("np,pq,nq->", flat, covariance, flat, optimize=True)) / len(points), 0.0)


def _missed(a: Floats, b: Floats, point_m: Floats) -> float:
    """Mean square distance between the targets of two arms with the best of frames of each."""
    wanted = _at(b, point_m)
    near = rough_fit(a, wanted, point_m)
    moved = _at(a, near.point_m) @ near.linear.T + near.shift_m
    left = _without_frames(b, wanted, (moved - wanted).reshape(-1, 1))
    return float(np.sum(left**2)) / len(b)


def _at(T_base_flange: Floats, point_m: Floats) -> Floats:
    return T_base_flange[:, :3, :3] @ point_m + T_base_flange[:, :3, 3]


def _without_frames(T_base_flange: Floats, points: Floats, columns: Floats) -> Floats:
    """Columns (3 pose, m) without what base and target frame can take up, to first order."""
    free = np.concatenate(
        [np.tile(np.eye(3), (len(points), 1, 1)), -cross_matrix(points), T_base_flange[:, :3, :3]], axis=2
    )
    U, size, _ = np.linalg.svd(free.reshape(-1, 9), full_matrices=False)
    basis = U[:, size > 1e-9 * size[0]]
    return columns - basis @ (basis.T @ columns)
