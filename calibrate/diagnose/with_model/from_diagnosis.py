"""A diagnosis as model.json, schema 2: geometry refitted together with the effects that were found."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np
from msgspec import structs
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.special import chdtr, chdtri

from acquisition.recording import Recording, Samples, readings_sha256
from acquisition.recording.rig import ArmModel, rig_sha256
from acquisition.recording.samples import measured_sha256
from calibrate.apply.export import dh_table_of
from calibrate.apply.predicting import as_fitted
from calibrate.diagnose.assess.diagnosis import Diagnosis, Finding
from calibrate.diagnose.from_recording import Diagnosed
from calibrate.diagnose.gross_errors import Cleared
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.noise_law import curvature_of
from calibrate.diagnose.search.stated_sizes import sizes_of
from calibrate.diagnose.state.fitted import Fitted
from calibrate.diagnose.state.noise_of_fit import freedom
from calibrate.diagnose.with_model.effect_of_term import effect_names, effect_of_term, finding_of, number_or_none
from calibrate.errors import DataError
from calibrate.fit.accuracy import against_stated
from calibrate.fit.fit_plan import LossName, SolverName
from calibrate.fit.held_out import beyond_sigma
from calibrate.fit.identify.fit_report import sizes_of_noise
from calibrate.fit.identify.record import left_out, noise_fields
from calibrate.fit.identify.result import POSE, POSITION, alarms_of
from calibrate.fit.identify.session import NEGLIGIBLE_RAD, about_of, joints_apart
from calibrate.fit.noise import SEPARABLE, VarianceFactors
from calibrate.fit.rank import Identifiability, analyse
from calibrate.fit.solvers import Status, Stop
from calibrate.fit.weighting import JOINT, Weighting
from calibrate.model.effect_records import (
    EffectRecord,
    SessionRecord,
)
from calibrate.model.effects.fixture_moved import CARRIED
from calibrate.model.effects.ports import Perturbation
from calibrate.model.effects.term import Shape
from calibrate.model.effects.time_laws import FOR_A_WHILE
from calibrate.model.model_file import (
    WITH_PHYSICS,
    Fields,
    FitRecord,
    ModelFile,
    ModelParameter,
    RigIdentity,
    UnseenRecord,
    covariance_record,
)
from calibrate.model.parameters import (
    Parameter,
    plausible_sizes,
    priors,
    without_assumed,
)
from calibrate.model.predict import Predictor
from calibrate.model.problem import whitener_of
from calibrate.model.sensors.catalogue import kind_of
from calibrate.model.sensors.kind import Trait
from calibrate.model.with_effects.acting import drivers_under, listed
from calibrate.model.with_effects.applied import kept_conditions, needed_columns, recorded_conditions
from calibrate.model.with_effects.new_poses import NEARLY, alike

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

SOFTWARE = f"calibeam {version('calibeam')}"
CUT = 0.99
LEAST_CURVED = 0.1  # of a t law: with more outlying rows than good ones nothing is known
LEAST_VARIANCE = 1e-6  # of the assumed one, of a source that is not there
SAME_VARIANCE = 1e-3  # of itself, 0.05 % of a sigma
TURNS = 30
AXES = 3  # of a position


def model_of_diagnosis(found: Diagnosed, recording: Recording) -> ModelFile:
    """The record to write. DataError where the file is wrong as a whole, or an effect cannot be carried."""
    if found.physics is None:
        raise DataError("no model: no cause was sought; diagnosis.json states why")
    if found.physics.model.problem.assumed is not None:
        raise DataError(
            "no model: beside a model of another recording a diagnosis fits changes only; `calibeam identify --model` "
            "refits that model to this recording"
        )
    fit, findings = found.physics.model, found.physics.diagnosis.findings
    says = "geometry and effects fitted together by the diagnosis"
    model = model_of_fit(fit, found.physics.geometry, found.cleared, recording, says, findings)
    return structs.replace(model, left_m=_left_m(found.physics.diagnosis, model))


def _left_m(diagnosis: Diagnosis, model: ModelFile) -> float:
    """By the splits of the proof; what a fit of so many values adds to the noise on rows like its own is no fault."""
    floors = {floor.instrument: floor.rms_m for floor in diagnosis.floors}
    grown = np.sqrt(1.0 + model.rank / (AXES * model.poses))
    return beyond_sigma(
        [
            (AXES * held.observations, held.rms_after_m, float(grown) * floors[held.instrument])
            for held in diagnosis.proofs
            if Trait.IN_SPACE in kind_of(held.instrument).traits and floors.get(held.instrument)
        ]
    )


def model_of_fit(
    fit: Fitted, before: Fitted, cleared: Cleared, recording: Recording, says: str, findings: tuple[Finding, ...] = ()
) -> ModelFile:
    """Geometry and effects fitted together; `before`: geometry alone; `says`: if it converged. DataError as above."""
    fit = replace(fit, problem=replace(fit.problem, given=0))
    names = effect_names(fit.accepted)
    parameters, covariance = _parameters(fit, names), _covariance(fit)
    seen = _seen(fit, names)
    (conditions, needs), (noise, alarms) = _conditions(fit), _noise(fit, seen.rank)
    status = _status(fit, seen)
    model = ModelFile(
        schema=WITH_PHYSICS,
        kind="calibeam-model",
        software=SOFTWARE,
        rig=RigIdentity(recording.rig.name, rig_sha256(recording.rig_text), recording.rig_text),
        arm_model=recording.rig.arm.model.value,
        status=status.name,
        says=says if status is Status.CONVERGED else status.value,
        poses=fit.samples,
        rank=seen.rank,
        free=seen.n_free,
        condition=seen.condition if np.isfinite(seen.condition) else None,
        singular_values=tuple(seen.singular_values.tolist()),
        unseen=tuple(UnseenRecord(c.words, c.members, c.structural) for c in seen.combinations),
        parameters=_records(fit, covariance, seen),
        chain={p.name: float(v) for p, v in zip(fit.session.parameters, fit.geometry, strict=True)},
        covariance=covariance_record(parameters, covariance),
        noise=noise,
        repeats=None,
        held_out=None,
        **_rms(before, "before"),
        **_rms(fit, "after"),
        instruments=tuple(m.name for m in fit.session.measured),
        about=about_of(fit.session.weighting),
        blunders=tuple(left_out(b) for b in cleared.blunders),
        alarms=alarms,
        readings_sha256=readings_sha256(recording.samples),
        measured_sha256=measured_sha256(recording.samples),
        fit=_fit_record(fit),
        effects=_effects(fit, findings, names, covariance),
        needs=needs,
        session=SessionRecord(
            started_utc=recording.started_utc,
            first_t_s=float(fit.drivers.t_s.min()),
            last_t_s=float(fit.drivers.t_s.max()),
            readings_sha256=readings_sha256(recording.samples),
            conditions={c: tuple(map(number_or_none, v.tolist())) for c, v in conditions.items()},
        ),
    )
    model = _as_listed(model, fit, parameters, covariance, conditions)
    if recording.rig.arm.model is ArmModel.LOCAL_POE:
        model = structs.replace(model, dh_table=dh_table_of(recording.rig, model, parameters, seen))
    return as_fitted(model, fit.session.samples, list(_misfits(fit)))


def _misfits(fit: Fitted) -> Iterator[tuple[str, Ints, Floats]]:
    """Of each instrument whose readings follow one sample each: name, samples (reading,), observed less expected."""
    for i, (m, rows) in enumerate(zip(fit.session.measured, fit.problem.rows, strict=True)):
        if m.sample_rows.shape[1] == 1:
            yield m.name, m.sample_rows[rows, 0], m.problem.observed[rows] - fit.around.expected[i][rows]


def _status(fit: Fitted, seen: Identifiability) -> Status:
    """As the solver gives it for the same ends."""
    if fit.stop is Stop.ROUNDS:
        return Status.OUT_OF_STEPS
    return Status.RANK_DEFICIENT if seen.combinations else Status.CONVERGED


def _fit_record(fit: Fitted) -> FitRecord:
    """Diagnosis has one estimator: Student's t with the noise found, by Levenberg and Marquardt."""
    value = float(sum(s.minus_two_log_likelihood for s in fit.scatters))
    return FitRecord(
        SolverName.LEVENBERG.value,
        LossName.STUDENT_T.value,
        fit.steps,
        fit.stop.name,
        fit.stop.value,
        number_or_none(value),
        LossName.STUDENT_T.value,
    )


