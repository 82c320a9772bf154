"""`calibeam report`: (re)write the report of a recording."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from acquisition.recording.read import read
from calibeam.identification import identify_recording
from calibrate.report.zero_report import write_report


def report_command(
    recording: Path, *, out: Annotated[Path, Parameter(help="The HTML file to write.")] = Path("report.html")
) -> None:
    """Write one self-contained HTML file: rig, spots, centring, residuals, zeros with sigma, what the data cannot see.

    Example: calibeam report out/demo/recording.mcap --out report.html

    Parameters
    ----------
    recording
        A recording, or a session folder.
    """
    source = read(recording)
    identified = identify_recording(source)
    write_report(out, source, identified.zeros, identified.four_poses)
    print(f"report: {out}")
