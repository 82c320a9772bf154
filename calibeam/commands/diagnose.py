"""`calibeam diagnose`: where a recording and its model disagree, what physics was left out, and the proof."""

from functools import partial
from pathlib import Path

import msgspec

from acquisition.recording import Recording, read
from acquisition.recording.pose_plan import POSE_PLAN
from calibeam.console import Console
from calibeam.overwriting import writes
from calibeam.printing.progress import stages_shown
from calibeam.printing.results import print_diagnosis, print_streams
from calibeam.results.diagnosis import (
    diagnose_recording,
    diagnose_streams,
    model_of,
    model_of_streams,
    plan_next,
    refuse_wrong_file,
    why_kept,
)
from calibeam.results.identification import naming_source
from calibrate.diagnose.from_recording import Diagnosed
from calibrate.diagnose.record.file import DIAGNOSIS, write_diagnosis
from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.errors import DataError
from calibrate.model.model_file import MODEL, NOT_AS_FITTED, ModelFile, read_model, write_model
from calibrate.report.elements.html import page_output


@writes(out=DIAGNOSIS, model_out=MODEL, report=page_output("diagnosis"), plan_out=POSE_PLAN)
def diagnose_command(
    recording: Path,
    *,
    model: Path | None = None,
    out: Path = Path("diagnosis.json"),
    model_out: Path | None = None,
    report: Path | None = None,
    plan_out: Path | None = None,
    verbose: bool = False,
    json: bool = False,
) -> None:
    """Find the physics that the geometric model leaves out.

    Where model and measurement disagree, which physics is missing, its size, and the proof on unseen samples.

    Faults of the file come first; a file that is wrong as a whole ends with code 1; the reason is in diagnosis.json.

    For example:

    ```
    calibeam diagnose out/demo/recording.mcap --model out/demo/model.json --out diagnosis.json
    ```

    Parameters
    ----------
    recording
        A recording, or a session folder with rig.toml and samples.csv. Of one without samples its streams are judged.
    model
        A model of the same rig, with or without physics: only what is new beside it is asked. On a later recording
        its values enter with their covariance, and what has changed is named.
    out
        Where to write the diagnosis.
    model_out
        Where to write the model: geometry fitted together with the physics found, which `calibeam predict` uses. A
        model of the same rig file and readings that stands there is kept where the new one is no better on unseen rows.
    report
        Where to write the pages for a person; default: beside the diagnosis.
    plan_out
        Where to write the poses that best separate alternative explanations: `calibeam session RIG --plan` takes them.
    verbose
        Print all causes, their alternatives, clocks and missing columns, too.
    json
        Print the diagnosis as it stands in the file, on one line, and nothing else.

    """
    known = None if model is None else read_model(model)
    source, console = read(recording), Console()
    if len(source.samples) == 0 and source.streams:
        torques, file = diagnose_streams(source, known)
        write_diagnosis(out, file)
        modelled = "" if model_out is None else _write_model(model_out, model_of_streams(torques, source), file)
        if json:
            print(msgspec.json.encode(file).decode())
        else:
            print_streams(console, file)
        _print_lines(console, [f"diagnosis: {out}", modelled], json=json)
        return
    with naming_source(recording):
        with stages_shown(Console(stderr=True)) as begun:
            found, file = diagnose_recording(source, known, partial(write_diagnosis, out), begun)
        write_diagnosis(out, file)
        lines, refused = list[str](), None
        try:  # whoever reads the text may end early: all files stand before it begins
            refuse_wrong_file(found, out)
            page = out.with_suffix(".html") if report is None else report
            lines += _write_page(found, source, file, page, out, plan_out)
            lines += [] if model_out is None else [_write_model(model_out, model_of(found, source), file)]
        except DataError as why:
            refused = why
        if json:
            print(msgspec.json.encode(file).decode())
        else:
            print_diagnosis(console, file, verbose=verbose)
        _print_lines(console, lines, json=json)
        if refused is not None:
            raise refused


def _write_page(
    found: Diagnosed, source: Recording, file: DiagnosisFile, page: Path, out: Path, plan_out: Path | None
) -> list[str]:
    """The pages for a person, and the poses to measure next; lines about them and the diagnosis."""
    planned = "" if plan_out is None else plan_next(found, plan_out)
    reported = msgspec.structs.replace(file, next=(*file.next, planned)) if planned else file
    from calibrate.report.diagnosis import write_diagnosis_report  # draws: nothing of it is needed in a search

    written = write_diagnosis_report(page, source, reported)
    return [planned, f"diagnosis: {out}", f"report: {written}"]


def _write_model(path: Path, model: ModelFile, file: DiagnosisFile) -> str:
    """A line about it."""
    if kept := why_kept(path, model, file):
        return f"model: {path} is kept as it is: {kept}"
    write_model(path, model)
    warnings = [f"warning: {alarm}" for alarm in model.alarms if alarm.startswith(NOT_AS_FITTED)]
    return "\n".join([f"model: {path}", *warnings])


def _print_lines(console: Console, lines: list[str], *, json: bool) -> None:
    said = Console(stderr=True) if json else console  # nobody takes a model that was kept for a new one
    for line in filter(None, lines):
        said.print(line, markup=False, highlight=False)
