"""An identification as model.json."""

from collections.abc import Iterable

import numpy as np

from calibrate.fit.accuracy.fit_statistics import StatedNoise
from calibrate.fit.fit_plan import LOSSES, METHODS
from calibrate.fit.identify.evidence_record import evidence_fields, parameter_records
from calibrate.fit.identify.result import FitEnd, Identification, Noise
from calibrate.model.checks.gross_error import Blunder
from calibrate.model.model_file import (
    WITH_PHYSICS,
    Fields,
    FitRecord,
    LeftOut,
    ModelFile,
    RigIdentity,
    Unseen,
    covariance_record,
    fields_of,
)
from calibrate.model.sensors.catalogue import kind_of


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
        unseen=tuple(Unseen(c.words, c.members, c.structural) for c in seen.combinations),
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
        out |= {f"{noise.source}_believed": noise.believed, noise.source: noise.found}
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


def left_out(blunder: Blunder) -> LeftOut:
    """With rows counted from 1, as a person counts."""
    return LeftOut(blunder.kind.name, tuple(row + 1 for row in blunder.rows), blunder.column, blunder.says)
