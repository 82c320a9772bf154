"""A recording compared with a simulation: its recording of the same plan, or a model that predicts the readings."""

from pathlib import Path

import numpy as np

from acquisition.recording import Recording
from acquisition.recording.examination import ExaminationRecord
from calibeam.results.diagnosis import SEED
from calibeam.results.simulator import simulated_by_model
from calibeam.simulation.described_torques import described_torques
from calibeam.software import SOFTWARE
from calibrate.compare import compare_recordings
from calibrate.compare.compared_torques import torques_compared
from calibrate.compare.comparison_examinations import with_torque_examination
from calibrate.compare.comparison_file import ComparisonFile
from calibrate.compare.rig_and_streams import compare_logs
from calibrate.diagnose.motion import diagnose_torques
from calibrate.errors import DataError
from calibrate.model.model_file import ModelFile


def compare(
    measured: Recording,
    simulation: Recording | ModelFile,
    *,
    diagnosed: bool = True,
    structure: ModelFile | None = None,
) -> ComparisonFile:
    """DataError where the two are not of one arm and one plan, or where the model cannot predict the recording.

    `simulation`: its recording of the same plan, or a model, whose own uncertainty then counts as no difference.
    `diagnosed`: explain what differs. `structure`: the model that a recorded simulation is made of: its values stand
    beside the differences.
    """
    made_of = simulation if isinstance(simulation, ModelFile) else None
    simulated = simulated_by_model(simulation, measured) if isinstance(simulation, ModelFile) else simulation
    if measured.rig.n_joints == simulated.rig.n_joints == 0:
        return compare_logs(measured, simulated, SOFTWARE)
    return compare_recordings.compare(
        measured, simulated, SOFTWARE, diagnosed=diagnosed, made_of=made_of, structure=structure or made_of
    )


def compare_torques(measured: Recording, simulation: Path, samples: ComparisonFile | None) -> ComparisonFile:
    """The torques of a motion beside those of a URDF or MJCF file; `samples`: their comparison, where one was made.

    DataError where the file is not of this arm, or where the recording holds no torques in motion.
    """
    known = described_torques(simulation, measured.rig)
    found = diagnose_torques(measured, np.random.default_rng(SEED), known)
    if isinstance(found, ExaminationRecord):
        raise DataError(f"torques are not compared: {found.reason}; {found.remedy}; or compare without --simulation")
    return with_torque_examination(torques_compared(measured, known, found, SOFTWARE, samples), measured)