def _parameters(fit: Fitted, names: tuple[str, ...]) -> tuple[Parameter, ...]:
    """Those of the fit, of effects under the names of the file."""
    n, out = len(fit.session.parameters), list(fit.session.parameters)
    for p, owner in zip(fit.problem.parameters[n:], fit.problem.owner[n:].tolist(), strict=True):
        _, _, value = p.name.partition(".")
        out.append(replace(p, name=f"{names[owner]}.{value}"))
    return tuple(out)


def _covariance(fit: Fitted) -> Floats:
    """(value, value) posterior, by derivatives at the very values of the model.

    Where base and fixture stand together, or a joint's zero beside what is mounted on it, is held by wide priors only.
    A prediction is free of that as far as its derivative is that of the covariance: none that were kept from values
    nearby serve here (1e-5 of them, and metres of such a combination are not known).
    """
    parameters = fit.problem.parameters
    free, scale, prior = np.flatnonzero([p.free for p in parameters]), plausible_sizes(parameters), priors(parameters)
    slope = fit.problem.forgetting().jacobian(fit.values)[:, free] * scale[free]
    prior_rows = np.diag(np.where(np.isfinite(prior[free]), scale[free] / prior[free], 0.0))
    _, s, Vt = np.linalg.svd(np.concatenate([slope, prior_rows]), full_matrices=False)
    root = scale[free, None] * Vt.T / s
    out = np.zeros((len(parameters), len(parameters)))
    out[np.ix_(free, free)] = root @ root.T / max(curvature_of(fit.rows), LEAST_CURVED)
    return out


