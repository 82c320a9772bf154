"""How far off the target may be anywhere in the workspace, as the covariance of the fit predicts it.

Each pose maps the sigma of the parameters to the target, J C J'. What only moves the whole workspace rigidly (where
base or device stand) is no error of the arm: the best rigid motion is taken out of every column of J before, so that
gauge freedoms do not count, whatever frame was held. A combination that geometry hides and that moves the target
forbids a number; one that these poses merely show too little of is known as well as its plausible size. Sources: law
of propagation, JCGM 100:2008, ch. 5.1.2; gauges of a least-squares network: Triggs, McLauchlan, Hartley, Fitzgibbon,
Bundle Adjustment, LNCS 1883, 2000, ch. 9.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.fit.rank.identifiability import Identifiability
from calibrate.model.arms.serial import point_by_parameter
from calibrate.model.kinematic_model import KinematicModel
from calibrate.model.parameters import Parameter, index_of
from calibrate.model.rigid import cross_matrix

Floats = NDArray[np.float64]

FELT_M = 1e-7  # rms over the workspace, for an unseen combination of plausible size: below, it does not matter
TOOL = ("tool.x", "tool.y", "tool.z")


class Valued(Protocol):
    """Parameters and their values: a fit, or what a model.json holds of one."""

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    @property
    def theta(self) -> Floats: ...


class Covaried(Valued, Protocol):
    """Values with their covariance (param, param)."""

    @property
    def covariance(self) -> Floats: ...


class FreeSpaceStatus(Enum):
    """Whether there is a prediction."""

    PREDICTED = "predicted from the covariance of the fit"
    UNDETERMINED = "an unseen combination moves the target: no error can be stated"
    NO_COVARIANCE = "the fit has no covariance"


@dataclass(frozen=True)
class Workspace:
    """Joint poses drawn evenly within limits, and the target whose place counts."""

    lower_rad: Floats  # (joint,)
    upper_rad: Floats
    point_m: Floats  # (3,) target in the flange frame
    poses: int = 500  # the mean settles to about 2 %


@dataclass(frozen=True)
class Scatter:
    """One sigma of what differs from pose to pose: of every joint reading, and of the target along any axis."""

    joint_rad: float = 0.0
    target_m: float = 0.0


NO_SCATTER = Scatter()


@dataclass(frozen=True)
class FreeSpaceError:
    """One sigma of the target's position (three axes together) over the workspace; None where not determined."""

    status: FreeSpaceStatus
    mean_m: float | None
    p95_m: float | None
    max_m: float | None
    undetermined: tuple[str, ...] = ()  # the combinations that forbid a number, in words
    rms_m: float | None = None
    guessed: tuple[str, ...] = ()  # combinations in it that are known no better than their plausible size, in words


def free_space_error(
    model: KinematicModel,
    fit: Covaried,
    seen: Identifiability,
    workspace: Workspace,
    rng: Generator,
    scatter: Scatter = NO_SCATTER,
) -> FreeSpaceError:
    """Prediction for the arm `model` whose parameters (and those of the tool) are among those of `fit`, by name.

    `seen` is the identifiability at `fit.theta` of all parameters, before anything was held. `scatter`: what a pose
    adds that no correction takes away; without it, the uncertainty of the parameters alone.
    """
    if not np.all(np.isfinite(fit.covariance)):
        return FreeSpaceError(FreeSpaceStatus.NO_COVARIANCE, None, None, None)
    q_rad = rng.uniform(workspace.lower_rad, workspace.upper_rad, (workspace.poses, model.n_joints))
    points_m, by_parameter = target_by_parameter(model, fit, workspace.point_m, q_rad)
    J = without_rigid_motion(points_m, by_parameter)
    column = index_of(fit.parameters)
    unseen = np.sum((J[..., [column[n] for n in seen.names]] @ seen.unseen) ** 2, axis=1)  # (pose, k) m^2
    hidden = sum(c.structural for c in seen.combinations)  # the last k
    felt = np.sqrt(unseen.mean(axis=0)) > FELT_M
    if np.any(felt[len(felt) - hidden :]):
        return FreeSpaceError(FreeSpaceStatus.UNDETERMINED, None, None, None, _words(seen, structural=True))
    guessed = unseen[:, : len(felt) - hidden].sum(axis=1)
    known = np.maximum(np.einsum("nip,pq,niq->n", J, fit.covariance, J, optimize=True), 0.0)
    variance = known + guessed
    if scatter != NO_SCATTER:
        variance = variance + variance_of_scatter(model, fit, points_m, q_rad, scatter)
    sigma = np.sqrt(variance)
    mean, p95, worst = float(sigma.mean()), float(np.percentile(sigma, 95.0)), float(sigma.max())
    rms = float(np.sqrt(np.mean(variance)))
    words = _words(seen, structural=False) if np.any(felt) else ()
    return FreeSpaceError(FreeSpaceStatus.PREDICTED, mean, p95, worst, rms_m=rms, guessed=words)


def _words(seen: Identifiability, *, structural: bool) -> tuple[str, ...]:
    return tuple(c.plain for c in seen.combinations if c.structural is structural)


def without_rigid_motion(points_m: Floats, by_parameter: Floats) -> Floats:
    """(pose, 3, param) the same derivatives less the rigid motion of all points (pose, 3) that fits each best."""
    n, _, params = by_parameter.shape
    rigid = np.concatenate([np.tile(np.eye(3), (n, 1, 1)), -cross_matrix(points_m)], axis=2).reshape(3 * n, 6)
    Q = np.linalg.qr(rigid)[0]
    flat = by_parameter.reshape(3 * n, params)
    return (flat - Q @ (Q.T @ flat)).reshape(n, 3, params)


def variance_of_scatter(
    model: KinematicModel, fit: Valued, points_m: Floats, q_rad: Floats, scatter: Scatter
) -> Floats:
    """(pose,) variance of the target, three axes together."""
    column = index_of(fit.parameters)
    twists = model.joint_twists(fit.theta[[column[p.name] for p in model.parameters]], q_rad)
    by_joint = twists[:, :3] - cross_matrix(points_m) @ twists[:, 3:]
    return scatter.joint_rad**2 * np.sum(by_joint**2, axis=(1, 2)) + 3.0 * scatter.target_m**2


def target_by_parameter(model: KinematicModel, fit: Valued, point_m: Floats, q_rad: Floats) -> tuple[Floats, Floats]:
    """Target in the base (pose, 3) and its derivative by all parameters of the fit (pose, 3, param)."""
    column = index_of(fit.parameters)
    own = [column[p.name] for p in model.parameters]
    theta = fit.theta[own]
    tool = [column[name] for name in TOOL if name in column]
    shift_m = fit.theta[tool] if tool else np.zeros(3)
    out = np.zeros((len(q_rad), 3, len(fit.parameters)))
    points, out[:, :, own] = point_by_parameter(model, theta, point_m + shift_m, q_rad)
    if tool:
        out[:, :, tool] = model.flange(theta, q_rad)[:, :3, :3]
    return points, out
