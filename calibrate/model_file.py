"""model.json: an identified model with its doubt, version 1. docs/formats.md explains every key.

Angles are rad, lengths m. A joint's true angle is its reading plus `joint<i>.zero`.
"""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.parameters import Parameter
from calibrate.zeros.result import ZeroResult

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Fields = dict[str, float | int | str | bool | None]
SCHEMA = 1


class RigIdentity(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Which rig file the model corrects."""

    name: str
    sha256: str
    text: str | None = None


class Unseen(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Parameters that can only be told together."""

    words: str
    members: tuple[str, ...]
    structural: bool


class ModelParameter(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One correction, or why there is none."""

    name: str
    unit: str
    value: float | None
    sigma: float | None
    undetermined: str | None
    low: float | None = None  # 95 % by the covariance, normal law
    high: float | None = None
    predicted_sigma: float | None = None  # what poses, noise and priors promise; null where they promise nothing
    bootstrap_sigma: float | None = None
    bootstrap_low: float | None = None  # 95 % of the refits
    bootstrap_high: float | None = None


class Covariance(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Posterior of the free parameters."""

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]


class LeftOut(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A blunder of the file: its rows, from 1, took no part."""

    kind: str
    rows: tuple[int, ...]
    column: str
    says: str


class UnseenRows(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Error of one instrument on rows that the fit has not seen, by one way to split."""

    split: str
    instrument: str
    observations: int
    rms_before: float
    rms_after: float
    chi_after: float


class ObservabilityRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How well the poses show what the data alone can tell; `condition` null where they show nothing."""

    o1: float
    o2: float
    o3: float
    o4: float
    o5: float
    condition: float | None
    parameters: int


class FreeSpaceRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Predicted error of the target over the workspace; numbers null where `status` says why."""

    status: str
    says: str
    rms_m: float | None
    p95_m: float | None
    max_m: float | None
    pose_rms_m: float | None
    pose_p95_m: float | None
    pose_max_m: float | None
    scatter: str
    point_m: tuple[float, ...]
    poses: int
    undetermined: tuple[str, ...] = ()
    guessed: tuple[str, ...] = ()


class BootstrapRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How many refits to drawn rows stand behind the bootstrap numbers of `parameters`."""

    rounds: int
    failed: int


class ModelFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Content of model.json; the module's text explains each field."""

    schema: Literal[1]
    kind: Literal["calibeam-model"]
    software: str
    rig: RigIdentity
    arm_model: str
    status: str
    says: str
    poses: int
    rank: int
    free: int
    condition: float | None
    singular_values: tuple[float, ...]
    unseen: tuple[Unseen, ...]
    parameters: tuple[ModelParameter, ...]
    chain: dict[str, float]
    covariance: Covariance | None
    noise: Fields
    repeats: Fields | None
    held_out: Fields | None
    rms_before_m: float
    rms_after_m: float
    instruments: tuple[str, ...] = ("dual-psd",)
    about: dict[str, tuple[float, ...]] = msgspec.field(default_factory=dict[str, tuple[float, ...]])
    blunders: tuple[LeftOut, ...] = ()
    alarms: tuple[str, ...] = ()
    proofs: tuple[UnseenRows, ...] = ()
    unproven: tuple[str, ...] = ()
    observability: ObservabilityRecord | None = None
    free_space: FreeSpaceRecord | None = None
    bootstrap: BootstrapRecord | None = None
    plan: str | None = None
    readings_sha256: str | None = None  # which readings it was made of (acquisition/recording/fingerprint.py)


def model_of(result: ZeroResult, rig: RigIdentity, arm_model: str) -> ModelFile:
    """The record to write for a result."""
    seen = result.identifiability
    return ModelFile(
        schema=SCHEMA,
        kind="calibeam-model",
        software=result.software,
        rig=rig,
        arm_model=arm_model,
        status=result.status.name,
        says=result.status.value,
        poses=result.n_poses,
        rank=seen.rank,
        free=seen.n_free,
        condition=seen.condition if np.isfinite(seen.condition) else None,
        singular_values=tuple(seen.singular_values.tolist()),
        unseen=tuple(Unseen(c.words, c.members, c.structural) for c in seen.combinations),
        parameters=tuple(ModelParameter(e.name, e.unit, e.value, e.sigma, e.why) for e in result.estimates),
        chain={p.name: float(v) for p, v in zip(result.parameters, result.theta, strict=True)},
        covariance=covariance_record(result.parameters, result.covariance),
        noise=fields_of(result.noise),
        repeats=None if result.repeats is None else fields_of(result.repeats),
        held_out=None if result.held_out is None else fields_of(result.held_out),
        rms_before_m=result.rms_before_m,
        rms_after_m=result.rms_after_m,
    )


def write_model(path: Path, model: ModelFile) -> None:
    """Write model.json, whole or not at all. OSError where the folder cannot be written."""
    partial = path.with_name(path.name + ".partial")
    partial.write_bytes(msgspec.json.format(msgspec.json.encode(model), indent=1) + b"\n")
    partial.replace(path)


def read_model(path: Path) -> ModelFile:
    """Read model.json. DataError naming file, place and remedy where it is none or of another version."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DataError(
            f"{path}: cannot be read ({error.strerror}); give the model.json of an identification"
        ) from error
    try:
        version = msgspec.json.decode(data, type=_Version)
    except msgspec.DecodeError as error:
        raise DataError(f"{path}: not a model.json ({error}); identify the recording again") from error
    if version.kind != "calibeam-model" or version.schema != SCHEMA:
        raise DataError(
            f"{path}: kind '{version.kind}', schema {version.schema}; expected 'calibeam-model', schema {SCHEMA}"
        )
    try:
        return msgspec.json.decode(data, type=ModelFile)
    except msgspec.DecodeError as error:
        raise DataError(f"{path}: damaged model.json ({error}); identify the recording again") from error


def corrections(model: ModelFile) -> dict[str, float]:
    """The complete set of values for predictions, by parameter name: what believed.BelievedRig takes."""
    return dict(model.chain)


class _Version(msgspec.Struct, frozen=True):
    """The two fields that every version has."""

    schema: int
    kind: str


def covariance_record(parameters: tuple[Parameter, ...], covariance: NDArray[np.float64]) -> Covariance | None:
    """The free part of a posterior (param, param); None where it does not exist."""
    if not np.all(np.isfinite(covariance)):
        return None
    free = np.flatnonzero(np.diag(covariance) > 0.0)
    rows = covariance[np.ix_(free, free)]
    return Covariance(tuple(parameters[i].name for i in free), tuple(map(tuple, rows.tolist())))


def fields_of(record: "DataclassInstance") -> Fields:
    """Fields of a result record; what is not a finite number becomes null, since JSON has no other word for it."""
    return {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in asdict(record).items()}
