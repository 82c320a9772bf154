"""`calibeam reconcile`: bring a simulation to agree with a recording, and show how far it does."""

from pathlib import Path

import msgspec

from acquisition.recording import Recording, read
from acquisition.recording.files import write_json
from acquisition.recording.rig import rig_text
from calibeam.console import Console
from calibeam.outcome import taken_back
from calibeam.printing.comparison_lines import print_reconciliation
from calibeam.results.identification import naming_source
from calibeam.results.reconciliation import Reconciled, reconcile
from calibeam.results.reconciliation_page import write_reconciliation_page
from calibeam.simulation.replayed_recording import write_replayed
from calibrate.diagnose.record.file import write_diagnosis
from calibrate.errors import DataError
from calibrate.model.model_file import write_model


def reconcile_command(
    measured: Path, *, simulation: Path, out: Path = Path("reconcile"), seed: int = 0, json: bool = False
) -> None:
    """Bring a simulation to agree with a recording.

    Compares the two, diagnoses what the simulation lacks, replays it with that, and compares again. A quarter of the
    poses stays unseen: how far the simulation is away, before and after, is measured there.

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
        moved through the recorded poses.
    out
        Folder for page.html, reconcile.json, before.json, diagnosis.json, model.json, simulated.mcap and after.json
        (of too few rows the first three); has to be empty.
    seed
        Of the split into seen and unseen rows, and of the noise of simulated.mcap.
    json
        Print reconcile.json on one line, and nothing else.

    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise DataError(f"{out}: not an empty folder; give another --out")
    source = read(measured)
    other: Recording | str = rig_text(simulation) if simulation.suffix == ".toml" else read(simulation)
    with naming_source(measured):
        found = reconcile(source, other, simulation.name, seed=seed)
    with taken_back(out):
        _write(out, found, source)
    if json:
        print(msgspec.json.encode(found.file).decode())
        return
    console = Console()
    print_reconciliation(console, found.file)
    console.print(f"page: {out / 'page.html'}", markup=False, highlight=False)


def _write(out: Path, found: Reconciled, source: Recording) -> None:
    """Every file of the folder."""
    out.mkdir(parents=True, exist_ok=True)
    if found.before is not None:
        write_json(out / "before.json", found.before)
    if found.brought is not None:
        write_diagnosis(out / "diagnosis.json", found.brought.diagnosis)
        write_model(out / "model.json", found.brought.model)
        about = {"replayed": source.path.name, "model": "model.json", "seed": str(found.file.seed), "noise": "as found"}
        write_replayed(out / "simulated.mcap", found.brought.simulated, found.measured, about)
        write_json(out / "after.json", found.brought.after)
    write_json(out / "reconcile.json", found.file)
    first_link = None if found.before is None else found.before.first_link
    write_reconciliation_page(out / "page.html", found.file, found.measured.rig, first_link)
