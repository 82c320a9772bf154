"""An identification as model.json, with everything that travels with it."""

from collections.abc import Iterable
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.accuracy import StatedNoise
from calibrate.fit.fit_plan import LOSSES, METHODS
from calibrate.fit.held_out.held_out import Bootstrap, beyond_sigma
from calibrate.fit.identify.estimates import Estimate
from calibrate.fit.identify.result import Evidence, FitEnd, FreeSpace, Identification, Noise
from calibrate.fit.rank.identifiability import Identifiability
from calibrate.fit.rank.observability import Observability
from calibrate.model.checks.gross_error import GrossError
from calibrate.model.model_file import (
    WITH_PHYSICS,
    BootstrapRecord,
    Fields,
    FitRecord,
    LeftOut,
    ModelFile,
    ModelParameter,
    ObservabilityRecord,
    RigIdentity,
    UnseenRecord,
    UnseenRows,
    WorkspaceErrorRecord,
    covariance_record,
    fields_of,
)
from calibrate.model.sensors.catalogue import kind_of
from calibrate.model.sensors.kind import Trait

AXES = 3  # of a position
REACH_95 = 1.959963984540054  # of a normal law: half of a 95 % interval in sigmas


class EvidenceFields(TypedDict):
    """Fields of model_file.ModelFile."""

    proofs: tuple[UnseenRows, ...]
    unproven: tuple[str, ...]
    observability: ObservabilityRecord | None
    free_space: WorkspaceErrorRecord | None
    bootstrap: BootstrapRecord | None
    left_m: float


def evidence_fields(evidence: Evidence) -> EvidenceFields:
    """All of it, as written."""
    drawn, shown, room = evidence.bootstrap, evidence.observability, evidence.free_space
    proofs = tuple(
        UnseenRows(
            u.split,
            u.name,
            u.observations,
            u.rms_distance_before_m,
            u.rms_distance_after_m,
            u.chi_after,
            u.chi_predicted,
        )
        for u in evidence.proven.held_out
    )
    return EvidenceFields(
        proofs=proofs,
        unproven=evidence.proven.unproven,
        observability=None if shown is None else _observability(shown),
        free_space=None if room is None else _free_space(room),
        bootstrap=None if drawn is None else BootstrapRecord(len(drawn.theta) + drawn.failed, drawn.failed),
        left_m=beyond_sigma(
            [
                (AXES * u.observations, rms_m, rms_m / u.chi_predicted)
                for u in evidence.proven.held_out
                if Trait.IN_SPACE in kind_of(u.name).traits and u.chi_predicted > 0.0
                for rms_m in [u.rms_distance_after_m / AXES**0.5]
            ]
        ),
    )


def parameter_records(
    estimates: tuple[Estimate, ...], seen: Identifiability, drawn: Bootstrap | None
) -> tuple[ModelParameter, ...]:
    """Values with their intervals; `estimates` are in the order of the columns of `drawn`."""
    promised = dict(zip(seen.names, seen.sigma.tolist(), strict=True))
    spread = None if drawn is None else np.column_stack([drawn.sigma(), drawn.interval()])
    return tuple(
        _parameter(e, promised.get(e.name), None if spread is None else spread[i]) for i, e in enumerate(estimates)
    )


def _parameter(e: Estimate, promised: float | None, spread: NDArray[np.float64] | None) -> ModelParameter:
    if e.value is None or e.sigma is None:
        return ModelParameter(e.name, e.unit, None, None, e.why)
    reach = REACH_95 * e.sigma
    sigma = promised if promised is not None and np.isfinite(promised) else None
    found = (None,) * 3 if spread is None or not np.all(np.isfinite(spread)) else tuple(spread.tolist())
    return ModelParameter(e.name, e.unit, e.value, e.sigma, None, e.value - reach, e.value + reach, sigma, *found)


def _observability(shown: Observability) -> ObservabilityRecord:
    condition = shown.condition if np.isfinite(shown.condition) else None
    return ObservabilityRecord(shown.o1, shown.o2, shown.o3, shown.o4, shown.o5, condition, shown.n_free)


