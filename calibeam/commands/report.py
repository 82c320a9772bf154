"""`calibeam report`: (re)write the report of a recording, alone or against an earlier calibration of the same arm."""

from pathlib import Path

import msgspec

from acquisition.recording import read
from calibeam.earlier import earlier_calibration
from calibeam.ending import naming
from calibeam.reporting import write_any_report
from calibeam.summary_record import summary_of
from calibeam.verdict_line import verdict_words
from calibrate.diagnose.file import read_diagnosis
from calibrate.model_file import read_model


def report_command(
    recording: Path,
    *,
    model: Path | None = None,
    diagnosis: Path | None = None,
    against: Path | None = None,
    interactive: bool = False,
    out: Path = Path("report.html"),
    json: bool = False,
) -> None:
    """Write the report of a recording: one self-contained HTML file.

    How accurate the arm is now, whether to trust the result, what to do; then the details.

    Errors by instrument, proof on unseen rows, what was identified and what was not and why; of spots also the rig, the
    faces, the centring and the joint zeros. How to read it: docs/report.md.

    Example: calibeam report out/demo/recording.mcap --out report.html

    Example: calibeam report now/recording.mcap --against last-year/model.json

    Parameters
    ----------
    recording
        A recording, or a session folder.
    model
        The model.json of this recording, also one with physics, whose effects are then taken out of the readings;
        without it the recording is identified anew.
    diagnosis
        The diagnosis.json of this recording: its pages are added.
    against
        An earlier calibration of the same arm: its model.json, the folder that a session left (model.json, and
        diagnosis.json if there is one), or a recording. A chapter says what has changed since.
    interactive
        Add figures that can be turned and asked; the file grows by five megabytes and still needs no other.
    out
        The HTML file to write.
    json
        Print the first screen as one line of JSON, and nothing else.

    """
    known = None if model is None else read_model(model)
    found = None if diagnosis is None else read_diagnosis(diagnosis)
    earlier = None if against is None else earlier_calibration(against)
    with naming(recording):
        answers = write_any_report(read(recording), known, out, found, against=earlier, interactive=interactive)
    if json:
        print(msgspec.json.encode(summary_of(answers, out)).decode())
        return
    for line in (*verdict_words(answers), f"report: {out}"):
        print(line)
