"""What the chapters of a session's report share: every reading before and after the fit, from recording and model.

The instruments of a recording are taken as model.json knows them: its rows, its frames and points, its noise, its
values. The spots of a session are for the chapters on rig, faces and centring.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from acquisition.recording import Recording
from acquisition.recording.rig import ArmModel, Rig
from calibrate.apply.export import IdentifiedArm, dh_arm, dh_table_of, identified_arm
from calibrate.errors import DataError
from calibrate.fit.accuracy import spare_readings
from calibrate.fit.fit_plan import DEFAULT, parse_plan
from calibrate.fit.identify.session import instruments_for_fit, rig_as_planned, samples_as_planned, standing_at
from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.noise import VarianceFactors, as_assumed
from calibrate.fit.rank import analyse
from calibrate.fit.solvers import solve
from calibrate.fit.weighting import Weighting
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.chain import KinematicModel
from calibrate.model.dual_psd_rig import dual_psd_chain
from calibrate.model.model_file import NOT_AS_FITTED, ModelFile, not_as_fitted
from calibrate.model.observations import Observations, observations
from calibrate.model.parameters import (
    Parameter,
    index_of,
    start_values,
    without_assumed,
)
from calibrate.model.predict import rig_in_model
from calibrate.model.problem import Measured, Problem
from calibrate.model.sensors import spots
from calibrate.model.sensors.catalogue import kind_of
from calibrate.quantities import angle, length

Floats = NDArray[np.float64]
About = Mapping[str, tuple[float, ...]]


def weighting_of(recording: Recording, model: ModelFile) -> Weighting:
    """What was fitted: rows that no gross error names, about the frames that the corrections are about.

    DataError where recording and model do not belong together.
    """
    samples = recording.samples
    bad = {row - 1 for gross_error in model.blunders for row in gross_error.rows}
    kept = np.array([row for row in range(len(samples)) if row not in bad], dtype=np.intp)
    if len(bad) > len(samples) - len(kept):
        raise _strangers(recording, f"it leaves out row {max(bad) + 1}, but there are {len(samples)}")
    plan = DEFAULT if model.plan is None else parse_plan(model.plan, "fit plan in the model")
    if model.session is not None:  # a diagnosis uses second encoders without being asked to
        plan = structs.replace(plan, instruments=model.instruments)
    rig, some = rig_as_planned(recording.rig, plan), samples_as_planned(samples.take(kept), plan)
    found = standing_at(instruments_for_fit(rig, some, plan).weighting, kept)
    names = tuple(m.name for m in found.measured)
    if names != model.instruments:
        raise _strangers(recording, f"it was fitted to {', '.join(model.instruments)}, here are {', '.join(names)}")
    weighting = replace(found, measured=tuple(_placed(m, model.about) for m in found.measured))
    rows = len(np.unique(np.concatenate([m.sample_rows.ravel() for m in weighting.measured])))
    if rows != model.poses:
        raise _strangers(recording, f"it is of {model.poses} samples, here are {rows}")
    names_here = {p.name for p in weighting.parameters}
    unlike = names_here ^ set(model.chain) if model.session is None else set(model.chain) - names_here
    if unlike:
        raise _strangers(recording, f"one of them alone has the parameters {', '.join(sorted(unlike)[:4])}")
    return weighting


def values_of(weighting: Weighting, model: ModelFile) -> Floats:
    """(param,) the model's values."""
    out = start_values(weighting.parameters)
    for name, column in index_of(weighting.parameters).items():
        out[column] = model.chain.get(name, out[column])  # a diagnosis holds what it names as effects: encoder discs
    return out


def noise_of(weighting: Weighting, model: ModelFile) -> VarianceFactors:
    """Sizes of noise as the model found them, over those assumed."""
    size = np.zeros(len(weighting.sources))
    for i, source in enumerate(weighting.sources):
        found, assumed = model.noise.get(source), model.noise.get(f"{source}_believed")
        if isinstance(found, float) and isinstance(assumed, float) and found > 0.0 and assumed > 0.0:
            size[i] = 2.0 * np.log(found / assumed)
    return replace(as_assumed(len(size)), log_variance=size)


def _placed(measured: Measured, about: About) -> Measured:
    """The instrument with its target, device and seats where the model's corrections start from."""
    problem = measured.problem
    return replace(measured, problem=replace(problem, chain=problem.chain.placed(about)))


def _strangers(recording: Recording, why: str) -> DataError:
    return DataError(
        f"report: the model does not belong to {recording.path.name}: {why}; "
        "give the model of this recording, or identify it again"
    )