def _seen(fit: Fitted, names: tuple[str, ...]) -> Identifiability:
    """By the data and the priors that somebody stated."""
    n = len(fit.session.parameters)
    asked = (*without_assumed(fit.session.weighting.parameters), *_parameters(fit, names)[n:])
    return analyse(fit.problem.jacobian(fit.values), asked)


def _records(fit: Fitted, covariance: Floats, seen: Identifiability) -> tuple[ModelParameter, ...]:
    """Of geometry; effects have their own sizes."""
    out: list[ModelParameter] = []
    for i, (p, value) in enumerate(zip(fit.session.parameters, fit.geometry, strict=True)):
        if p.free:
            why, sigma = seen.reason(p.name), float(np.sqrt(covariance[i, i]))
            shown = why is None
            out.append(ModelParameter(p.name, p.unit, float(value) if shown else None, sigma if shown else None, why))
    return tuple(out)


def _conditions(fit: Fitted) -> tuple[dict[str, Floats], tuple[str, ...]]:
    every = recorded_conditions(fit.drivers, fit.session.samples)
    needs = needed_columns((d for a in fit.accepted for d in ",".join(a.term.depends_on).split(",")), every)
    return kept_conditions(every, needs), needs


def _effects(
    fit: Fitted, findings: tuple[Finding, ...], names: tuple[str, ...], covariance: Floats
) -> tuple[EffectRecord, ...]:
    out, bench = list[EffectRecord](), Bench(fit)
    for i, (a, name) in enumerate(zip(fit.accepted, names, strict=True)):
        mine, finding = np.flatnonzero(fit.problem.owner == i), finding_of(a, findings)
        sizes = sizes_of(bench, i) if finding is None and not a.term.open else None
        out.append(effect_of_term(a, name, finding, fit.drivers, covariance[np.ix_(mine, mine)], sizes))
    lasting = (e for e in out if e.shape == Shape.STEP.value and not e.variant.endswith((CARRIED, FOR_A_WHILE)))
    return (*out, *map(_aftermath, lasting))


