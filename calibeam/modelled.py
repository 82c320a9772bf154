"""From any recording to its model and the verdict on it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording
from calibeam.any_session import Planned, identify_session, session_model
from calibeam.ending import UNFINISHED, refuse_nothing
from calibrate.fit import Status
from calibrate.model_file import ModelFile
from calibrate.report.session_evidence import session_evidence
from calibrate.report.session_verdict import session_verdict
from calibrate.report.verdict import Verdict

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
    result = identify_session(recording, planned)
    refuse_nothing(result.status, result.estimates)
    known = session_evidence(recording, session_model(result, recording, planned))
    errors = tuple(ReadingErrors(r.title, r.unit, r.error_before, r.error_after) for r in known.readings)
    return Modelled(known.model, session_verdict(known), errors)
