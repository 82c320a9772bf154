"""`calibeam import`: session folders, tables, logs of other programs and CAN logs become sessions and recordings."""

import math
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter, validators
from rich.table import Table
from rich.text import Text

from acquisition.can_signals import STREAM as ENCODERS
from acquisition.can_signals import NoSetUpError, encoder_rows, encoder_sheet, encoder_stream
from acquisition.recording import Recording, RecordingError, SamplesError, read
from acquisition.recording.can_log import SUFFIXES as CAN_SUFFIXES
from acquisition.recording.can_log import CanImport, import_can
from acquisition.recording.check_recording import left_out
from acquisition.recording.foreign import (
    KINDS,
    ColumnsFile,
    Sheet,
    Understanding,
    columns_file,
    questions,
    read_log,
    read_seats,
    read_sheet,
    recording_of,
    samples_of,
    understand,
    understand_logs,
    write_columns,
    write_session,
)
from acquisition.recording.mcap.layout import READINGS_NOTE
from acquisition.recording.restored_stamps import NOTE as RESTORED_NOTE
from acquisition.recording.restored_stamps import restored_stamps
from acquisition.recording.rig import load_rig, rig_text
from acquisition.recording.session_folder import CSV, PARQUET, RIG
from acquisition.recording.session_folder.folder_import import import_folder, write_recording
from calibeam.asking import NotAgreedError, at_terminal, someone
from calibeam.console import Console
from calibeam.outcome import PartialResult, taken_back
from calibeam.software import SOFTWARE
from calibrate.quantities import counted, significant
from drivers.device import Stamps

BAG = "metadata.yaml"  # in the folder of a ROS 2 bag
WORKBOOKS = (".xlsx", ".xlsm")
CAN_CSV = "timestamp,arbitration_id"  # how python-can's CSV begins
HUMAN = {"rad": (math.degrees(1.0), "°"), "m": (1e3, "mm")}


