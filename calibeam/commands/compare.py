"""`calibeam compare`: two recordings of one motion, measured and simulated: where in the chain they part, and why."""

from pathlib import Path

import msgspec
from rich.console import Console

from acquisition.recording import read
from calibeam.printing.results import print_comparison
from calibeam.results.comparison import compare, write_comparison
from calibeam.results.identification import naming_source


def compare_command(
    measured: Path,
    simulated: Path,
    *,
    out: Path = Path("compare.json"),
    diagnose: bool = True,
    json: bool = False,
) -> None:
    """Find where a simulation and a measurement disagree.

    Which link of the chain differs first, by how much and since when; then the physics of readings that differ.

    Samples are matched by pose and order, streams by their motion: clocks may differ and drift, rows may be missing.

    Example: calibeam compare out/site/recording.mcap out/demo/recording.mcap --out compare.json

    Parameters
    ----------
    measured
        A recording, or a session folder with rig.toml and samples.csv.
    simulated
        The same motion as simulated. Its rig is the model.
    out
        Where to write the comparison.
    diagnose
        Also diagnose what differs: which physics the simulation lacks.
    json
        Print the comparison as it stands in the file, on one line, and nothing else.

    """
    with naming_source(measured):
        file = compare(read(measured), read(simulated), diagnosed=diagnose)
    write_comparison(out, file)
    if json:
        print(msgspec.json.encode(file).decode())
        return
    console = Console()
    print_comparison(console, file)
    console.print(f"comparison: {out}", markup=False)
