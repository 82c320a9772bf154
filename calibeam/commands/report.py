"""`calibeam report`: (re)write the report of a recording, alone or against an earlier calibration of the same arm.

The earlier calibration is a model.json, the folder of a session, or a recording. What --json prints is version 1 of
docs/report.md.
"""

from pathlib import Path
from typing import Literal

import msgspec

from acquisition.recording import Recording, read
from calibeam.overwriting import writes
from calibeam.printing.identification import verdict_words
from calibeam.results.identification import identify_and_judge, naming_source
from calibeam.results.session_results import write_recording_report
from calibrate.diagnose.record.file import read_diagnosis
from calibrate.model.model_file import read_model
from calibrate.report.drift import Calibration
from calibrate.report.elements.html import page_output
from calibrate.report.elements.verdict import Answers

MODEL, DIAGNOSIS = "model.json", "diagnosis.json"  # as sessions name them


def read_earlier_calibration(path: Path) -> Calibration:
    """DataError, RecordingError for what is none. A recording is identified again, without a plan."""
    if path.suffix == ".json":
        return Calibration(str(path), read_model(path))
    if path.is_dir() and (path / MODEL).exists():
        found = path / DIAGNOSIS
        return Calibration(str(path), read_model(path / MODEL), None, read_diagnosis(found) if found.exists() else None)
    recording = read(path)
    return Calibration(_label(recording), identify_and_judge(recording).model, recording)


def _label(recording: Recording) -> str:
    """The day, where the recording has it."""
    return recording.started_utc.partition("T")[0] or recording.path.name


class NumberRecord(msgspec.Struct, frozen=True):
    """A number of the first screen; null where it is not determined, with the reason in `about`."""

    value: float | None
    unit: str
    about: str


class SummaryRecord(msgspec.Struct, frozen=True):
    """All of the first screen."""

    schema: Literal[1]
    kind: Literal["calibeam-report"]
    report: str
    trust: str  # "yes", "with care", "no"
    verdict: str
    reasons: tuple[str, ...]
    known: tuple[str, ...]
    advice: tuple[str, ...]
    numbers: dict[str, NumberRecord]
    drift: str | None
    warnings: tuple[str, ...]


def summary_of(answers: Answers, path: Path) -> SummaryRecord:
    """Of the report at `path`."""
    judged = answers.verdict
    return SummaryRecord(
        1,
        "calibeam-report",
        str(path),
        judged.trust.value,
        judged.sentence,
        judged.reasons,
        answers.known,
        judged.advice,
        {n.key: NumberRecord(n.value, n.unit, n.about) for n in answers.numbers},
        answers.drift or None,
        answers.warnings,
    )


@writes(out=page_output("report"))
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

    For example:

    ```
    calibeam report out/demo/recording.mcap --out report.html
    calibeam report now/recording.mcap --against last-year/model.json
    ```

    Parameters
    ----------
    recording
        A recording, or a session folder.
    model
        The model.json of this recording, also one with physics, whose effects are then taken out of the readings;
        without it the recording is identified again.
    diagnosis
        The diagnosis.json of this recording: its pages are added.
    against
        An earlier calibration of the same arm: its model.json, the folder that a session left (model.json, and
        diagnosis.json if there is one), or a recording. A chapter reports what has changed since.
    interactive
        Add figures that can be turned and asked; the file grows by five megabytes and still needs no other.
    out
        The HTML file to write.
    json
        Print the first screen as one line of JSON, and nothing else.

    """
    known = None if model is None else read_model(model)
    found = None if diagnosis is None else read_diagnosis(diagnosis)
    earlier = None if against is None else read_earlier_calibration(against)
    with naming_source(recording):
        answers = write_recording_report(read(recording), known, out, found, against=earlier, interactive=interactive)
    if json:
        print(msgspec.json.encode(summary_of(answers, out)).decode())
        return
    for line in (*verdict_words(answers), f"report: {out}"):
        print(line)
