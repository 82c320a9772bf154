"""`calibeam identify`: the arm of a recording or session folder, by whatever instruments it holds."""

from pathlib import Path
from typing import Annotated

import msgspec
from cyclopts import Parameter, validators

from acquisition.recording import read
from acquisition.recording.rig import Rig
from calibeam.console import Console
from calibeam.overwriting import writes
from calibeam.printing.identification import print_identification, refitted_lines
from calibeam.results.controller_findings import controller_notes
from calibeam.results.identification import (
    Planned,
    identify_session,
    naming_source,
    refuse_undetermined,
    report_unfinished,
    write_session_model,
)
from calibrate.apply.export import ExportForm, FormName, export_model, form_named
from calibrate.errors import DataError
from calibrate.fit.identify.session import rig_as_planned
from calibrate.fit.solvers import Status
from calibrate.model.model_file import (
    MODEL,
    ModelFile,
    read_model,
    write_model,
)
from calibrate.model.sensors.catalogue import unused_columns
from calibrate.report.evidence import session_evidence


@writes(out=MODEL)
def identify_command(
    recording: Path,
    *,
    plan: Path | None = None,
    zeros_only: Annotated[bool, Parameter(negative=())] = False,
    model: Path | None = None,
    bootstrap: Annotated[int, Parameter(validator=validators.Number(gte=0))] | None = None,
    out: Path = Path("model.json"),
    export: Annotated[tuple[FormName | str, ...], Parameter(show_default=False)] = (),
    verbose: bool = False,
    json: bool = False,
) -> None:
    """Identify the arm's geometry from a recording.

    Checks the data and what can be determined, then fits. Every number has an uncertainty.

    Spots of the dual PSD show joint zeros, but no length; positions, wire, cones, bars, full poses (several at once)
    the whole arm.

    For example:

    ```
    calibeam identify out/demo/recording.mcap --out model.json
    calibeam identify out/demo/recording.mcap --zeros-only --out zeros.json
    calibeam identify now/recording.mcap --model last-year/model.json --out now/model.json
    ```

    Parameters
    ----------
    recording
        A recording, or a session folder with rig.toml and samples.csv.
    plan
        A fit plan (fit.toml): what is free, held or assumed, which instruments, loss, solver, proofs.
    zeros_only
        Only the joint zeros, beside base, target and fixture: offsets for a controller that takes nothing else. Lengths
        and axes stay nominal. Not with --plan or --model.
    model
        A known model with physics: its structure, geometry and effects, is fitted to this recording, and nothing is
        searched. Not with --plan or --bootstrap.
    bootstrap
        Also refit so many times to drawn rows: intervals without assuming a noise distribution.
    out
        Where to write the model.
    export
        Also write the arm for another program, beside the model: the forms of `calibeam export-model`.
    verbose
        Print all parameters, rank, second methods, observability and noise, too.
    json
        Print the model as it stands in the file, on one line, and nothing else.

    """
    forms = tuple(form_named(name) for name in export)
    if zeros_only and (plan is not None or model is not None):
        raise DataError('give --zeros-only without --plan and --model; in a fit plan it is the line hold = ["link*"]')
    if model is not None:
        if plan is not None or bootstrap:
            raise DataError("--model refits a known structure; give it without --plan and --bootstrap")
        with naming_source(recording):
            status = _refit(Console(quiet=json), recording, read_model(model), out, forms)
    else:
        planned = None if zeros_only else Planned.read(plan)
        with naming_source(recording):
            status = _identify(Console(quiet=json), recording, planned, bootstrap, out, forms, verbose=verbose)
    if json:
        print(msgspec.json.encode(read_model(out)).decode())
    report_unfinished(status, out)


def _identify(
    console: Console,
    recording: Path,
    planned: Planned | None,  # None: zeros only
    bootstrap: int | None,
    out: Path,
    export: tuple[ExportForm, ...],
    *,
    verbose: bool,
) -> Status:
    source = read(recording)
    planned = Planned.zeros_only(source.rig) if planned is None else planned
    result = identify_session(source, planned, bootstrap)
    refuse_undetermined(result.status, result.estimates)
    model = write_session_model(result, source, out, planned)
    exported = _export(rig_as_planned(source.rig, planned.plan), out, export)
    print_identification(console, result, session_evidence(source, model), verbose=verbose)
    notes = (*unused_columns(source.samples), *controller_notes(source))
    for line in (*notes, f"model: {out}", *exported):
        console.print(line, markup=False, highlight=False)
    return result.status


def _refit(console: Console, recording: Path, known: ModelFile, out: Path, export: tuple[ExportForm, ...]) -> Status:
    from calibrate.diagnose.with_model import refit  # a third of a second of imports that few runs need

    source = read(recording)
    found = refit(known, source)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_model(out, found.model)
    exported = _export(source.rig, out, export)
    for line in (*refitted_lines(found.model), *found.notes, f"model: {out}", *exported):
        console.print(line, markup=False, highlight=False)
    return Status[found.model.status]


def _export(rig: Rig, out: Path, export: tuple[ExportForm, ...]) -> tuple[str, ...]:
    """Writes the forms beside the model; lines about them."""
    if not export:
        return ()
    model, lines, lost = read_model(out), list[str](), tuple[str, ...]()
    for form in export:
        exported = out.with_name(out.stem + form.suffix)
        lost = export_model(exported, rig, model, form)
        lines.append(f"{form.name}: {exported}")
    return (*lines, *lost)
