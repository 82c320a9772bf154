"""A recording compared with a simulation: its recording of the same plan, or a model that predicts the readings."""

from acquisition.recording import Recording
from calibeam.results.simulator import simulated_by_model
from calibeam.software import SOFTWARE
from calibrate.compare import compare_recordings
from calibrate.compare.comparison_file import ComparisonFile
from calibrate.compare.rig_and_streams import compare_logs
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