def _aftermath(effect: EffectRecord) -> EffectRecord:
    """What a slip or a bump leaves: from the end of its session on it is true of the machine."""
    return structs.replace(
        effect,
        name=f"{effect.name}-left",
        depends_on="",
        shape=Shape.CONSTANT.value,
        parameters={k: p for k, p in effect.parameters.items() if k not in effect.inner},
        holds="always",
        range={},
        curve=None,
        after=effect.name,
    )


def _noise(fit: Fitted, rank: int) -> tuple[Fields, tuple[str, ...]]:
    """As of an identification, and one sigma of a reading by column, joints included, at the middle row; alarms."""
    out: Fields = {}
    covariances = _normal_covariances(fit)
    for m, covariance in zip(fit.session.measured, covariances, strict=True):
        sigma = np.sqrt(np.median(np.diagonal(covariance, axis1=1, axis2=2), axis=0))
        names = kind_of(m.name).reads or m.problem.chain.sensor.own_columns() or (m.name,)
        out |= {name: float(s) for name, s in zip(names, sigma, strict=True)}
    weighting = joints_apart(fit.session.weighting)
    parts = _assumed_parts(fit, weighting)
    found = sizes_of_noise(weighting, _factors(parts, covariances, settled=fit.stop is not Stop.ROUNDS))
    under = fit.problem.under(tuple(whitener_of(part.sum(axis=0)) for part in parts))
    away = [
        (value - p.start) / p.prior
        for p, value in zip(without_assumed(weighting.parameters), fit.geometry.tolist(), strict=True)
        if p.free and np.isfinite(p.prior)
    ]
    misfit = np.concatenate([under.residual(fit.values), away])
    stated = against_stated(float(misfit @ misfit), len(misfit) - rank)
    return out | noise_fields(found, stated, settled=fit.stop is not Stop.ROUNDS), alarms_of(stated, None)


def _normal_covariances(fit: Fitted) -> list[Floats]:
    """Of each instrument (row, k, k) noise of a reading by the normal law, joints included."""
    out: list[Floats] = []
    larger = freedom(fit.problem, fit.values, fit.covariance)
    for i, (m, scatter) in enumerate(zip(fit.session.measured, fit.noise.whole(fit.problem.rows), strict=True)):
        misfit = m.problem.observed[fit.problem.rows[i]] - fit.around.expected[i][fit.problem.rows[i]]
        white = np.linalg.solve(np.linalg.cholesky(scatter.covariance), misfit[..., None])[..., 0]
        out.append(larger[i] * _normal_size(np.sum(white**2, axis=1), misfit.shape[1]) * scatter.covariance)
    return out


def _assumed_parts(fit: Fitted, weighting: Weighting) -> list[Floats]:
    """Of each instrument (source, row, k, k) covariance as assumed, by every source of the weighting."""
    joint_rad = weighting.joint_rad if weighting.joint_rad > NEGLIGIBLE_RAD else 0.0
    out: list[Floats] = []
    for i, (m, rows) in enumerate(zip(weighting.measured, fit.problem.rows, strict=True)):
        own = m.select(rows).parts(weighting.unweighted.of_block(i, fit.geometry), joint_rad)
        every = np.zeros((len(weighting.sources), *own.shape[1:]))
        every[[weighting.sources.index(source) for source in (JOINT, *m.own_sigma)]] = own
        out.append(every)
    return out


