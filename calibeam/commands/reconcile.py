"""`calibeam reconcile`: bring a simulation to agree with a recording, and show how far it does."""

from pathlib import Path

import msgspec

from acquisition.recording import Recording, read
from acquisition.recording.examination import ExaminationRecord
from acquisition.recording.files import write_json
from acquisition.recording.rig import rig_text
from calibeam.console import Console
from calibeam.outcome import taken_back
from calibeam.printing.comparison_lines import print_reconciliation
from calibeam.results.identification import naming_source
from calibeam.results.motion_reconciliation import (
    DESCRIPTIONS,
    MotionPart,
    reconcile_torques,
    torques_stated,
    with_motion,
)
from calibeam.results.reconciliation import Reconciled, reconcile
from calibeam.results.reconciliation_page import write_reconciliation_page
from calibeam.simulation.replayed_recording import write_replayed
from calibrate.compare.reconciled_rows import ReconcileFile, examined
from calibrate.diagnose.motion import model_of_motion, with_torques
from calibrate.diagnose.record.file import write_diagnosis
from calibrate.errors import DataError
from calibrate.model.model_file import write_model


def reconcile_command(
    measured: Path, *, simulation: Path, out: Path = Path("reconcile"), seed: int = 0, json: bool = False
) -> None:
    """Bring a simulation to agree with a recording.

    Compares the two, diagnoses what the simulation lacks, replays it with that, and compares again. A quarter of the
    poses, or the end of a motion, stays unseen: how far the simulation is away, before and after, is measured there.

    For example:

    ```
    calibeam reconcile measured.mcap --simulation rig.toml --out out/reconcile
    ```

    Parameters
    ----------
    measured
        A recording, or a session folder with rig.toml and samples.csv.
    simulation
        The simulation: a recording of the same plan, a session folder, or a rig file (.toml), whose arm as stated is
        moved through the recorded poses. Of a recording in motion: a rig file that states masses, an MJCF or a URDF
        file (.xml, .urdf), for its torques.
    out
        Folder for page.html, reconcile.json, before.json, diagnosis.json, model.json, simulated.mcap and after.json
        (of too few rows the first three; of a motion without samples page, reconciliation, diagnosis and, where it
        is better, the model); has to be empty.
    seed
        Of the split into seen and unseen rows, and of the noise of simulated.mcap.
    json
        Print reconcile.json on one line, and nothing else.

    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise DataError(f"{out}: not an empty folder; give another --out")
    source = read(measured)
    if len(source.samples) and simulation.suffix in DESCRIPTIONS:
        raise DataError(
            f"{simulation}: a recording with samples is compared with a rig file or a recording; make the rig file of "
            f"this description: calibeam rig new --help"
        )
    with naming_source(measured):
        part = reconcile_torques(source, torques_stated(simulation, source.rig), simulation.name)
        found = _of_poses(source, simulation, seed) if len(source.samples) else None
        if found is None and isinstance(part, ExaminationRecord):
            raise DataError(f"{measured}: no samples, and the torques are not examined: {part.reason}; {part.remedy}")
    file = examined(with_motion(None if found is None else found.file, part), part)
    part = None if isinstance(part, ExaminationRecord) else part
    with taken_back(out):
        _write(out, found, part, file, source)
    if json:
        print(msgspec.json.encode(file).decode())
        return
    console = Console()
    print_reconciliation(console, file)
    console.print(f"page: {out / 'page.html'}", markup=False, highlight=False)


def _of_poses(source: Recording, simulation: Path, seed: int) -> Reconciled:
    other: Recording | str = rig_text(simulation) if simulation.suffix == ".toml" else read(simulation)
    return reconcile(source, other, simulation.name, seed=seed)


def _write(
    out: Path, found: Reconciled | None, part: MotionPart | None, file: ReconcileFile, source: Recording
) -> None:
    """Every file of the folder."""
    out.mkdir(parents=True, exist_ok=True)
    diagnosis, model = None if part is None else part.diagnosis, None
    if part is not None and part.model is not None:
        model = model_of_motion(source, part.model)
    if found is not None and found.before is not None:
        write_json(out / "before.json", found.before)
    if found is not None and found.brought is not None:
        diagnosis = found.brought.diagnosis if part is None else with_torques(found.brought.diagnosis, part.found)
        model = msgspec.structs.replace(found.brought.model, torques=None if part is None else part.model)
        about = {"replayed": source.path.name, "model": "model.json", "seed": str(file.seed), "noise": "as found"}
        write_replayed(out / "simulated.mcap", found.brought.simulated, found.measured, about)
        write_json(out / "after.json", found.brought.after)
    if diagnosis is not None:
        write_diagnosis(out / "diagnosis.json", diagnosis)
    if model is not None:
        write_model(out / "model.json", model)
    write_json(out / "reconcile.json", file)
    first_link = None if found is None or found.before is None else found.before.first_link
    write_reconciliation_page(out / "page.html", file, source.rig, first_link)
