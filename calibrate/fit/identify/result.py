"""An identified arm with everything that must travel with it.

Whether a session holds any length at all: without one the size of the arm is not measured, whatever the fit gives.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.accuracy import Alarm, FreeSpaceError, PoseScatter, RepeatNoise, StatedNoise
from calibrate.fit.held_out.held_out import Bootstrap
from calibrate.fit.identify.estimates import Estimate, JointZero, joint_zeros
from calibrate.fit.identify.point_constraint import PointConstraints
from calibrate.fit.rank.identifiability import Identifiability
from calibrate.fit.rank.observability import Observability
from calibrate.fit.solvers import (
    LossKind,
    Method,
    Status,
    Stop,
)
from calibrate.model.checks.gross_error import GrossError
from calibrate.model.parameters import Parameter
from calibrate.model.sensors.catalogue import kind_of, names_with
from calibrate.model.sensors.kind import Trait

Floats = NDArray[np.float64]

POSE, POSITION = 6, 3  # values of a reading: x, y, z (m), then a turn (rad), which does not add to a length

SCALELESS = set(names_with(Trait.SCALELESS))  # cones: an arm half as large would sit in cones half as far apart


@dataclass(frozen=True)
class Noise:
    """One source of noise: one sigma as assumed, as the residuals show, and how well they show it."""

    source: str  # "position", "wire", ...; "joint" is shared by all instruments, rad
    assumed: float
    found: float
    sigma: float
    at_zero: bool = False  # too small to be separated from none: `found` is no size, only small


@dataclass(frozen=True)
class InstrumentFound:
    """One instrument in the fit. A distance is the length of an observation's misfit (3-D error of a position)."""

    name: str
    observations: int
    rms_distance_before_m: float  # arm nominal, places and target refitted
    rms_distance_after_m: float
    rows: NDArray[np.intp]  # (obs, m) of the samples, from 0
    misfit: Floats  # (obs, k) expected minus observed, after

    @property
    def coordinates(self) -> int:
        """That make up a distance: of a pose those of its position."""
        return len(range(self.misfit.shape[1])[kind_of(self.name).quantities[0].part])

    @property
    def rms_coordinate_before_m(self) -> float:
        """The same of single coordinates."""
        return self.rms_distance_before_m / sqrt(self.coordinates)

    @property
    def rms_coordinate_after_m(self) -> float:
        return self.rms_distance_after_m / sqrt(self.coordinates)


@dataclass(frozen=True)
class HeldOutError:
    """Error of one instrument on observations that the fit has not seen; distances as in InstrumentFound."""

    name: str
    split: str
    observations: int
    rms_distance_before_m: float
    rms_distance_after_m: float
    chi_after: float  # rms of the prediction error over the noise, all instruments together
    chi_predicted: float  # the same over noise and sigma of the fit together: near 1, however far the rows lie off


@dataclass(frozen=True)
class Proven:
    """Errors of every instrument under every split, and why a split proves nothing."""

    held_out: tuple[HeldOutError, ...] = ()
    unproven: tuple[str, ...] = ()


@dataclass(frozen=True)
class FreeSpace:
    """Error of the target anywhere: poses drawn evenly between the joint limits."""

    geometry: FreeSpaceError  # the uncertainty of the parameters alone: what the next calibration could take away
    pose: FreeSpaceError  # with the scatter of a single pose: what a user meets
    scatter: PoseScatter
    scatter_says: str  # what the scatter is made of
    poses: int
    point_m: tuple[float, float, float]  # the target in the flange frame


@dataclass(frozen=True)
class Evidence:
    """What is proved or predicted of a fit; None where the fit came to no end, or where it was not asked for."""

    proven: Proven
    observability: Observability | None
    free_space: FreeSpace | None
    bootstrap: Bootstrap | None


@dataclass(frozen=True)
class FitEnd:
    """How the fit was made and what ended it."""

    method: Method
    loss: LossKind
    iterations: int  # of all rounds of fit and weights
    stop: Stop  # the rule that ended the last round
    minus_2_log_likelihood: float  # of the readings under the noise found; nan where it is not finite


@dataclass(frozen=True)
class Identification:
    """Outcome of the identification of an arm by any instruments."""

    status: Status
    blunders: tuple[GrossError, ...]  # their rows took no part
    estimates: tuple[Estimate, ...]  # of all parameters, in order
    identifiability: Identifiability
    instruments: tuple[InstrumentFound, ...]
    noise: tuple[Noise, ...]
    noise_settled: bool  # False: the sizes of the noise did not converge, and every sigma is a guess
    stated_noise: StatedNoise  # chi-square under the noise as assumed
    repeats: RepeatNoise | None  # of the first instrument that repeated poses
    evidence: Evidence
    parameters: tuple[Parameter, ...]
    theta: Floats  # (param,) predicts; alone, an entry that is not determined means nothing
    covariance: Floats  # (param, param) posterior; rows of held parameters are zero
    about: dict[str, tuple[float, ...]]  # frames and points found in closed form, that `theta` corrects
    n_samples: int  # rows that took part
    end: FitEnd
    software: str
    known_lengths: int = 0  # that the rig states between points of the session
    point_constraints: PointConstraints | None = None  # the method beside the fit, where the plan asks for it

    @property
    def zeros(self) -> tuple[JointZero, ...]:
        """Joint zeros; none where the arm has no such parameters."""
        return joint_zeros(self.estimates, self.parameters, self.covariance)

    @property
    def held_out(self) -> tuple[HeldOutError, ...]:
        """One an instrument and split; empty with too few observations."""
        return self.evidence.proven.held_out

    @property
    def alarms(self) -> tuple[str, ...]:
        """Sentences about noise and model that a person must read before the numbers; none where all agrees."""
        return alarms_of(self.stated_noise, self.repeats) + scale_alarms(
            (i.name for i in self.instruments), self.known_lengths
        )


def alarms_of(stated: StatedNoise, repeats: RepeatNoise | None) -> tuple[str, ...]:
    """What chi-square shows against the noise as stated, and the misfit against the scatter of repeats."""
    out: list[str] = []
    if stated.alarm in (Alarm.ABOVE_STATED, Alarm.BELOW_STATED):
        out.append(f"{stated.alarm.value} (scatter {stated.noise_factor:.3g} times the stated noise)")
    elif stated.alarm is Alarm.NO_REDUNDANCY:
        out.append(stated.alarm.value)
    if repeats is not None and repeats.alarm is Alarm.LACK_OF_FIT:
        out.append(f"{repeats.alarm.value} (F = {repeats.ratio:.3g} over {repeats.groups} repeated poses)")
    return tuple(out)


def scale_alarms(instruments: Iterable[str], known_lengths: int = 0) -> tuple[str, ...]:
    """A sentence for a session of cones and planes alone; none where any instrument measures a length, or one is known.

    A factor on all lengths of arm, seats and planes leaves every distance at zero: contact alone cannot fix scale.
    """
    used = set(instruments)
    if not used or not used <= SCALELESS or known_lengths:
        return ()
    touched = " and ".join(kind_of(name).noun for name in sorted(used, reverse=True))
    return (
        f"{touched} alone determine no length: the size of the arm stays nominal, and every length that it "
        "measures is as uncertain as that; measure a bar of known length ([[bar]], columns bar and bar_end) as well, "
        'or state the distance of two cones or parallel planes ([[known_distance]] of = "seat" or "plane")',
    )
