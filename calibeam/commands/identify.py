"""`calibeam identify`: joint zeros of a recording or session folder."""

from pathlib import Path

from rich.console import Console

from acquisition.recording.read import read
from calibeam.identification import identify_recording, write_identified
from calibeam.terminal import print_identified


def identify_command(recording: Path, *, out: Path = Path("model.json")) -> None:
    """Identify joint zeros: rank and what cannot be determined first, then numbers with their sigma.

    Example: calibeam identify out/demo/recording.mcap --out model.json

    Parameters
    ----------
    recording
        A recording, or a session folder with rig.toml and samples.csv.
    out
        Where to write the model.

    """
    source = read(recording)
    identified = identify_recording(source)
    write_identified(identified, source, out)
    console = Console()
    print_identified(console, identified)
    console.print(f"model: {out}")
