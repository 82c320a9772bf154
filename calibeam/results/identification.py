"""From any recording or session folder to a model of the arm and the verdict on it, whatever instruments it holds.

For a script an identification ends good, partial, or failed with one sentence that states where and why.
"""

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording, readings_sha256
from acquisition.recording.rig import ArmModel, Rig, rig_sha256
from acquisition.recording.samples import measured_sha256
from calibeam.outcome import PartialResult
from calibrate.apply.export import dh_table_of
from calibrate.apply.predicting import as_fitted
from calibrate.errors import DataError
from calibrate.fit.fit_plan import (
    DEFAULT,
    FitPlan,
    parse_plan,
    read_plan,
    zeros_only_text,
)
from calibrate.fit.identify.estimates import Estimate
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.record import record_of
from calibrate.fit.identify.result import Identification
from calibrate.fit.solvers import Status
from calibrate.model.model_file import ModelFile, RigIdentity, write_model
from calibrate.model.predict import rig_in_model
from calibrate.report.elements.verdict import VerdictBox
from calibrate.report.evidence import session_evidence, session_verdict

UNFINISHED = (Status.OUT_OF_STEPS, Status.STALLED, Status.AT_BOUND)


@contextmanager
def naming_source(source: Path) -> Generator[None]:
    """DataErrors of what is computed from a recording or session folder, with the file's name before them."""
    try:
        yield
    except DataError as error:
        if str(source) in str(error):
            raise
        raise DataError(f"{source}: {error}") from error


def refuse_undetermined(status: Status, estimates: Sequence[Estimate]) -> None:
    """DataError where a fit that came to its end determines not one parameter: its model would hold nothing."""
    if status is Status.NOT_FINITE:
        raise DataError(f"nothing can be identified: {status.value}")
    if status not in UNFINISHED and estimates and all(estimate.value is None for estimate in estimates):
        first = next((e for e in estimates if e.why is not None), estimates[0])
        raise DataError(
            f"nothing can be identified: none of {len(estimates)} parameters is determined by these samples "
            f"({first.name}: {first.why}); measure more poses, more different ones, or state in the rig what is known"
        )


def report_unfinished(status: Status, model: Path) -> None:
    """PartialResult where the fit came to no end: what it had is in the model, but nobody should rely on it."""
    if status in UNFINISHED:
        raise PartialResult(f"{status.value}; what was found so far is in {model}")


@dataclass(frozen=True)
class Planned:
    """A fit plan and its text, which travels with the model."""

    plan: FitPlan = DEFAULT
    text: str | None = None

    @classmethod
    def read(cls, path: Path | None) -> "Planned":
        """The plan of a file, the defaults without one. DataError for what is wrong in it."""
        return cls() if path is None else cls(*read_plan(path))

    @classmethod
    def zeros_only(cls, rig: Rig) -> "Planned":
        """Joint zeros, beside what base, target and fixture need; all else of the arm is held at the rig file."""
        text = zeros_only_text(rig.tolerance is not None and rig.tolerance.eccentricity_rad is not None)
        return cls(parse_plan(text, "--zeros-only"), text)


def identify_session(
    recording: Recording, planned: Planned | None = None, bootstrap_rounds: int | None = None
) -> Identification:
    """The arm by all instruments of the recording. DataError when it holds nothing to fit, or is wrong as a whole."""
    plan = DEFAULT if planned is None else planned.plan
    rng = np.random.default_rng(plan.seed)
    return identify(recording.rig, recording.samples, rng=rng, plan=plan, bootstrap_rounds=bootstrap_rounds)


def session_model(result: Identification, recording: Recording, planned: Planned | None = None) -> ModelFile:
    """What model.json holds, with the rig in it."""
    text, rig = recording.rig_text, recording.rig
    plan_used = Planned() if planned is None else planned
    arm_model = (plan_used.plan.model or rig.arm.model).value
    identity, samples = RigIdentity(rig.name, rig_sha256(text), text), recording.samples
    hashes = {"readings_sha256": readings_sha256(samples), "measured_sha256": measured_sha256(samples)}
    model = msgspec.structs.replace(record_of(result, identity, arm_model, plan_used.text), **hashes)
    if arm_model == ArmModel.LOCAL_POE.value and model.covariance is not None:
        in_model = rig_in_model(rig, ArmModel.LOCAL_POE)
        found = dh_table_of(in_model, model, result.parameters, result.identifiability)
        model = msgspec.structs.replace(model, dh_table=found)
    left = [(i.name, i.rows[:, 0], i.misfit) for i in result.instruments if i.rows.shape[1] == 1]
    return as_fitted(model, samples, left)


def write_session_model(
    result: Identification, recording: Recording, path: Path, planned: Planned | None = None
) -> ModelFile:
    """Write model.json; returns its content."""
    model = session_model(result, recording, planned)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_model(path, model)
    return model


Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ReadingErrors:
    """Length of the misfit of every reading of one quantity, in the order of the session."""

    title: str
    unit: str  # "m" or "rad"
    before: Floats  # (reading,) nominal arm, places and target where they fit best
    after: Floats  # (reading,)


@dataclass(frozen=True)
class JudgedModel:
    """What model.json would hold, how far to trust it, and what it leaves of each reading."""

    model: ModelFile
    verdict: VerdictBox
    errors: tuple[ReadingErrors, ...]

    @property
    def finished(self) -> bool:
        """Whether the fit came to its end."""
        return Status[self.model.status] not in UNFINISHED


def identify_and_judge(recording: Recording, planned: Planned | None = None) -> JudgedModel:
    """Identify as `calibeam identify` does. DataError where nothing can be identified, or all of the file is wrong."""
    result = identify_session(recording, planned)
    refuse_undetermined(result.status, result.estimates)
    known = session_evidence(recording, session_model(result, recording, planned))
    errors = tuple(ReadingErrors(r.title, r.unit, r.error_before, r.error_after) for r in known.readings)
    return JudgedModel(known.model, session_verdict(known), errors)
