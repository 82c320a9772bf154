"""Errors of the target over the workspace, nominal and calibrated, where the data support a statement.

The nominal error is the distance between both arms, the best rigid motion between them left out, with the uncertainty
of the calibrated one; the calibrated error is that uncertainty alone, J C J' (law of propagation, JCGM 100:2008,
5.1.2), with the scatter of a single pose. A pose is supported where no joint is beyond the angles that it had in the
session, and where the prediction leans on the data no harder than at the poses of the session: beyond the largest
leverage of the data lies hidden extrapolation (Montgomery, Peck, Vining, Introduction to Linear Regression Analysis,
5th ed. 2012, ch. 3.8). The outermost hundredth of the session at either end does not count: a lone pose far off
supports nothing.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from calibrate.arms.model import KinematicModel
from calibrate.blunders.rough_fit import frame_between
from calibrate.identifiability import Identifiability
from calibrate.model_file import Covariance, Fields, FreeSpaceRecord
from calibrate.parameters import Parameter, index_of
from calibrate.rigid import cross_matrix
from calibrate.sensors.catalogue import LENGTHS
from calibrate.uncertainty.free_space import FreeSpaceStatus, Scatter, target_by_parameter, variance_of_scatter

Floats = NDArray[np.float64]

JOINT = "joint"


@dataclass(frozen=True)
class KnownArm:
    """A `Valued` (uncertainty/free_space.py) whose values are those that were found."""

    arm: KinematicModel
    parameters: tuple[Parameter, ...]  # of the whole fit; those of the arm are among them by name
    drawn: Floats  # (param,) nominal arm, frames and target where they fit best
    theta: Floats  # (param,) as identified
    covariance: Floats  # (param, param), zero for what was held
    seen: Identifiability
    scatter: Scatter  # of a single pose
    point_m: Floats  # (3,) the target in the flange frame, that the corrections of tool are about
    lower_rad: Floats  # (joint,) limits
    upper_rad: Floats
    q_rad: Floats  # (row, joint) of the samples that took part


def unpredicted(room: FreeSpaceRecord | None) -> str | None:
    """Why errors over the workspace cannot be determined, by the prediction in the model; None where they can."""
    if room is None:
        return "the model holds no prediction: it has no covariance, or is of an older program"
    if room.status == FreeSpaceStatus.PREDICTED.name:
        return None
    return f"{room.says} ({'; '.join(room.undetermined)})" if room.undetermined else room.says


def scatter_of(noise: Fields) -> Scatter:
    """Of a single pose, from the noise found: of the joints, else of the instrument, in which that of the arm is."""
    found = {name: value for name, value in noise.items() if isinstance(value, float)}
    if JOINT in found:
        return Scatter(joint_rad=found[JOINT])
    return Scatter(target_m=max(found.get(source, 0.0) for source in LENGTHS))


def whole_covariance(record: Covariance | None, parameters: tuple[Parameter, ...]) -> Floats:
    """(param, param) the covariance of a model.json among all parameters; NaN where there is none.

    What the file holds of effects is left out: these are parameters of the geometry.
    """
    if record is None:
        return np.full((len(parameters), len(parameters)), np.nan)
    column = index_of(parameters)
    out = np.zeros((len(parameters), len(parameters)))
    known = [k for k, name in enumerate(record.names) if name in column]
    own = [column[record.names[k]] for k in known]
    out[np.ix_(own, own)] = np.array(record.rows)[np.ix_(known, known)]
    return out


Bools = NDArray[np.bool_]

POSES_LOG2 = 12  # drawn within the angles of the session: some eight a cell
REACH_LOG2 = 14  # within the limits, for the outline alone
ROUNDING = 1e-9  # of the largest leverage
OUTERMOST = 0.01  # of the poses, at either end


@dataclass(frozen=True)
class Room:
    """Poses drawn evenly between the angles of the session, and where the joint limits would let the arm go."""

    q_rad: Floats  # (pose, joint)
    points_m: Floats  # (pose, 3) of the target in the base, as identified
    supported: Bools  # (pose,)
    drawn_m: Floats  # (pose,) error of the nominal arm, one sigma, three axes together
    found_m: Floats  # (pose,) as identified
    reach_m: Floats  # (pose, 3) of the target at poses between the limits
    session_m: Floats  # (row, 3) of the target at the poses of the session


def room_of(known: KnownArm) -> Room:
    """The same poses every time: a Sobol' sequence."""
    sequence = qmc.Sobol(known.arm.n_joints, scramble=False).random_base2(REACH_LOG2)
    session = known.q_rad
    q_rad = between(sequence[: 2**POSES_LOG2], *np.quantile(session, (OUTERMOST, 1.0 - OUTERMOST), axis=0))
    points, slopes = target_by_parameter(known.arm, known, known.point_m, q_rad)
    rigid = np.asarray(np.linalg.lstsq(_rigid(points), slopes.reshape(-1, slopes.shape[-1]), rcond=None)[0], float)
    here = _variance(known, points, slopes, rigid)
    at_session, session_slopes = target_by_parameter(known.arm, known, known.point_m, session)
    leverage = float(np.quantile(_variance(known, at_session, session_slopes, rigid), 1.0 - OUTERMOST))
    variance = here + variance_of_scatter(known.arm, known, points, q_rad, known.scatter)
    return Room(
        q_rad,
        points,
        here <= (1.0 + ROUNDING) * leverage,
        np.sqrt(_apart(known, points, q_rad) ** 2 + variance),
        np.sqrt(variance),
        target_at(known, known.theta, between(sequence, known.lower_rad, known.upper_rad)),
        at_session,
    )


def between(sequence: Floats, lower: Floats, upper: Floats) -> Floats:
    """(pose, joint) numbers of the unit cube between limits (joint,), which may be equal."""
    return lower + sequence * (upper - lower)


def target_at(known: KnownArm, theta: Floats, q_rad: Floats) -> Floats:
    """(pose, 3) the target in the base for values (param,)."""
    column = index_of(known.parameters)
    own = [column[p.name] for p in known.arm.parameters]
    tool = [theta[column[name]] if name in column else 0.0 for name in ("tool.x", "tool.y", "tool.z")]
    T = known.arm.flange(theta[own], q_rad)
    return T[:, :3, :3] @ (known.point_m + np.array(tool)) + T[:, :3, 3]


def _rigid(points_m: Floats) -> Floats:
    """(3 pose, 6) what a motion of everything does to the points."""
    shift = np.broadcast_to(np.eye(3), (len(points_m), 3, 3))
    return np.concatenate([shift, -cross_matrix(points_m)], axis=2).reshape(-1, 6)


def _variance(known: KnownArm, points_m: Floats, slopes: Floats, rigid: Floats) -> Floats:
    """(pose,) of the target, three axes together: the covariance, and what is guessed for want of data."""
    J = slopes - (_rigid(points_m) @ rigid).reshape(slopes.shape)
    seen, column = known.seen, index_of(known.parameters)
    guessed = np.sum((J[..., [column[name] for name in seen.names]] @ seen.unseen) ** 2, axis=(1, 2))
    sure = np.einsum("nip,pq,niq->n", J, known.covariance, J, optimize=True)
    return np.maximum(sure, 0.0) + guessed


def _apart(known: KnownArm, points_m: Floats, q_rad: Floats) -> Floats:
    """(pose,) distance between the nominal and the calibrated arm, best put on each other."""
    as_drawn = target_at(known, known.drawn, q_rad)
    linear, shift = frame_between(as_drawn, points_m, np.ones(len(points_m)))
    return np.linalg.norm(as_drawn @ linear.T + shift - points_m, axis=1)
