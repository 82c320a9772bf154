"""Identified joint zeros with everything that must travel with them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.fit import Status, Stop
from calibrate.identifiability import Identifiability
from calibrate.parameters import Parameter

Floats = NDArray[np.float64]


ONLY_BELIEVED = "only its prior speaks of it"
UNSTATED = "assumed for want of a [tolerance]"
HELD = "held so that a combination has an answer; see the combinations"


@dataclass(frozen=True)
class Estimate:
    """One parameter: a value with its doubt, or the reason why there is none (then both numbers are None)."""

    name: str
    unit: str
    value: float | None
    sigma: float | None  # one sigma; widened where the noise itself is poorly known, so that 3 sigma keeps its odds
    why: str | None  # why not determined


@dataclass(frozen=True)
class JointZero:
    """Zero of one joint: true angle = reading + value."""

    joint: int  # counted from 1
    value_rad: float | None
    sigma_rad: float | None
    measurement_sigma_rad: float | None  # what would remain of sigma if links and bracket were exactly as now believed
    why: str | None  # why not determined


@dataclass(frozen=True)
class NoiseFound:
    """Noise as believed and as the residuals say."""

    joint_believed_rad: float
    joint_rad: float
    joint_sigma_rad: float
    psd_believed_m: float  # median over poses where each has its own
    psd_m: float
    psd_sigma_m: float
    chi2_per_dof_believed: float  # under the believed noise; far from 1: noise or model is not as believed
    chi2_per_dof: float  # under the noise found; near 1 by construction
    converged: bool
    joint_at_zero: bool = False  # so small that it cannot be told from none: the number is no size, only small
    psd_at_zero: bool = False


@dataclass(frozen=True)
class Repeats:
    """Scatter within repeated poses, after the model, under the noise found. None of it can be blamed on geometry."""

    groups: int
    dof: int
    chi2_per_dof: float
    lack_of_fit: float  # F: misfit that repeats, over scatter of repeats
    lack_of_fit_p: float  # probability of such an F from noise alone; small: physics is missing from the model


@dataclass(frozen=True)
class HeldOut:
    """Error on poses that the fit has not seen; `split` says how they were chosen."""

    split: str
    poses: int
    rms_before_m: float  # zeros and links nominal, placements and laser mount refitted
    rms_after_m: float
    chi_after: float  # rms of the whitened prediction error, near 1 (with the doubt of the fit on top)


@dataclass(frozen=True)
class ZeroResult:
    """Outcome of the full dual-PSD identification."""

    status: Status
    zeros: tuple[JointZero, ...]
    estimates: tuple[Estimate, ...]  # of all parameters, in order
    identifiability: Identifiability
    noise: NoiseFound
    repeats: Repeats | None
    held_out: HeldOut | None
    rms_before_m: float
    rms_after_m: float
    residual_before_m: Floats  # (pose, 4) expected minus observed
    residual_after_m: Floats  # (pose, 4)
    parameters: tuple[Parameter, ...]
    theta: Floats  # (param,) predicts; alone, an entry that is not determined means nothing
    covariance: Floats  # (param, param) posterior; rows of held parameters are zero
    n_poses: int
    spare: float  # readings that are left over to check the fit (uncertainty/redundancy.py); nan: not known
    steps: int
    stop: Stop  # the rule that ended the last round
    software: str  # "calibeam 0.1.0"
