"""`calibeam report`: (re)write the report of a recording."""

from pathlib import Path

from acquisition.recording.read import read
from calibeam.reporting import write_any_report
from calibrate.diagnose.file import read_diagnosis
from calibrate.model_file import read_model


def report_command(
    recording: Path, *, model: Path | None = None, diagnosis: Path | None = None, out: Path = Path("report.html")
) -> None:
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
    diagnosis
        The diagnosis.json of this recording: its pages are added.
    out
        The HTML file to write.

    """
    known = None if model is None else read_model(model)
    write_any_report(read(recording), known, out, None if diagnosis is None else read_diagnosis(diagnosis))
    print(f"report: {out}")
