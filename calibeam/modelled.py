"""From any recording to its model and the verdict on it: zeros where spots are all there is, else the whole arm."""

from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording.fingerprint import readings_sha256
from acquisition.recording.recording import Recording
from acquisition.recording.rig import rig_sha256
from calibeam.any_session import Planned, asks_for_zeros, identify_session
from calibeam.ending import UNFINISHED, refuse_nothing
from calibeam.identification import identified_model, identify_recording
from calibrate.fit import Status
from calibrate.identification.record import record_of
from calibrate.model_file import ModelFile, RigIdentity
from calibrate.report.evidence import evidence
from calibrate.report.session_evidence import session_evidence
from calibrate.report.session_verdict import session_verdict
from calibrate.report.verdict import Verdict, verdict
from calibrate.sensors import spots

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ReadingErrors:
    """Length of the misfit of every reading of one quantity, in the order of the session."""

    title: str
    unit: str  # "m" or "rad"
    before: Floats  # (reading,) arm as drawn, places and target where they fit best
    after: Floats  # (reading,)


@dataclass(frozen=True)
class Modelled:
    """What model.json would hold, how far to trust it, and what it leaves of each reading."""

    model: ModelFile
    verdict: Verdict
    errors: tuple[ReadingErrors, ...]

    @property
    def finished(self) -> bool:
        """Whether the fit came to its end."""
        return Status[self.model.status] not in UNFINISHED


def modelled(recording: Recording, planned: Planned | None = None) -> Modelled:
    """Identify as `calibeam identify` does. DataError where nothing can be identified, or the file is a blunder."""
    if asks_for_zeros(recording.rig, recording.samples) and planned is None:
        return _zeros(recording)
    result = identify_session(recording, planned)
    refuse_nothing(result.status, result.estimates)
    plan = planned or Planned()
    identity = RigIdentity(recording.rig.name, rig_sha256(recording.rig_text), recording.rig_text)
    arm_model = (plan.plan.model or recording.rig.arm.model).value
    model = record_of(result, identity, arm_model, plan.text)
    model = msgspec.structs.replace(model, readings_sha256=readings_sha256(recording.samples))
    known = session_evidence(recording, model)
    errors = tuple(ReadingErrors(r.title, r.unit, r.error_before, r.error_after) for r in known.readings)
    return Modelled(known.model, session_verdict(known), errors)


def _zeros(recording: Recording) -> Modelled:
    found = identify_recording(recording)
    refuse_nothing(found.zeros.status, found.zeros.estimates)
    told = verdict(evidence(found.used, found.zeros, "reported"))
    before, after = (np.linalg.norm(r, axis=1) for r in (found.zeros.residual_before_m, found.zeros.residual_after_m))
    errors = ReadingErrors(spots.KIND.title, "m", np.asarray(before), np.asarray(after))
    return Modelled(identified_model(found, recording), told, (errors,))