def _factors(parts: list[Floats], covariances: list[Floats], *, settled: bool) -> VarianceFactors:
    """Sizes of the sources of which normal readings of these covariances would be most likely, by Fisher's scoring."""
    factor, sigma, last = np.ones(len(parts[0])), np.zeros(len(parts[0])), covariances
    for _ in range(TURNS):
        columns, aims, before = list[Floats](), list[Floats](), factor
        for part, covariance, V in zip(parts, covariances, last, strict=True):
            W = whitener_of(V)
            columns.append((W @ part @ np.swapaxes(W, 1, 2)).reshape(len(part), -1))
            aims.append((W @ covariance @ np.swapaxes(W, 1, 2)).ravel())
        A = np.concatenate(columns, axis=1).T
        size = np.maximum(np.linalg.norm(A, axis=0), np.finfo(np.float64).tiny)
        factor = np.maximum(nnls(A / size, np.concatenate(aims))[0] / size, LEAST_VARIANCE)
        sigma = np.sqrt(2.0 * np.diag(np.linalg.pinv((A / size).T @ (A / size), hermitian=True))) / size
        if np.allclose(factor, before, rtol=SAME_VARIANCE):
            break
        last = [np.einsum("s,snij->nij", factor, part) for part in parts]
    at_zero = (factor < SEPARABLE * sigma) & (factor < 1.0)
    log_sigma = sigma / np.maximum(factor, sigma)
    return VarianceFactors(np.log(factor), np.diag(log_sigma**2), settled, tuple(at_zero.tolist()))


def _normal_size(squares: Floats, k: int) -> float:
    """Variance, in units of what whitened them, under which squares (row,) of k values are normal but for gross errors.

    Source: Huber, Robust Statistics, 1981, section 6.4 (proposal 2), with squares cut at 99 % of chi-square.
    """
    cut = float(chdtri(k, 1.0 - CUT))
    kept = k * float(chdtr(k + 2, cut)) + cut * (1.0 - CUT)  # mean of the cut chi-square
    size = float(np.median(squares) / chdtri(k, 0.5))
    for _ in range(TURNS):
        size = max(float(np.mean(np.minimum(squares, cut * size))) / kept, 1e-300)
    return size


def _rms(fit: Fitted, state: str) -> dict[str, Any]:
    """Of single coordinates and of the lengths of the misfits, of the first instrument."""
    m, rows = fit.session.measured[0], fit.problem.rows[0]
    misfit = m.problem.observed[rows] - fit.around.expected[0][rows]
    misfit = misfit[:, :POSITION] if misfit.shape[1] == POSE else misfit
    distance = float(np.sqrt(np.mean(np.sum(misfit**2, axis=1))))
    coordinate = distance / float(np.sqrt(misfit.shape[1]))
    return {f"rms_coordinate_{state}_m": coordinate, f"rms_distance_{state}_m": distance}


def _as_listed(
    model: ModelFile,
    fit: Fitted,
    parameters: tuple[Parameter, ...],
    covariance: Floats,
    conditions: Mapping[str, Floats],
) -> ModelFile:
    """With coefficients that belong to the terms as a reader of the file lists them.

    Columns of unknown masses are chosen again from the conditions of the file; they span the same.
    """
    if not model.effects:
        return model
    predictor, recorded = Predictor.of(model), Samples(conditions, fit.session.arm.n_joints)
    nothing = Perturbation.none(len(recorded), recorded.n_joints)
    terms = listed(model.effects[: len(fit.accepted)], drivers_under(predictor, recorded, nothing))
    turn, effects, at = np.eye(len(parameters)), list(model.effects), len(fit.session.parameters)
    for i, (a, read) in enumerate(zip(fit.accepted, terms, strict=True)):
        was, now = a.term.basis(fit.drivers, a.inner), read.accepted.term.basis(fit.drivers, a.inner)
        m = len(a.coefficients)
        same, _ = alike(now, was)
        left = float(np.linalg.norm((was - now @ same) @ a.coefficients))
        if now.shape != was.shape or left > NEARLY * float(np.linalg.norm(was @ a.coefficients)):
            raise DataError(
                f"no model: effect {effects[i].name} cannot be determined from the conditions of the file alone"
            )
        turn[at : at + m, at : at + m] = same
        turned = dict(zip(effects[i].coefficients, (same @ a.coefficients).tolist(), strict=True))
        effects = [
            structs.replace(e, coefficients=turned) if effects[i].name in (e.name, e.after) else e for e in effects
        ]
        at += len(a.values)
    turned_covariance = covariance_record(parameters, turn @ covariance @ turn.T)
    return structs.replace(model, effects=tuple(effects), covariance=turned_covariance)
