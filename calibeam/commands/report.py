"""`calibeam report`: (re)write the report of a recording."""

from pathlib import Path

from acquisition.recording.read import read
from calibeam.reporting import write_any_report
from calibrate.model_file import read_model


def report_command(recording: Path, *, model: Path | None = None, out: Path = Path("report.html")) -> None:
    """Write one self-contained HTML file: how good the arm is now, errors before and after, numbers with their doubt.

    Of the dual PSD alone: rig, spots, centring, residuals, joint zeros. Of any other session: errors by instrument,
    proof on unseen rows, what was identified and what was refused and why.

    Example: calibeam report out/demo/recording.mcap --out report.html

    Parameters
    ----------
    recording
        A recording, or a session folder.
    model
        The model.json of this recording; without it the recording is identified anew.
    out
        The HTML file to write.

    """
    known = None if model is None else read_model(model)
    write_any_report(read(recording), known, out)
    print(f"report: {out}")
