"""Statistics of a finished fit: chi-square tests of the noise, likelihood, and the degrees of freedom that are left.

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

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr, chdtrc, fdtrc

from calibrate.fit.solvers import Fit
from calibrate.model.problem import Block, LeastSquares

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ALARM_P = 1e-3  # a false alarm in a thousand good sets a side


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