Indices = NDArray[np.intp]


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
    not_as_fitted: tuple[str, ...] = ()  # sentences: the model as read misses its session otherwise than its fit

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

    @cached_property
    def calibrated_arm(self) -> IdentifiedArm:
        """The arm as tables have it: an arm of poses by its standard D-H table, another one by its own numbers."""
        model = self.model
        rig = rig_in_model(self.recording.rig, ArmModel(model.arm_model))
        values = {p.name: model.chain.get(p.name, 0.0) for p in arm_of(rig).parameters}
        poses = rig.arm.model is ArmModel.LOCAL_POE
        if not poses or (model.effects and not model.dh_table):
            listed = [p for p in model.parameters if not poses or p.name.startswith("joint")]
            return identified_arm(rig, values, stated=listed, covariance=model.covariance)
        if model.dh_table:
            return dh_arm(rig, values, model.dh_table)
        seen = analyse(self.problem.jacobian(self.theta), without_assumed(self.parameters))
        return dh_arm(rig, values, dh_table_of(rig, model, self.parameters, seen))

    @property
    def left_out(self) -> int:
        """Rows that a gross error names."""
        return len({row for gross_error in self.model.blunders for row in gross_error.rows})


def session_evidence(recording: Recording, model: ModelFile) -> SessionEvidence:
    """DataError where the model was not made from this recording."""
    weighting = weighting_of(recording, model)
    theta = values_of(weighting, model)
    # the nominal arm is beside the readings as they are: an effect's constant part stands against the geometry found
    recorded = weighting.problem(theta, noise_of(weighting, model))
    before = _places_only(recorded, model, theta)
    if model.effects:
        from calibrate.apply.predicting import without_effects  # all effects: identify finds none, and starts sooner

        weighting = without_effects(weighting, theta, recording.samples, model)
    problem = weighting.problem(theta, noise_of(weighting, model)) if model.effects else recorded
    readings = tuple(
        r for i, m in enumerate(weighting.measured) for r in _readings(m, i, (recorded, before), (problem, theta))
    )
    rms = float(np.sqrt(np.mean(readings[0].error_after ** 2)))
    unlike = not_as_fitted(model.instruments[0], model.rms_distance_after_m, rms)
    if unlike and model.made_of(recording.samples) is not True:
        stated = f"it states {length(model.rms_distance_after_m, 4)} rms distance of {model.instruments[0]}"
        raise _strangers(recording, f"{stated}, and misses these rows by {length(rms, 4)}")
    stated = tuple(alarm for alarm in model.alarms if alarm.startswith(NOT_AS_FITTED))
    arm = weighting.measured[0].problem.chain.model
    alarms = stated or tuple(filter(None, [unlike]))
    return SessionEvidence(recording, model, readings, problem.parameters, problem, arm, before, theta, alarms)


def _places_only(problem: JointProblem, model: ModelFile, theta: Floats) -> Floats:
    """(param,) the nominal arm, put where the data want it, with nothing free that the fit had held."""
    arm = {p.name for b in problem.blocks if isinstance(b, Problem) for p in b.chain.model.parameters}
    free = {p.name for p in problem.parameters} if model.covariance is None else set(model.covariance.names)
    parameters = tuple(replace(p, free=p.free and p.name in free - arm) for p in problem.parameters)
    start = np.array([p.start if p.name in arm else v for p, v in zip(parameters, theta.tolist(), strict=True)])
    if not any(p.free for p in parameters):
        return start
    return solve(problem.with_parameters(parameters), start=start).theta


def _readings(
    measured: Measured, index: int, before: tuple[JointProblem, Floats], after: tuple[JointProblem, Floats]
) -> tuple[Readings, ...]:
    """Of one instrument; a problem and its values (param,) each."""
    misfits: list[Floats] = []
    for problem, theta in (before, after):
        block = problem.blocks[index]
        if not isinstance(block, Problem):
            return ()
        misfits.append(block.misfit(problem.of_block(index, theta)))
    old, new = misfits
    whitened = after[0].residual_of(index, after[1]).reshape(new.shape)
    rows, every = measured.sample_rows, kind_of(measured.name).quantities
    return tuple(
        Readings(measured.name, q.name, q.unit, rows, old[:, q.part], new[:, q.part], whitened[:, q.part])
        for q in every
    )


@dataclass(frozen=True)
class SpotSession:
    """Poses with both spots, and what the fit corrects of the rig."""

    recording: Recording
    rig: Rig  # its arm in the model of the fit plan
    data: Observations
    readings: Readings  # of the same poses, in the same order
    corrections: dict[str, float]  # of arm, laser and fixture, by parameter name

    @property
    def places(self) -> tuple[int, ...]:
        """Placements that have poses, rising."""
        return tuple(sorted(set(self.data.placement.tolist())))


def spot_session(evidence: SessionEvidence) -> SpotSession | None:
    """None for a session without spots of the dual PSD."""
    readings = next((r for r in evidence.readings if r.instrument == spots.KIND.name), None)
    if readings is None:
        return None
    recording, model = evidence.recording, evidence.model
    rig = rig_as_planned(recording.rig, DEFAULT if model.plan is None else parse_plan(model.plan, "fit plan"))
    ids = np.array(sorted(rig.placements), dtype=np.int64)
    known = {p.name for p in dual_psd_chain(rig, ids, np.ones_like(ids)).parameters}
    return SpotSession(
        recording,
        rig,
        observations(recording.samples.take(readings.rows[:, 0])),
        readings,
        {name: value for name, value in model.chain.items() if name in known},
    )
