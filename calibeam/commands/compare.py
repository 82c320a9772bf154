"""`calibeam compare`: what a measured recording and a simulation of it differ by, from the rig file to the streams."""

from pathlib import Path

import msgspec

from acquisition.recording import Recording, read
from acquisition.recording.files import write_json
from acquisition.recording.output import json_output
from calibeam.console import Console
from calibeam.outcome import CheckFailed
from calibeam.overwriting import writes
from calibeam.printing.comparison_lines import print_comparison
from calibeam.results.comparison import compare, compare_torques
from calibeam.results.identification import naming_source
from calibeam.results.simulator import TIMEOUT_S, Simulator, simulated_by
from calibrate.diagnose.assess import Verdict
from calibrate.errors import DataError
from calibrate.model.model_file import ModelFile, read_model

NO_SIMULATION = (
    "no simulation: give a recording of it, --simulator COMMAND or --simulated-model MODEL; of a recording in motion "
    "--simulation FILE"
)


@writes(out=json_output("calibeam-comparison"))
def compare_command(
    measured: Path,
    simulated: Path | None = None,
    *,
    simulator: str | None = None,
    simulated_model: Path | None = None,
    simulation: Path | None = None,
    timeout_s: float = TIMEOUT_S,
    out: Path = Path("compare.json"),
    diagnose: bool = True,
    exit_code: bool = False,
    json: bool = False,
    verbose: bool = False,
) -> None:
    """Find where a simulation and a measurement disagree.

    Causes first, then constants by level: zeros, links, frames; each difference with its size and sigma.

    Samples are matched by plan, order, repeat and station, and by joint angles only where these are missing.

    For example:

    ```
    calibeam compare out/demo/recording.mcap --simulated-model out/demo/model.json --out compare.json
    ```

    Parameters
    ----------
    measured
        A recording, or a session folder with rig.toml and samples.csv.
    simulated
        The same plan as simulated: a recording, or a session folder. Its rig is the model.
    simulator
        Instead of a recording a program, as "python my_sim.py": it gets the inputs of the samples as CSV on its
        standard input, or in a file where the command holds {samples}, and writes the readings it expects as CSV.
    simulated_model
        The model that the simulation is made of: its values stand beside the differences. Without a recording and
        without a program it is the simulation.
    simulation
        A URDF or MJCF file of the arm, for a recording in motion: its torques are taken along the measured motion, and
        what they leave out is found. Alone, or beside one of the above, to which samples are compared.
    timeout_s
        How long the program may take.
    out
        Where to write the comparison.
    diagnose
        Explain what differs; without it the links of the chain are compared only.
    exit_code
        End with exit code 1 at a mismatch, after the comparison has been written and printed; 0 where the two agree or
        nothing can be decided. Without it a mismatch ends with 0, too.
    json
        Print the comparison as it stands in the file, on one line, and nothing else.
    verbose
        Print also alternatives of constants, the readings, the links of the chain, the streams and the diagnosis.

    """
    source = read(measured)
    structure = None if simulated_model is None else read_model(simulated_model)
    with naming_source(measured):
        other = _simulation(source, simulated, simulator, structure, timeout_s)
        file = None if other is None else compare(source, other, diagnosed=diagnose, structure=structure)
        if simulation is not None:
            file = compare_torques(source, simulation, file)
    if file is None:
        raise DataError(NO_SIMULATION)
    write_json(out, file)
    if json:
        print(msgspec.json.encode(file).decode())
    else:
        console = Console()
        print_comparison(console, file, verbose=verbose)
        console.print(f"comparison: {out}", markup=False)
    if exit_code and file.verdict == Verdict.MISMATCH.value:
        raise CheckFailed("measured and simulated differ; the comparison has been written")


def _simulation(
    measured: Recording, recording: Path | None, program: str | None, structure: ModelFile | None, timeout_s: float
) -> Recording | ModelFile | None:
    """The simulated side of samples; None where none is given. DataError where two are."""
    if recording is not None and program is not None:
        raise DataError("give the simulation either as a recording or as --simulator, not both")
    if recording is not None:
        return read(recording)
    if program is not None:
        return simulated_by(Simulator(program, timeout_s), measured)
    return structure
