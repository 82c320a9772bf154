"""An identified arm with everything that must travel with it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.blunders.finding import Blunder
from calibrate.fit import Status
from calibrate.identifiability import Identifiability
from calibrate.parameters import Parameter
from calibrate.uncertainty.chi_square import RepeatNoise, StatedNoise
from calibrate.zeros.result import Estimate

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Noise:
    """One source of noise: one sigma as believed, as the residuals say, and how well they say it."""

    source: str  # "position", "wire", ...; "joint" is shared by all instruments, rad
    believed: float
    found: float
    sigma: float


@dataclass(frozen=True)
class InstrumentFound:
    """One instrument in the fit. An rms is over observations, of the length of the misfit (3-D error of a position)."""

    name: str
    observations: int
    rms_before: float  # arm nominal, places and target refitted
    rms_after: float
    rows: NDArray[np.intp]  # (obs, m) of the samples, from 0
    misfit: Floats  # (obs, k) expected minus observed, after


@dataclass(frozen=True)
class Unseen:
    """Error of one instrument on observations that the fit has not seen; rms as in InstrumentFound."""

    name: str
    split: str
    observations: int
    rms_before: float
    rms_after: float
    chi_after: float  # rms of the whitened prediction error of all instruments together, near 1


@dataclass(frozen=True)
class Identification:
    """Outcome of the identification of an arm by any instruments."""

    status: Status
    blunders: tuple[Blunder, ...]  # their rows took no part
    estimates: tuple[Estimate, ...]  # of all parameters, in order
    identifiability: Identifiability
    instruments: tuple[InstrumentFound, ...]
    noise: tuple[Noise, ...]
    stated_noise: StatedNoise  # chi-square under the noise as believed
    repeats: RepeatNoise | None  # of the first instrument that repeated poses
    held_out: tuple[Unseen, ...]  # one an instrument; empty with too few observations
    parameters: tuple[Parameter, ...]
    theta: Floats  # (param,) predicts; alone, an entry that is not determined means nothing
    covariance: Floats  # (param, param) posterior; rows of held parameters are zero
    about: dict[str, tuple[float, ...]]  # frames and points found in closed form, that `theta` corrects
    n_samples: int  # rows that took part
    steps: int
    software: str
