"""`calibeam import`: session folders, tables, logs of other programs and CAN logs become sessions and recordings."""

import math
from collections.abc import Iterator
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from acquisition.recording import RecordingError, read
from acquisition.recording.can_log import SUFFIXES as CAN_SUFFIXES
from acquisition.recording.can_log import import_can
from acquisition.recording.foreign import (
    SUFFIXES,
    ColumnRecord,
    ColumnsFile,
    Question,
    Understanding,
    columns_file,
    questions,
    read_sheet,
    refusal,
    samples_of,
    understand,
    write_session,
)
from acquisition.recording.rig import rig_text
from acquisition.recording.session_folder import CSV, PARQUET, RIG
from acquisition.recording.session_folder.folder_import import import_folder
from calibeam.asking import NotAgreedError, at_terminal, someone
from calibeam.outcome import PartialResult
from calibeam.software import SOFTWARE
from calibrate.report.quantities import significant

CAN_CSV = "timestamp,arbitration_id"  # how python-can's CSV begins
HUMAN = {"rad": (math.degrees(1.0), "°"), "m": (1e3, "mm")}


def import_command(
    source: Path,
    *,
    out: Path,
    rig: Path | None = None,
    columns: str = "",
    sheet: str | None = None,
    yes: bool = False,
) -> None:
    """Make a session of a table, a log or a session folder.

    Of a table of poses (xlsx, CSV, Parquet) a session folder, of everything else a recording. What the columns of a
    table are understood to mean is shown and asked for once, and written beside the folder.

    Example: calibeam import lab.xlsx --rig rig.toml --out session

    Example: calibeam import lab.csv --rig rig.toml --columns "A1..A6 [deg] = q, X Y Z [mm] = position" --out session

    Example: calibeam import session --out session.mcap

    Example: calibeam import bus.blf --rig rigs/ur5e-dual-psd.toml --out bus.mcap

    Parameters
    ----------
    source
        A table; a session folder, with its folder "streams" if it has one; or a CAN log: .blf, .asc, .csv or .log
        (candump).
    out
        The session folder or recording to make.
    rig
        The rig file of the arm; a session folder has its own.
    columns
        What columns mean, where their headings do not show it: "HEADINGS [unit] = meaning, ...". Meanings are q, cmd,
        enc, position, abc, wpr, quaternion, rotvec, matrix, pose-matrix, wire, time, ..., a name of your own, unused.
    sheet
        The sheet of a workbook with several tables.
    yes
        Take the columns as they are understood, without asking. An open unit is an error then.

    """
    if source.name in (CSV, PARQUET) and rig is None and (source.parent / RIG).is_file():
        source = source.parent
    if source.is_dir():
        _refuse(source, "a session folder has its own rig.toml", rig=rig, columns=columns, sheet=sheet)
        import_folder(source, out, software=SOFTWARE)
        print(f"{out}: {len(read(out).samples)} samples")
        return
    suffix = source.suffix.lower()
    if suffix not in (*SUFFIXES, *CAN_SUFFIXES):
        known = ", ".join(dict.fromkeys((*SUFFIXES, *CAN_SUFFIXES)))
        raise RecordingError(f"{source}: neither a session folder nor one of {known}; give one of these")
    if rig is None:
        raise RecordingError(f"{source}: a table or a log does not say of which rig it is; give --rig RIG.toml")
    if suffix in CAN_SUFFIXES and (suffix != ".csv" or _is_can_csv(source)):
        _refuse(source, "a CAN log has no columns", columns=columns, sheet=sheet)
        _can(source, out, rig)
        return
    _table(understand(read_sheet(source, sheet), rig_text(rig), str(rig), columns), out, yes=yes)


def _can(source: Path, out: Path, rig: Path) -> None:
    done = import_can(source, out, rig_text=rig_text(rig), software=SOFTWARE)
    print(f"{out}: {done.frames} CAN frames in {', '.join(done.streams)}")
    if done.damage is not None:
        raise PartialResult(f"{source}: {done.damage}; everything before it is in {out}")


def _table(table: Understanding, out: Path, *, yes: bool) -> None:
    """A session folder of a table of poses, after a person has agreed to what its columns mean."""
    if out.suffix.lower() == ".mcap":
        raise RecordingError(f"--out {out}: a table becomes a session folder; give the name of a folder")
    console = Console()
    table = with_units(table, yes=yes)
    samples = samples_of(table)
    about = columns_file(table, samples, SOFTWARE)
    print_columns(console, about)
    if not yes:
        asking = someone(at_terminal(), "whether the columns are meant so", "give --yes when they are")
        if not asking.enter("Are the columns meant so?"):
            raise NotAgreedError("nothing was written: the columns are meant otherwise; state them with --columns")
    beside = write_session(table, samples, about, out)
    for line in (f"{out}: {RIG} and {CSV} with {len(samples)} samples", f"columns: {beside}"):
        console.print(line, markup=False, highlight=False)


def with_units(table: Understanding, *, yes: bool) -> Understanding:
    """With every open unit answered by a person. SamplesError where nobody is to be asked."""
    while (question := next(iter(questions(table)), None)) is not None:
        asking = None if yes else at_terminal()
        if asking is None:
            raise refusal(table, question)
        numbered = {str(number): unit for number, unit in enumerate(question.choices, start=1)}
        proposed = next((n for n, unit in numbered.items() if unit == question.proposal), "q")
        choice = asking.choice(_asked(table, question), {**numbered, "q": "none of these: stop"}, proposed)
        if choice is None or choice == "q":
            raise refusal(table, question)
        table = table.answered(question, numbered[choice])
    return table


def _asked(table: Understanding, question: Question) -> str:
    names = table.headings(question.group)
    shown = names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"
    return f"{shown} ({question.group.meaning}): {question.why}. Unit?"


def print_columns(console: Console, about: ColumnsFile) -> None:
    """What the columns of a table were understood to mean, one line each, and what is not used."""
    sheet = f", sheet {about.sheet}" if about.sheet else ""
    console.print(f"{about.source}{sheet}: {about.rows} rows", style="bold", markup=False, highlight=False)
    lines = Table("column", "meaning", "unit read", "becomes", "range")
    for record in about.columns:
        cells = _several(record.headings), record.meaning, record.unit or "—", _several(record.becomes), _range(record)
        lines.add_row(*map(Text, cells))  # no markup: a heading may hold [deg]
    console.print(lines)
    for line in _remarks(about):
        console.print(line, markup=False, highlight=False)


def _remarks(about: ColumnsFile) -> Iterator[str]:
    yield from about.notes
    if about.unused:
        yield f"not used: {', '.join(about.unused)} (keep one with --columns \"'{about.unused[0]}' = its_name\")"


def _range(record: ColumnRecord) -> str:
    """After conversion; of angles and lengths as a laboratory reads them."""
    if record.lowest is None or record.highest is None:
        return "—"
    factor, unit = HUMAN.get(record.si_unit, (1.0, record.si_unit))
    low, high = (significant(factor * end, 5) for end in (record.lowest, record.highest))
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
    for name, value in given.items():
        if value not in (None, ""):
            raise RecordingError(f"{source}: --{name} {value}: {why}; leave --{name} out")