def import_command(
    source: Path,
    *others: Path,
    out: Path,
    rig: Path | None = None,
    columns: str = "",
    sheet: str | None = None,
    header_row: Annotated[int, Parameter(validator=validators.Number(gte=0))] | None = None,
    seat_from: Literal["file"] | None = None,
    streams: bool = False,
    stamps: Stamps | None = None,
    restore_stamps: bool = False,
    yes: bool = False,
) -> None:
    """Make a session of a table, a log or a session folder.

    Of a table of poses (xlsx, CSV, Parquet) a session folder, of everything else a recording. What the columns of a
    table are understood to mean is shown and asked for once, and written beside what is made.

    For example:

    ```
    calibeam import lab.xlsx --rig rig.toml --out session
    calibeam import lab.csv --rig rig.toml --columns "A1..A6 [deg] = q, X Y Z [mm] = position" --out session
    calibeam import session --out session.mcap
    calibeam import bus.blf --rig rigs/ur5e-dual-psd.toml --out bus.mcap
    calibeam import robot.csv encoders.csv --streams --rig rig.toml --out streams.mcap
    calibeam import lab.mcap --restore-stamps --out restored.mcap
    calibeam import */hole_?.csv --seat-from file --header-row 0 --columns "1..7 [rad] = q" --rig rig.toml --out session
    ```

    Parameters
    ----------
    source
        A table; a session folder, with its folder "streams" if it has one; a bag of ROS 2 or 1; or a CAN log: .blf,
        .asc, .csv or .log (candump).
    others
        Further logs of the same time, with --streams; further seats, with --seat-from.
    out
        The session folder or recording to make.
    rig
        The rig file of the arm; a session folder has its own.
    columns
        What columns mean, where their headings do not show it: "HEADINGS [unit] = meaning, ...". Meanings are q, cmd,
        enc, position, abc, wpr, quaternion, rotvec, matrix, pose-matrix, wire, time, ..., a name of your own, unused.
        Of several logs "LOG: HEADINGS [unit] = meaning".
    sheet
        The sheet of a workbook with several tables.
    header_row
        The row of the headings, from 1, where what stands above them is taken for headings; 0: there are none, the
        columns are named 1, 2, ...
    seat_from
        `file`: each table holds the postures of one seat (a ball in a socket). Seats are numbered from 1 in the order
        of the files, of a folder by name; the name of a seat is its folder and file: front_left/hole_0.
    streams
        A row of a table is a moment, not a pose: make a recording of streams.
    stamps
        What the times of a log are: `sampled` (clock of the device when it measured), `sent`, `arrived` (at the program
        that wrote the log) or `hardware` (of a CAN adapter).
    restore_stamps
        Put times of regular sampling in place of stamps in bursts, or of a clock that was set, as `check` names them:
        of a log, a session folder, or a recording. Refused where sampling is not regular, or samples may be missing.
    yes
        Take the columns as they are understood, without asking. An open unit is an error then.

    """
    if source.name in (CSV, PARQUET) and rig is None and (source.parent / RIG).is_file():
        source = source.parent
    if seat_from is None and source.is_dir() and not (source / BAG).is_file():
        if others:
            raise RecordingError(f"{others[0]}: a session folder is imported by itself; leave the others out")
        given = {"rig": rig, "columns": columns, "sheet": sheet, "header_row": header_row, "streams": streams}
        _refuse(source, "a session folder has its own rig.toml", **given, stamps=stamps)
        _folder(source, out, restore_stamps=restore_stamps)
        return
    if restore_stamps and source.suffix.lower() == ".mcap" and rig is None:
        _refuse(source, "a recording has its own streams", columns=columns, streams=streams, stamps=stamps)
        _restored_recording(source, others, out)
        return
    for path in (source, *others):
        _check_known(path)
    if seat_from is not None:
        given = {"streams": streams, "stamps": stamps, "restore_stamps": restore_stamps}
        _refuse(source, "the postures in a seat have no time", **given)
    if sheet is not None and not any(path.suffix.lower() in WORKBOOKS for path in (source, *others)):
        raise RecordingError(f"{source}: --sheet {sheet}: only a workbook has sheets; leave --sheet out")
    if rig is None:
        raise RecordingError(f"{source}: a table or a log names no rig; give --rig RIG.toml")
    if seat_from is not None:
        seats = read_seats((source, *others), sheet, header_row)
        _table(understand(seats, rig_text(rig), str(rig), columns), out, yes=yes)
    elif _is_can(source) and not others:
        given = {"columns": columns, "sheet": sheet, "header_row": header_row, "streams": streams}
        _refuse(source, "a CAN log has no columns", **given)
        why = "frames of a CAN log keep the stamps of the log"
        _refuse(source, why, stamps=stamps, restore_stamps=restore_stamps)
        _can(source, out, rig)
    elif streams or source.is_dir() or KINDS.get(source.suffix.lower()) == "bag":
        sheets = [table for path in (source, *others) for table in _log_tables(path, (sheet, header_row), rig, out)]
        understood = understand_logs(sheets, rig_text(rig), str(rig), columns)
        _logs(understood, out, stamps or "unknown", restore_stamps=restore_stamps, yes=yes)
    else:
        _check_one_table(source, others, stamps, restore_stamps=restore_stamps)
        _table(understand(read_sheet(source, sheet, header_row), rig_text(rig), str(rig), columns), out, yes=yes)


def _check_one_table(source: Path, others: Sequence[Path], stamps: Stamps | None, *, restore_stamps: bool) -> None:
    if stamps is not None or restore_stamps:
        option = "--restore-stamps" if stamps is None else "--stamps"
        raise RecordingError(f"{source}: {option} concerns the times of a log; give --streams for a log")
    if others:
        raise RecordingError(
            f"{others[0]}: one table becomes one session; give --streams for several logs of one time, or "
            "--seat-from file for one table a seat"
        )


def _check_known(path: Path) -> None:
    known = tuple(dict.fromkeys((*KINDS, *CAN_SUFFIXES)))
    if not path.is_dir() and path.suffix.lower() not in known:
        raise RecordingError(f"{path}: neither a session folder nor one of {', '.join(known)}; give one of these")


def _is_can(path: Path) -> bool:
    suffix = path.suffix.lower()
    return suffix in CAN_SUFFIXES and (suffix != ".csv" or _is_can_csv(path))


