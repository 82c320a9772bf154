"""model.json: an identified model with its sigmas; schema 2 carries physics, too. docs/formats.md explains every key.

Angles are rad, lengths m. A joint's true angle is its reading plus `joint<i>.zero`.
"""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording.files import JsonKind, read_json, shown, write_json
from acquisition.recording.files.bounds import (
    Correction,
    Count,
    FileText,
    Label,
    Many,
    Metres,
    Name,
    Number,
    Sentence,
    Statistic,
    Whole,
)
from acquisition.recording.output import json_output
from acquisition.recording.samples import Samples, measured_sha256, readings_sha256
from calibrate.errors import DataError
from calibrate.model.effect_records import EffectRecord, SessionRecord, check_physics
from calibrate.model.older_models import with_present_names
from calibrate.model.parameters import Parameter
from calibrate.model.sensors.catalogue import BY_NAME, FRAMES, kind_of
from calibrate.model.torque_records import TorquesOfModel
from calibrate.quantities import angle, length

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Fields = dict[Name, Statistic | Whole | Sentence | bool | None]
ArmName = Annotated[str, msgspec.Meta(pattern="^(dh|mdh|local-poe)$")]
About = dict[Name, tuple[Metres, ...]]
SCHEMA, WITH_PHYSICS = 1, 2
ROUNDED = 0.5  # of two sigmas: far more than rounding adds to values that are nearly determined together only
MODEL = json_output("calibeam-model", "model.json")
KIND = JsonKind("model.json", "give the model.json of an identification", "identify the recording again", DataError)


