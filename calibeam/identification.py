"""From a recording to joint zeros, by the full dual-PSD model and by the source's four-pose point constraint."""

from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording.recording import Recording
from acquisition.recording.rig import rig_sha256
from acquisition.recording.rig_schema import Rig
from calibrate.arms.catalogue import arm_of
from calibrate.blunders.finding import Blunder
from calibrate.dual_psd_rig import believed_noise, drawing_doubt, dual_psd_chain, fixture_of, laser_of
from calibrate.fit import Status
from calibrate.identification.evidence import Asked
from calibrate.identification.evidence_record import evidence_fields
from calibrate.identification.record import fit_record, left_out
from calibrate.identification.result import Identification
from calibrate.identification.spots import proved, without_blunders
from calibrate.model_file import ModelFile, RigIdentity, model_of, write_model
from calibrate.observations import Observations
from calibrate.read_samples import observations
from calibrate.zeros.identify import identify
from calibrate.zeros.point_constraint import (
    CENTRED_M,
    PointConstraintResult,
    identify_by_four_poses,
)
from calibrate.zeros.result import ZeroResult

SPLIT_SEED = 1  # of the held-out poses: fixed, so that the same recording always gives the same report


@dataclass(frozen=True)
class Identified:
    """What both methods say. `four_poses` is None where the recording has no two centred poses of each order."""

    zeros: ZeroResult
    four_poses: PointConstraintResult | None
    used: Recording  # without the rows of the blunders
    blunders: tuple[Blunder, ...] = ()
    proved: Identification | None = None  # the same fit, for its proofs; None where there is no answer to prove


def check_identifiable(rig: Rig) -> None:
    """DataError when a recording made with this rig could not be identified: said before an hour of measuring."""
    fixture_of(rig)
    laser_of(rig)


def identify_recording(recording: Recording) -> Identified:
    """Joint zeros of a dual-PSD recording. DataError when it holds nothing to fit, or is a blunder as a whole."""
    rig = recording.rig
    samples, blunders = without_blunders(rig, recording.samples)
    data = observations(samples)
    chain = dual_psd_chain(rig, data.placement, data.first_psd)
    zeros = identify(chain, data, believed_noise(rig), rng=np.random.default_rng(SPLIT_SEED))
    proofs = None
    if zeros.status is not Status.NOT_FINITE:
        proofs = proved(rig, samples, zeros, asked=Asked(), rng=np.random.default_rng(SPLIT_SEED))
    return Identified(zeros, _four_poses(rig, data), replace(recording, samples=samples), blunders, proofs)


def write_identified(identified: Identified, recording: Recording, path: Path) -> None:
    """model.json of the full model."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_model(path, identified_model(identified, recording))


def identified_model(identified: Identified, recording: Recording) -> ModelFile:
    """The full model as model.json says it."""
    identity = RigIdentity(recording.rig.name, rig_sha256(recording.rig_text), recording.rig_text)
    model = model_of(identified.zeros, identity, recording.rig.arm.model.value)
    model = msgspec.structs.replace(model, blunders=tuple(left_out(b) for b in identified.blunders))
    if identified.proved is None:
        return model
    proofs = evidence_fields(identified.proved.evidence)
    end = replace(identified.proved.end, iterations=identified.zeros.steps, stop=identified.zeros.stop)
    return msgspec.structs.replace(model, alarms=identified.proved.alarms, fit=fit_record(end), **proofs)


def _four_poses(rig: Rig, data: Observations) -> PointConstraintResult | None:
    rows = four_centred_poses(data)
    if rows is None:
        return None
    return identify_by_four_poses(arm_of(rig), laser_of(rig), data.select(rows), drawing_doubt(rig))


def four_centred_poses(data: Observations) -> NDArray[np.intp] | None:
    """Rows of two centred poses of each order at one placement, the two of an order as different as there are.

    In the order of the source: 1, 2 with PSD 1 first, 3, 4 with PSD 2 first. None where no placement has them.
    """
    centred = np.all(np.abs(data.spots_m) < CENTRED_M, axis=1)
    for placement in np.unique(data.placement):
        pairs = [
            _most_different(data, np.flatnonzero(centred & (data.placement == placement) & (data.first_psd == first)))
            for first in (1, 2)
        ]
        if pairs[0] is not None and pairs[1] is not None:
            return np.array([*pairs[0], *pairs[1]], dtype=np.intp)
    return None


def _most_different(data: Observations, rows: NDArray[np.intp]) -> tuple[int, int] | None:
    if len(rows) < 2:
        return None
    apart = np.linalg.norm(data.q_rad[rows][:, None] - data.q_rad[rows][None], axis=2)
    i, j = np.unravel_index(int(np.argmax(apart)), apart.shape)
    if apart[i, j] < 0.01:  # repeats of one pose are one pose
        return None
    return int(rows[i]), int(rows[j])
