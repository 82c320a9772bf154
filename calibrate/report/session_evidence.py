"""What the chapters of a session's report share: every reading before and after the fit, from recording and model."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording
from calibrate.arms.model import KinematicModel
from calibrate.errors import DataError
from calibrate.fit import solve
from calibrate.joint_problem import JointProblem
from calibrate.model_file import ModelFile
from calibrate.parameters import Parameter
from calibrate.problem import Problem
from calibrate.report.as_modelled import noise_of, values_of, weighting_of
from calibrate.report.quantities import angle, length
from calibrate.sensors.catalogue import kind_of
from calibrate.uncertainty.fit_statistics import spare_readings
from calibrate.weighting import Weighting

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

SAME = 1e-3  # of the rms in the model: beyond, the readings are not those that were fitted


@dataclass(frozen=True)
class Readings:
    """One quantity of one instrument, expected minus observed."""

    instrument: str
    quantity: str  # "orientation", or "" where the instrument reads one quantity only
    unit: str  # "m" or "rad"
    rows: Indices  # (obs, m) of the samples, from 0: two where an observation is made of two poses
    before: Floats  # (obs, k) nominal arm, places and target where they fit best
    after: Floats  # (obs, k)
    whitened: Floats  # (obs, k) after, in units of the noise found

    @property
    def title(self) -> str:
        said = kind_of(self.instrument).title
        return f"{said}, {self.quantity}" if self.quantity else said

    @property
    def name(self) -> str:
        """For the ids of the page."""
        return f"{self.instrument}-{self.quantity}" if self.quantity else self.instrument

    @property
    def error_before(self) -> Floats:
        """(obs,) length of the misfit: the 3-D error of a position."""
        return np.linalg.norm(self.before, axis=1)

    @property
    def error_after(self) -> Floats:
        return np.linalg.norm(self.after, axis=1)

    def says(self, value: float, digits: int = 3) -> str:
        """A number in this unit for a person."""
        return length(value, digits) if self.unit == "m" else angle(value, digits)


@dataclass(frozen=True)
class SessionEvidence:
    """A recording, its model, and what belongs to both."""

    recording: Recording
    model: ModelFile
    readings: tuple[Readings, ...]
    parameters: tuple[Parameter, ...]
    problem: JointProblem  # weighted by the noise found
    arm: KinematicModel
    drawn: Floats  # (param,) the nominal arm, frames and target where they fit best
    theta: Floats  # (param,) as identified

    @cached_property
    def rows(self) -> Indices:
        """Rows of the samples that took part, from 0."""
        return np.unique(np.concatenate([r.rows.ravel() for r in self.readings]))

    @property
    def q_rad(self) -> Floats:
        """(row, joint) of the samples that took part."""
        return self.recording.samples.joints()[self.rows]

    @cached_property
    def spare(self) -> float:
        """Readings that are left over to check the fit; nan where the model has no covariance."""
        if self.model.session is not None:  # its covariance is of the noise that the diagnosis found, not of `problem`
            return float(sum(r.after.size for r in self.readings) - self.model.rank)
        found, names = self.model.covariance, [p.name for p in self.parameters]
        if found is None or not set(found.names) <= set(names):
            return float("nan")
        at = [names.index(name) for name in found.names]
        covariance = np.zeros((len(names), len(names)))
        covariance[np.ix_(at, at)] = found.rows
        return spare_readings(self.problem, self.theta, covariance)

    @property
    def left_out(self) -> int:
        """Rows that a blunder names."""
        return len({row for blunder in self.model.blunders for row in blunder.rows})


def session_evidence(recording: Recording, model: ModelFile) -> SessionEvidence:
    """DataError where the model was not made from this recording."""
    weighting = weighting_of(recording, model)
    theta = values_of(weighting, model)
    if model.effects:
        from calibrate.physics.applied import without_effects  # all effects: identify finds none, and starts sooner

        weighting = without_effects(weighting, theta, recording.samples, model)
    problem = weighting.problem(theta, noise_of(weighting, model))
    before = _places_only(weighting, problem, model, theta)
    readings = tuple(r for i in range(len(weighting.measured)) for r in _readings(weighting, problem, i, before, theta))
    rms = float(np.sqrt(np.mean(readings[0].error_after ** 2)))
    if abs(rms - model.rms_distance_after_m) > SAME * model.rms_distance_after_m + 1e-12:
        raise DataError(
            f"report: the model has {length(model.rms_distance_after_m)} rms distance, but misses the "
            f"{model.instruments[0]} rows of "
            f"{recording.path.name} by {length(rms)}; give the model of this recording, or identify it again"
        )
    arm = weighting.measured[0].problem.chain.model
    return SessionEvidence(recording, model, readings, problem.parameters, problem, arm, before, theta)


def _places_only(weighting: Weighting, problem: JointProblem, model: ModelFile, theta: Floats) -> Floats:
    """(param,) the nominal arm, put where the data want it, with nothing free that the fit had held."""
    arm = {p.name for m in weighting.measured for p in m.problem.chain.model.parameters}
    free = {p.name for p in problem.parameters} if model.covariance is None else set(model.covariance.names)
    parameters = tuple(replace(p, free=p.free and p.name in free - arm) for p in problem.parameters)
    start = np.array([p.start if p.name in arm else v for p, v in zip(parameters, theta.tolist(), strict=True)])
    if not any(p.free for p in parameters):
        return start
    return solve(problem.with_parameters(parameters), start=start).theta


def _readings(
    weighting: Weighting, problem: JointProblem, index: int, before: Floats, after: Floats
) -> tuple[Readings, ...]:
    measured, block = weighting.measured[index], problem.blocks[index]
    if not isinstance(block, Problem):
        return ()
    old, new = (block.misfit(problem.of_block(index, theta)) for theta in (before, after))
    whitened = problem.residual_of(index, after).reshape(new.shape)
    rows, every = measured.sample_rows, kind_of(measured.name).quantities
    return tuple(
        Readings(measured.name, q.name, q.unit, rows, old[:, q.part], new[:, q.part], whitened[:, q.part])
        for q in every
    )
