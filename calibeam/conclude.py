"""What follows a recording: identify, write model.json and report.html beside it, print. Needs no device any more."""

from pathlib import Path

from rich.console import Console

from acquisition.recording.read import read
from calibeam.identification import Identified, identify_recording, write_identified
from calibeam.outcome import PartialResult
from calibeam.reporting import write_zero_report
from calibeam.terminal import print_identified
from calibrate.errors import DataError


def conclude(recording_path: Path, console: Console) -> Identified:
    """Model and report into the folder of the recording. PartialResult when that cannot be done, or is interrupted."""
    try:
        return _concluded(recording_path, console)
    except (KeyboardInterrupt, DataError, OSError) as why:
        reason = "Ctrl-C" if isinstance(why, KeyboardInterrupt) else str(why)
        raise PartialResult(
            f"{reason}; the recording is whole: {recording_path}; "
            f"`calibeam identify` and `calibeam report` go on from there"
        ) from why


def _concluded(recording_path: Path, console: Console) -> Identified:
    recording, folder = read(recording_path), recording_path.parent
    identified = identify_recording(recording)
    write_identified(identified, recording, folder / "model.json")
    print_identified(console, identified)
    write_zero_report(identified, folder / "report.html")
    console.print(f"report: {folder / 'report.html'}", markup=False)
    return identified