def _free_space(room: FreeSpace) -> WorkspaceErrorRecord:
    one, pose = room.geometry, room.pose
    return WorkspaceErrorRecord(
        one.status.name,
        one.status.value,
        one.rms_m,
        one.p95_m,
        one.max_m,
        pose.rms_m,
        pose.p95_m,
        pose.max_m,
        room.scatter_says,
        room.point_m,
        room.poses,
        one.undetermined,
        one.guessed,
    )


def record_of(result: Identification, rig: RigIdentity, arm_model: str, plan: str | None = None) -> ModelFile:
    """The record to write. Of several instruments, `rms_...` are of the first; `plan` is the text of the fit plan."""
    seen, first = result.identifiability, result.instruments[0]
    return ModelFile(
        schema=WITH_PHYSICS,
        kind="calibeam-model",
        software=result.software,
        rig=rig,
        arm_model=arm_model,
        status=result.status.name,
        says=result.status.value,
        poses=result.n_samples,
        rank=seen.rank,
        free=seen.n_free,
        condition=seen.condition if np.isfinite(seen.condition) else None,
        singular_values=tuple(seen.singular_values.tolist()),
        unseen=tuple(UnseenRecord(c.words, c.members, c.structural) for c in seen.combinations),
        parameters=parameter_records(result.estimates, seen, result.evidence.bootstrap),
        chain={p.name: float(v) for p, v in zip(result.parameters, result.theta, strict=True)},
        covariance=covariance_record(result.parameters, result.covariance),
        noise=noise_fields(result.noise, result.stated_noise, settled=result.noise_settled),
        repeats=None if result.repeats is None else _plain(fields_of(result.repeats)),
        held_out=_held_out(result),
        rms_coordinate_before_m=first.rms_coordinate_before_m,
        rms_coordinate_after_m=first.rms_coordinate_after_m,
        rms_distance_before_m=first.rms_distance_before_m,
        rms_distance_after_m=first.rms_distance_after_m,
        instruments=tuple(i.name for i in result.instruments),
        about=result.about,
        blunders=tuple(left_out(b) for b in result.blunders),
        alarms=result.alarms,
        plan=plan,
        fit=fit_record(result.end),
        **evidence_fields(result.evidence),
    )


def fit_record(end: FitEnd) -> FitRecord:
    """Method and loss in the words of a fit plan."""
    value = end.minus_2_log_likelihood
    return FitRecord(
        next(name.value for name, method in METHODS.items() if method is end.method),
        next(name.value for name, loss in LOSSES.items() if loss.kind is end.loss),
        end.iterations,
        end.stop.name,
        end.stop.value,
        value if np.isfinite(value) else None,
        "normal",  # whatever the loss
    )


def noise_fields(found: Iterable[Noise], stated: StatedNoise, *, settled: bool) -> Fields:
    """Flat: `<source>_believed`, `<source>`, `<source>_sigma`, `<source>_at_zero`, and chi-square as stated."""
    out: Fields = {}
    for noise in found:
        out |= {f"{noise.source}_believed": noise.assumed, noise.source: noise.found}
        out |= {f"{noise.source}_sigma": noise.sigma, f"{noise.source}_at_zero": noise.at_zero}
    p = stated.p_above if np.isfinite(stated.p_above) else None
    return (
        out
        | {"chi2_stated": stated.chi2, "dof": stated.dof, "p_stated": p, "alarm": stated.alarm.name}
        | {"settled": settled}
    )


def _held_out(result: Identification) -> Fields | None:
    """Flat, of the first split: its words once, then count and distances before and after of each instrument."""
    if not result.held_out:
        return None
    first = result.held_out[0]
    out: Fields = {"split": first.split, "chi_after": first.chi_after}
    for one in (unseen for unseen in result.held_out if unseen.split == first.split):
        out[f"{one.name}_observations"] = one.observations
        unit = kind_of(one.name).quantities[0].unit
        out[f"{one.name}_rms_distance_before_{unit}"] = one.rms_distance_before_m
        out[f"{one.name}_rms_distance_after_{unit}"] = one.rms_distance_after_m
    return out


def _plain(fields: Fields) -> Fields:
    """Enum members by their name."""
    return {k: getattr(v, "name", v) for k, v in fields.items()}


def left_out(error: GrossError) -> LeftOut:
    """With rows counted from 1, as a person counts."""
    return LeftOut(error.kind.name, tuple(row + 1 for row in error.rows), error.column, error.says)
