"""What travels with an identification, as fields of model.json."""

from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.held_out.held_out import Bootstrap, beyond_sigma
from calibrate.fit.identify.estimates import Estimate
from calibrate.fit.identify.result import Evidence, FreeSpace
from calibrate.fit.rank.identifiability import Identifiability
from calibrate.fit.rank.observability import Observability
from calibrate.model.model_file import (
    BootstrapRecord,
    FreeSpaceRecord,
    ModelParameter,
    ObservabilityRecord,
    UnseenRows,
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
    free_space: FreeSpaceRecord | None
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


def _free_space(room: FreeSpace) -> FreeSpaceRecord:
    one, pose = room.geometry, room.pose
    return FreeSpaceRecord(
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
