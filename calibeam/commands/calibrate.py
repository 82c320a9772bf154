"""`calibeam calibrate`: from a recording to a model that was proved, in one command."""

from pathlib import Path

from acquisition.recording import read
from calibeam.console import Console
from calibeam.outcome import taken_back
from calibeam.overwriting import writes
from calibeam.results.identification import naming_source, report_unfinished
from calibeam.results.session_results import MODEL_NAME, calibrate
from calibrate.errors import DataError


@writes("out")
def calibrate_command(recording: Path, *, out: Path = Path("calibration"), verbose: bool = False) -> None:
    """Calibrate the arm from a recording: identify, diagnose, prove, report.

    Ten lines state how good the arm is now, how far to trust that, and what was found. The model holds the physics
    found only where it predicts unseen rows better for certain. `calibeam identify` and `diagnose` are its two halves.

    For example:

    ```
    calibeam calibrate out/demo/recording.mcap --out out/calibration
    ```

    Parameters
    ----------
    recording
        A recording, or a session folder with rig.toml and samples.csv.
    out
        Folder for model.json, diagnosis.json and report.html; has to be empty.
    verbose
        Print all that `identify --verbose` and `diagnose --verbose` do.

    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise DataError(f"{out}: not an empty folder; give another --out")
    source = read(recording)
    with naming_source(recording), taken_back(out):
        status = calibrate(source, out, Console(), verbose=verbose).status
    report_unfinished(status, out / MODEL_NAME)
