"""What is assumed of the arm's own errors before its wrist is measured, and where that comes from.

A wrist that turns about its last two axes does not show the zero of the last joint, nor where the flange sits along and
across the last axis: they only add to the target's place. So their uncertainty is an input, and it is stated.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.model.arms.link_tolerance import LinkTolerance
from calibrate.model.chain import KinematicModel
from calibrate.model.model_file import ModelFile
from calibrate.model.parameters import Parameter, index_of, start_values
from calibrate.model.problem import whitener_of

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

# An uncalibrated industrial arm (ABB IRB 1600) misses orientations by up to 2.8 mrad and positions by up to 0.65 mm:
# Slamani, Nubiola, Bonev, Industrial Robot 39(1), 2012. One sigma of a joint zero is taken as large as that
# orientation error, of a length as half of that position error, of an angle between two axes as 1 mrad.
ZERO_SIGMA_RAD = 3e-3
LENGTH_SIGMA_M = 3e-4
ANGLE_SIGMA_RAD = 1e-3
DEFAULT = "default of an uncalibrated arm"


@dataclass(frozen=True)
class ArmErrors:
    """One sigma of an arm's own errors, independent of each other; 0 takes them as exact."""

    zero_sigma_rad: float = ZERO_SIGMA_RAD
    length_sigma_m: float = LENGTH_SIGMA_M
    angle_sigma_rad: float = ANGLE_SIGMA_RAD
    source: str = DEFAULT  # for a person: whose statement they are

    def __post_init__(self) -> None:
        for name in ("zero_sigma_rad", "length_sigma_m", "angle_sigma_rad"):
            value = getattr(self, name)
            if not 0.0 <= value < float("inf"):
                raise DataError(
                    f"errors of the arm: {name} {value} is no sigma; give a finite number that is not negative"
                )

    @property
    def links(self) -> LinkTolerance:
        """Of the links, to build the arm with."""
        return LinkTolerance(self.length_sigma_m, self.angle_sigma_rad)


@dataclass(frozen=True)
class ArmPrior:
    """A normal law of an arm's parameters; those that are not in `columns` are exact."""

    mean: Floats  # (param,) of the arm
    columns: Indices  # (k,) of the uncertain ones
    covariance: Floats  # (k, k)
    fit_rms_m: float = 0.0  # what the calibrated arm of a model file leaves at its own readings; 0: none is known

    def scaled(self, factor: float) -> "ArmPrior":
        """The same with every sigma `factor` times as large."""
        return replace(self, covariance=self.covariance * factor**2)


def assumed_prior(arm: KinematicModel, zero_sigma_rad: float = ZERO_SIGMA_RAD) -> ArmPrior:
    """Independent errors: of the links as the arm was built with, of every joint zero `zero_sigma_rad`.

    A sigma of zero takes a parameter as exact.
    """
    sigma = np.array([_sigma(p, zero_sigma_rad) for p in arm.parameters])
    columns = np.flatnonzero(sigma > 0.0)
    return ArmPrior(start_values(arm.parameters), columns, np.diag(sigma[columns] ** 2))


def prior_of_model(arm: KinematicModel, model: ModelFile, assumed: ArmPrior) -> ArmPrior:
    """A calibrated arm: its values, and its covariance for what it determines; the rest keeps the assumed sigma."""
    names = tuple(p.name for p in arm.parameters)
    mean = np.array([model.chain.get(name, p.start) for name, p in zip(names, arm.parameters, strict=True)])
    full = np.zeros((len(names), len(names)))
    full[np.ix_(assumed.columns, assumed.columns)] = assumed.covariance
    if model.covariance is not None:
        determined = {p.name for p in model.parameters if p.value is not None}
        place = index_of(arm.parameters)
        found = [(i, place[n]) for i, n in enumerate(model.covariance.names) if n in determined and n in place]
        own, put = [i for i, _ in found], [k for _, k in found]
        full[put, :], full[:, put] = 0.0, 0.0
        full[np.ix_(put, put)] = np.array(model.covariance.rows)[np.ix_(own, own)]
    columns = np.flatnonzero(np.diag(full) > 0.0)
    return ArmPrior(mean, columns, full[np.ix_(columns, columns)], model.rms_distance_after_m)


@dataclass(frozen=True)
class PriorRows:
    """The prior as a block of a joint problem: whitened deviations of the arm's uncertain parameters from the mean."""

    parameters: tuple[Parameter, ...]  # (k,)
    mean: Floats  # (k,)
    whitener: Floats  # (k, k)

    @classmethod
    def of(cls, prior: ArmPrior, parameters: tuple[Parameter, ...]) -> "PriorRows":
        """`parameters` of the whole arm, as the joint problem has them."""
        chosen = tuple(parameters[i] for i in prior.columns)
        return cls(chosen, prior.mean[prior.columns], whitener_of(prior.covariance))

    @property
    def rows(self) -> int:
        return len(self.parameters)

    @property
    def log_det_noise(self) -> float:
        """Logarithm of the determinant of the prior's covariance."""
        return -float(np.linalg.slogdet(self.whitener @ self.whitener.T)[1])

    def residual(self, theta: Floats) -> Floats:
        return self.whitener @ (theta - self.mean)

    def jacobian(self, theta: Floats) -> Floats:
        return self.whitener

    def select(self, rows: Indices) -> "PriorRows":
        """Some of the rows."""
        return replace(self, whitener=self.whitener[rows])


def free_parameters(arm: KinematicModel, prior: ArmPrior) -> tuple[Parameter, ...]:
    """The arm's parameters at the prior's mean, free where it leaves them open; its rows carry the prior itself."""
    open_ = set(prior.columns.tolist())
    return tuple(
        replace(p, start=float(value), prior=float("inf"), free=i in open_)
        for i, (p, value) in enumerate(zip(arm.parameters, prior.mean, strict=True))
    )


def _sigma(parameter: Parameter, zero_sigma_rad: float) -> float:
    if parameter.name.endswith(".zero"):
        return zero_sigma_rad
    if not parameter.free:
        return 0.0
    return min(parameter.prior, parameter.plausible)