class RigIdentity(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Which rig file the model corrects."""

    name: Name
    sha256: Label
    text: FileText | None = None


class UnseenRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Parameters that can only be determined together."""

    words: Sentence
    members: Many[Name]
    structural: bool


class ModelParameter(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One correction, or why there is none."""

    name: Name
    unit: Label
    value: Correction | None
    sigma: Statistic | None
    undetermined: Sentence | None
    low: Statistic | None = None  # 95 % by the covariance, normal law
    high: Statistic | None = None
    predicted_sigma: Statistic | None = None  # what poses, noise and priors promise; null where they promise nothing
    bootstrap_sigma: Statistic | None = None
    bootstrap_low: Statistic | None = None  # 95 % of the refits
    bootstrap_high: Statistic | None = None


class Covariance(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Posterior of the free parameters."""

    names: Many[Name]
    rows: Many[Many[Number]]

    def __post_init__(self) -> None:
        size = len(self.names)
        if len(self.rows) != size or any(len(row) != size for row in self.rows):
            raise ValueError(f"covariance.rows is not square, {size} by {size}, as the {size} names are")


class LeftOut(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A gross error of the file: its rows, from 1, took no part."""

    kind: Label
    rows: Many[Count]
    column: Sentence
    says: Sentence


class UnseenRows(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Error of one instrument on rows that the fit has not seen, by one way to split."""

    split: Label
    instrument: Label
    observations: Count
    rms_distance_before_m: Statistic
    rms_distance_after_m: Statistic
    chi_after: Statistic
    chi_predicted: Statistic | None = None  # over noise and uncertainty of the fit together; absent in earlier files


class ObservabilityRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How well the poses show what the data alone can show; `condition` null where they show nothing."""

    o1: Statistic
    o2: Statistic
    o3: Statistic
    o4: Statistic
    o5: Statistic
    condition: Statistic | None
    parameters: Count


class WorkspaceErrorRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Predicted error of the target over the workspace; numbers null where `status` has the reason."""

    status: Label
    says: Sentence
    rms_m: Statistic | None
    p95_m: Statistic | None
    max_m: Statistic | None
    pose_rms_m: Statistic | None
    pose_p95_m: Statistic | None
    pose_max_m: Statistic | None
    scatter: Sentence
    point_m: tuple[Metres, Metres, Metres]
    poses: Count
    undetermined: Many[Sentence] = ()
    guessed: Many[Sentence] = ()


class BootstrapRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How many refits to drawn rows stand behind the bootstrap numbers of `parameters`."""

    rounds: Count
    failed: Count


class FitRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How the fit was made and what ended it."""

    method: Label  # as in a fit plan: "levenberg-marquardt", "dog-leg"
    loss: Label
    iterations: Count
    ended_by: Label  # name of the rule
    says: Sentence
    minus_2_log_likelihood: Statistic | None  # of the readings, noise found
    law: Label | None = None  # of the likelihood: "normal", "student-t"; null in models of earlier versions


class ModelFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Content of model.json; the module's text explains each field."""

    schema: Literal[1, 2]
    kind: Literal["calibeam-model"]
    software: Label
    rig: RigIdentity
    arm_model: ArmName
    status: Label
    says: Sentence
    poses: Count
    rank: Count
    free: Count
    condition: Statistic | None
    singular_values: Many[Statistic]
    unseen: Many[UnseenRecord]
    parameters: Many[ModelParameter]
    chain: dict[Name, Correction]
    covariance: Covariance | None
    noise: Fields
    repeats: Fields | None
    held_out: Fields | None
    rms_coordinate_before_m: Statistic
    rms_coordinate_after_m: Statistic
    rms_distance_before_m: Statistic
    rms_distance_after_m: Statistic
    instruments: Many[Name] = ("dual-psd",)
    about: About = msgspec.field(default_factory=dict[Name, tuple[Metres, ...]])
    blunders: Many[LeftOut] = ()
    alarms: Many[Sentence] = ()
    proofs: Many[UnseenRows] = ()
    unproven: Many[Sentence] = ()
    observability: ObservabilityRecord | None = None
    free_space: WorkspaceErrorRecord | None = None
    bootstrap: BootstrapRecord | None = None
    plan: FileText | None = None
    fit: FitRecord | None = None  # absent in models of earlier versions
    readings_sha256: Label | None = None  # which joint angles it was made of (acquisition/recording/samples.py)
    effects: Many[EffectRecord] = ()
    needs: Many[Name] = ()
    session: SessionRecord | None = None
    measured_sha256: Label | None = None  # and which measurements; absent in models of earlier versions
    left_m: Statistic | None = None  # of a coordinate of the target, what unseen rows show beyond its sigma
    torques: TorquesOfModel | None = None  # of a recording in motion
    dh_table: Many[ModelParameter] = ()  # of an arm that was fitted as poses: corrections of its standard D-H table

    def made_of(self, samples: Samples) -> bool | None:
        """Whether these are the readings of the fit; None where the joint angles are, and no more can be compared."""
        measured = measured_sha256(samples)
        if self.readings_sha256 != readings_sha256(samples):
            return False
        return True if self.measured_sha256 == measured else None if None in (self.measured_sha256, measured) else False

    def __post_init__(self) -> None:
        check_physics(self.schema, self.effects, self.session)
        unknown = [name for name in self.instruments if name not in BY_NAME]
        if unknown:
            raise ValueError(f"instruments: no sensor is called '{shown(unknown[0])}' here; install what brings it")
        for name, numbers in self.about.items():
            own = next((f.numbers for f in FRAMES if f.prefix == name.rstrip("0123456789")), 3)
            sizes = (6,) if name == "device" else (3, 6) if name == "tool" else (own,)
            if len(numbers) not in sizes:
                raise ValueError(f"about.{shown(name)} holds {len(numbers)} numbers instead of {max(sizes)}")


DIFFERS = 1e-3  # of the rms that a fit leaves: more is no rounding of a file
ROUNDING = 1e-9  # m or rad: exact readings leave next to nothing
NOT_AS_FITTED = "Read from its file, the model misses "


def not_as_fitted(name: str, fitted: float, found: float) -> str:
    """A sentence where a model as read from its file leaves another rms of an instrument's readings in its own session
    than its fit has left (m or rad); nothing where the two agree.
    """
    if abs(found - fitted) <= DIFFERS * fitted + ROUNDING:
        return ""
    kind = kind_of(name)
    says = length if kind.quantities[0].unit == "m" else angle
    return f"{NOT_AS_FITTED}{kind.noun} of its own session by {says(found, 4)}, and the fit left {says(fitted, 4)}."


def write_model(path: Path, model: ModelFile) -> None:
    """Write model.json, whole or not at all. OSError where the folder cannot be written."""
    write_json(path, model)


def read_model(path: Path) -> ModelFile:
    """Read model.json. DataError naming file, place and remedy where it is none or of another version."""
    model = read_json(path, KIND, ModelFile, _other, with_present_names)
    if model.covariance is not None:
        _check_covariance(path, model.covariance)
    return model


def _check_covariance(path: Path, covariance: Covariance) -> None:
    C = np.array(covariance.rows, dtype=np.float64).reshape(2 * (len(covariance.names),))
    sigma = np.sqrt(np.maximum(np.diag(C), 0.0))
    most = np.outer(sigma, sigma)
    for i, j in np.argwhere((np.abs(C) > (1.0 + ROUNDED) * most) | (np.abs(C - C.T) > ROUNDED * most))[:1].tolist():
        at = f"covariance.rows[{i}][{j}], {shown(covariance.names[i])}"
        raise DataError(f"{path}: {at}: no covariance is {C[i, j]:g}; identify the recording again")


def _other(content: dict[str, Any]) -> str | None:
    kind, schema = content.get("kind"), content.get("schema")
    if kind == "calibeam-model" and schema in (SCHEMA, WITH_PHYSICS):
        return None
    return f"kind '{shown(kind)}', schema {shown(schema)}; expected 'calibeam-model', schema {SCHEMA} or {WITH_PHYSICS}"


def corrections(model: ModelFile) -> dict[str, float]:
    """The complete set of values for predictions, by parameter name: what `AssumedRig` takes."""
    return dict(model.chain)


def covariance_record(parameters: tuple[Parameter, ...], covariance: NDArray[np.float64]) -> Covariance | None:
    """The free part of a posterior (param, param); None where it does not exist."""
    if not np.all(np.isfinite(covariance)):
        return None
    free = np.flatnonzero(np.diag(covariance) > 0.0)
    rows = covariance[np.ix_(free, free)]
    return Covariance(tuple(parameters[i].name for i in free), tuple(map(tuple, (0.5 * (rows + rows.T)).tolist())))


def fields_of(record: "DataclassInstance") -> Fields:
    """Fields of a result record; what is not a finite number becomes null, since JSON has no other word for it."""
    return {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in asdict(record).items()}
