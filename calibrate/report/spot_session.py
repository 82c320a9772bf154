"""The spots of a session as its chapters on rig, faces and centring need them."""

from dataclasses import dataclass

import numpy as np

from acquisition.recording import Recording
from acquisition.recording.rig import Rig
from calibrate.dual_psd_rig import dual_psd_chain
from calibrate.fit_plan import DEFAULT, parse_plan
from calibrate.identification.planned import rig_as_planned
from calibrate.observations import Observations
from calibrate.read_samples import observations
from calibrate.report.session_evidence import Readings, SessionEvidence
from calibrate.sensors import spots


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