def _can(source: Path, out: Path, rig: Path) -> None:
    """Every frame, and where the rig has encoders what they sent."""
    encoders = load_rig(rig, needs_arm=False).devices.encoders
    if encoders is None:
        with taken_back(out):
            done = import_can(source, out, rig_text=rig_text(rig), software=SOFTWARE)
        print(f"{out}: {done.frames} CAN frames in {', '.join(done.streams)}")
    else:
        done, whole = _frames(source, rig, out)
        warnings: tuple[str, ...] = ()
        try:
            log = encoder_rows(whole, encoders)
            stream, notes = encoder_stream(log.rows, whole), dict(whole.notes)
            if log.warnings:
                notes[READINGS_NOTE] = "\n".join(log.warnings)
            whole = replace(whole, streams={**whole.streams, ENCODERS: stream}, notes=notes)
            found, warnings = f", {len(log.rows)} rows of {ENCODERS}", (*left_out(stream), *log.warnings)
        except NoSetUpError as why:
            found = f"; no angles: {why}"
        with taken_back(out):
            write_recording(whole, out, software=SOFTWARE, imported_from=source.name, started_utc=whole.started)
        print(f"{out}: {done.frames} CAN frames in {', '.join(done.streams)}{found}")
        print("".join(f"warning: {line}\n" for line in warnings), end="")
    for line in done.remarks:
        print(f"{source}: {line}")
    if done.damage is not None:
        raise PartialResult(f"{source}: {done.damage}; everything before it is in {out}")


def _frames(source: Path, rig: Path, out: Path) -> tuple[CanImport, Recording]:
    """The frames of a CAN log as a recording in memory."""
    with tempfile.TemporaryDirectory(dir=_existing(out)) as folder:
        path = Path(folder) / "frames.mcap"
        done = import_can(source, path, rig_text=rig_text(rig), software=SOFTWARE)
        return done, replace(read(path), path=source)


def _existing(out: Path) -> Path:
    """The folder in which `out` will be. RecordingError where there is none."""
    if not out.parent.is_dir():
        raise RecordingError(f"--out {out}: there is no folder {out.parent}; make it, or choose another place")
    return out.parent


def _log_tables(path: Path, place: tuple[str | None, int | None], rig: Path, out: Path) -> tuple[Sheet, ...]:
    """`place`: sheet and row of the headings."""
    if not _is_can(path):
        return read_log(path, place[0] if path.suffix.lower() in WORKBOOKS else None, place[1])
    encoders = load_rig(rig, needs_arm=False).devices.encoders
    if encoders is None:
        raise RecordingError(
            f"{path}: beside other logs a CAN log is read for its encoders; describe them in [devices.encoders] of "
            f"{rig}"
        )
    done, frames = _frames(path, rig, out)
    if done.damage is not None:
        raise RecordingError(f"{path}: {done.damage}; export the log again, or import it by itself")
    for line in done.remarks:
        print(f"{path}: {line}")
    log = encoder_rows(frames, encoders)
    print(
        "".join(f"{path}: warning: {line}\n" for line in (*left_out(encoder_stream(log.rows, frames)), *log.warnings)),
        end="",
    )
    return (encoder_sheet(log.rows, frames, path),)


def _folder(source: Path, out: Path, *, restore_stamps: bool) -> None:
    """A recording of a session folder."""
    with taken_back(out):
        import_folder(source, out, software=SOFTWARE, restore_stamps=restore_stamps)
    made = read(out)
    print("\n".join((f"{out}: {len(made.samples)} samples", *_restored_lines(made))))


def _restored_recording(source: Path, others: Sequence[Path], out: Path) -> None:
    """A recording of the same, with the times restored."""
    if others:
        raise RecordingError(f"{others[0]}: a recording is restored by itself; leave the others out")
    whole = restored_stamps(read(source))
    with taken_back(out):
        write_recording(whole, out, software=SOFTWARE, imported_from=source.name, started_utc=whole.started)
    print("\n".join((f"{out}: {len(whole.samples)} samples", *_restored_lines(whole))))


def _restored_lines(recording: Recording) -> Iterator[str]:
    for name, note in recording.notes.items():
        if name.startswith(RESTORED_NOTE):
            yield f"{name.removeprefix(RESTORED_NOTE)}: time stamps restored: {note}"


def _logs(
    tables: Sequence[Understanding], out: Path, stamps: Stamps, *, restore_stamps: bool = False, yes: bool
) -> None:
    """A recording of streams, after a person has agreed to what the columns mean."""
    if out.suffix.lower() != ".mcap":
        raise RecordingError(f"--out {out}: logs become a recording; give a name that ends with .mcap")
    console = Console()
    tables = [with_units(table, yes=yes, settled=False) for table in tables]
    recording, started_utc = recording_of(tables, out, stamps)
    if restore_stamps:
        recording = restored_stamps(replace(recording, path=tables[0].sheet.path))
    others = [(*tables[:at], *tables[at + 1 :]) for at in range(len(tables))]
    about = [columns_file(table, None, SOFTWARE, rest) for table, rest in zip(tables, others, strict=True)]
    for one in about:
        print_columns(console, one)
    for line in (line for one in about for line in one.examination_lines()):
        console.print(line, markup=False, highlight=False)
    _agreed(yes=yes)
    names = ", ".join(str(table.sheet.path.name) for table in tables)
    with taken_back(out):
        write_recording(recording, out, software=SOFTWARE, imported_from=names, started_utc=started_utc)
        columns_path = write_columns(about, out)
    for name, stream in recording.streams.items():
        console.print(f"{out}: {name}, {counted(len(stream.host_s), 'row')}", markup=False, highlight=False)
    for line in (*_restored_lines(recording), f"columns: {columns_path}"):
        console.print(line, markup=False, highlight=False)


