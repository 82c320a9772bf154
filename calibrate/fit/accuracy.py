"""How good a fit is: chi-square against stated noise and repeats, and the error of the tool over the workspace.

Error over the workspace, as the covariance of the fit predicts it: each pose maps the sigma of the parameters to the
target, J C J'. What only moves the whole workspace rigidly (where base or device stand) is no error of the arm: the
best rigid motion is taken out of every column of J before, so that gauge freedoms do not count, whatever frame was
held. A combination that geometry hides and that moves the target forbids a number; one that these poses merely show too
little of is known as well as its plausible size. Sources: law of propagation, JCGM 100:2008, ch. 5.1.2; gauges of a
least-squares network: Triggs, McLauchlan, Hartley, Fitzgibbon, Bundle Adjustment, LNCS 1883, 2000, ch. 9.

Chi-square compares the scatter with the stated noise, and the misfit with the scatter of repeats. Prior rows count as
rows, which holds where the truth is drawn from the priors. Sources: Pearson's chi-square; Draper, Smith, Applied
Regression Analysis, 3rd ed. 1998, ch. 2.1 (pure error, lack of fit).

-2 ln L = r'r + ln det C + m ln 2 pi for m readings in m or rad with misfit covariance C, and whitened misfit r. Rows of
priors are not part of it. Values compare between fits of the same readings.

Spare readings are the readings less the sum of their leverages, m - tr(J C J'). Without priors this is equations less
unknowns. A prior takes part of an unknown off the readings, so that rows of [tolerance] are not counted as if somebody
had measured them. Sources: Hoaglin, Welsch, Am. Stat. 32(1), 1978 (leverage); Ye, J. Am. Stat. Assoc. 93, 1998
(degrees of freedom).
"""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.special import chdtr, chdtrc, fdtrc

from calibrate.fit.rank.identifiability import Identifiability
from calibrate.fit.solvers import Fit
from calibrate.model.arms.serial import point_by_parameter
from calibrate.model.chain import KinematicModel
from calibrate.model.parameters import Parameter, index_of
from calibrate.model.problem import Block, LeastSquares
from calibrate.model.rigid import cross_matrix

Floats = NDArray[np.float64]
FELT_M = 1e-7  # rms over the workspace, for an unseen combination of plausible size: below, it does not matter
TOOL = ("tool.x", "tool.y", "tool.z")
Ints = NDArray[np.int64]
ALARM_P = 1e-3  # a false alarm in a thousand good sets a side


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
class PoseScatter:
    """One sigma of what differs from pose to pose: of every joint reading, and of the target along any axis."""

    joint_rad: float = 0.0
    target_m: float = 0.0


NO_SCATTER = PoseScatter()


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
    scatter: PoseScatter = NO_SCATTER,
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
    model: KinematicModel, fit: Valued, points_m: Floats, q_rad: Floats, scatter: PoseScatter
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


class Alarm(Enum):
    """The result of a test; the value is the sentence for a person."""

    NONE = "scatter and noise agree"
    ABOVE_STATED = "misfit is larger than the stated noise: the noise is understated or the model misses something"
    BELOW_STATED = "misfit is smaller than the stated noise: the noise is overstated, and every sigma with it"
    LACK_OF_FIT = "misfit stays the same where poses repeat: the model misses something that is not noise"
    NO_REDUNDANCY = "as many unknowns as rows: nothing checks the noise"


@dataclass(frozen=True)
class StatedNoise:
    """Chi-square of a fit under the noise that was stated."""

    chi2: float
    dof: int
    p_above: float  # probability of more than chi2 if model and noise are right; nan without redundancy
    alarm: Alarm

    @property
    def noise_factor(self) -> float:
        """By what the stated sigmas would have to be multiplied for chi-square to be its mean."""
        return float(np.sqrt(self.chi2 / self.dof)) if self.dof > 0 else float("nan")


@dataclass(frozen=True)
class RepeatNoise:
    """Scatter within repeats of a pose, and how much larger the misfit of the poses is."""

    groups: int
    dof: int  # of the scatter
    chi2_per_dof: float  # of the scatter under the stated noise
    ratio: float  # F: misfit that repeats over scatter
    p_above: float  # probability of more than the ratio from scatter alone
    alarm: Alarm


def against_stated(chi2: float, dof: int) -> StatedNoise:
    """Chi-square of the whole fit; `ABOVE_STATED` or `BELOW_STATED` beyond one in a thousand."""
    if dof <= 0:
        return StatedNoise(chi2, dof, float("nan"), Alarm.NO_REDUNDANCY)
    above = float(chdtrc(dof, chi2))
    below = float(chdtr(dof, chi2))
    alarm = Alarm.ABOVE_STATED if above < ALARM_P else Alarm.BELOW_STATED if below < ALARM_P else Alarm.NONE
    return StatedNoise(chi2, dof, above, alarm)


def against_repeats(fit: Fit, residual: Floats, repeat: Ints) -> RepeatNoise | None:
    """Lack of fit from whitened residuals (row, k) after the fit; `repeat` (row,) names the group, below 0 none.

    None where no group has two rows. The misfit is taken after the model, so that poses that repeat only nearly do not
    count as scatter.
    """
    found = [residual[repeat == g] for g in np.unique(repeat[repeat >= 0])]
    groups = [rows - rows.mean(axis=0) for rows in found if len(rows) >= 2]
    if not groups:
        return None
    scatter = float(sum(np.sum(rows**2) for rows in groups))
    free = sum(residual.shape[1] * (len(rows) - 1) for rows in groups)
    rest = fit.dof - free
    if rest <= 0 or scatter <= 0.0:
        return RepeatNoise(len(groups), free, scatter / free, float("nan"), float("nan"), Alarm.NO_REDUNDANCY)
    ratio = max(fit.chi2 - scatter, 0.0) / rest / (scatter / free)
    above = float(fdtrc(rest, free, ratio))
    alarm = Alarm.LACK_OF_FIT if above < ALARM_P else Alarm.NONE
    return RepeatNoise(len(groups), free, scatter / free, ratio, above, alarm)


def minus_2_log_likelihood(problem: Block, theta: Floats) -> float:
    """At theta (param,); nan where it is not finite."""
    residual = problem.residual(theta)
    value = float(residual @ residual) + problem.log_det_noise + len(residual) * float(np.log(2.0 * np.pi))
    return value if np.isfinite(value) else float("nan")


# Below, 95 % of the scatters that belong to one noise span a factor of four (chi-square of 5: 0.83 to 12.8): the
# residuals can neither show noise nor a wrong model.
FEWEST_SPARE = 5.0


def spare_readings(problem: LeastSquares, theta: Floats, covariance: Floats) -> float:
    """Of a fit that ended at theta (param,) with this posterior (param, param); nan where it does not exist."""
    slope = problem.jacobian(theta)
    free = np.flatnonzero(np.diag(covariance) > 0.0)
    if not np.all(np.isfinite(covariance)):
        return float("nan")
    return float(len(slope) - np.sum((slope[:, free] @ covariance[np.ix_(free, free)]) * slope[:, free]))


def checks_nothing(spare: float) -> bool:
    """Whether nothing worth mentioning is left over."""
    return spare < FEWEST_SPARE