def _agreed(*, yes: bool) -> None:
    """Returns when a person has agreed to the columns that are shown. NotAgreedError."""
    if yes:
        return
    asking = someone(at_terminal(), "whether the columns are understood correctly", "give --yes when they are")
    if not asking.enter("Are the columns understood correctly?"):
        raise NotAgreedError("nothing was written: the columns mean something else; state them with --columns")


def _table(table: Understanding, out: Path, *, yes: bool) -> None:
    """A session folder of a table of poses, after a person has agreed to what its columns mean."""
    if out.suffix.lower() == ".mcap":
        raise RecordingError(
            f"--out {out}: a table of poses becomes a session folder; give the name of a folder, or --streams for a log"
        )
    console = Console()
    table = with_units(table, yes=yes)
    samples = samples_of(table)
    about = columns_file(table, samples, SOFTWARE)
    print_columns(console, about)
    for line in about.examination_lines():
        console.print(line, markup=False, highlight=False)
    _agreed(yes=yes)
    with taken_back(out):
        columns_path = write_session(table, samples, about, out)
    for line in (f"{out}: {RIG} and {CSV} with {counted(len(samples), 'sample')}", f"columns: {columns_path}"):
        console.print(line, markup=False, highlight=False)


def with_units(table: Understanding, *, yes: bool, settled: bool = True) -> Understanding:
    """With every open unit answered by a person. SamplesError where nobody is to be asked."""
    while (question := next(iter(questions(table, settled=settled)), None)) is not None:
        asking = None if yes else at_terminal()
        if asking is None:
            raise SamplesError(question.refusal)
        numbered = {str(number): unit for number, unit in enumerate(question.choices, start=1)}
        proposed = next((n for n, unit in numbered.items() if unit == question.proposal), "q")
        choice = asking.choice(question.asks, {**numbered, "q": "none of these: stop"}, proposed)
        if choice is None or choice == "q":
            raise SamplesError(question.refusal)
        table = table.answered(question, numbered[choice])
    return table


def print_columns(console: Console, about: ColumnsFile) -> None:
    """What the columns of a table were understood to mean, one line each, and what is not used."""
    sheet = f", sheet {about.sheet}" if about.sheet else ""
    console.print(f"{about.source}{sheet}: {counted(about.rows, 'row')}", style="bold", markup=False, highlight=False)
    lines = Table("column", "meaning", "unit read", "becomes", "range")
    for record in about.columns:
        span = _range(record.si_unit, record.lowest, record.highest)
        cells = _several(record.headings), record.meaning, record.unit or "—", _several(record.becomes), span
        lines.add_row(*map(Text, cells))  # no markup: a heading may hold [deg]
    console.print(lines)
    for line in (*about.notes, *about.not_taken_lines()):
        console.print(line, markup=False, highlight=False)


def _range(si_unit: str, lowest: float | None, highest: float | None) -> str:
    """After conversion; of angles and lengths as a laboratory reads them."""
    if lowest is None or highest is None:
        return "—"
    factor, unit = HUMAN.get(si_unit, (1.0, si_unit))
    low, high = (significant(factor * end, 5) for end in (lowest, highest))
    return f"{low} … {high} {unit}".rstrip()


def _several(names: tuple[str, ...]) -> str:
    return ", ".join(names) if len(names) <= 3 else f"{names[0]} … {names[-1]}"


def _is_can_csv(source: Path) -> bool:
    try:
        with source.open("rb") as file:
            return file.read(len(CAN_CSV)) == CAN_CSV.encode()
    except OSError as error:
        raise RecordingError(f"{source}: cannot read it ({error.strerror}); check the path") from error


def _refuse(source: Path, why: str, **given: object) -> None:
    for name, value in ((name.replace("_", "-"), value) for name, value in given.items()):
        if value is not None and value is not False and value != "":
            raise RecordingError(f"{source}: --{name} {value}: {why}; leave --{name} out")
