"""A comparison and a reconciliation in a terminal: the verdict, the differences, what was left out, what remains."""

from collections.abc import Iterator, Sequence

from rich.console import Console
from rich.table import Table

from calibeam.printing.results import print_diagnosis
from calibeam.results.comparison import (
    SAYS,
    ComparisonFile,
    DifferenceRecord,
    LinkRecord,
    ReadingRecord,
    StreamRecord,
)
from calibeam.results.reconciliation import ReconcileFile
from calibrate.effects.term import with_sigma
from calibrate.report.quantities import length, significant

MOST_DIFFERENCES = 14  # differences in a terminal; all of them stand in the file
FEW = 3  # alternatives of one


def print_comparison(console: Console, file: ComparisonFile, *, verbose: bool = False) -> None:
    """The verdict first; `verbose`: also the links of the chain, the streams and the diagnosis of what differs."""
    console.print(f"[bold]{file.verdict}[/bold]: {file.says}", highlight=False)
    console.print(_rows(file), highlight=False)
    for line in _differences(file.differences):
        console.print(line, highlight=False, markup=False)
    if file.readings:
        console.print(_readings(file.readings))
    for note in file.notes:
        console.print(note, highlight=False, markup=False)
    if verbose:
        _print_details(console, file)


def _print_details(console: Console, file: ComparisonFile) -> None:
    console.print(_chain(file.links))
    if file.streams:
        console.print(_streams(file.streams))
    if file.diagnosis is not None:
        console.print(
            "\nphysics sought beside the simulation's geometry, the constants above refitted:", highlight=False
        )
        print_diagnosis(console, file.diagnosis)


def _differences(found: tuple[DifferenceRecord, ...]) -> Iterator[str]:
    deciding = [one for one in found if one.decides]
    anew = [one for one in found if not one.decides]
    for number, one in enumerate(deciding[:MOST_DIFFERENCES], start=1):
        yield f"{number}. {one.says}"
        if one.alternatives:
            listed = ", ".join(f"{a.physics} at {a.where}" for a in one.alternatives[:FEW])
            more = "" if len(one.alternatives) <= FEW else f" and {len(one.alternatives) - FEW} more"
            yield f"   alternative: {listed}{more}"
        for name, value in one.simulated.items():
            yield f"   in the simulation: {name} {value:.6g}"
    if len(deciding) > MOST_DIFFERENCES:
        yield f"{len(deciding) - MOST_DIFFERENCES} more differences stand in the file"
    if anew:
        yield "set up or stated otherwise, no mismatch:"
        yield from (f"   {one.says}" for one in anew[:MOST_DIFFERENCES])


def _readings(readings: tuple[ReadingRecord, ...]) -> Table:
    table = Table(title="measured less simulated (rms of a coordinate)", title_justify="left")
    for heading in ("instrument", "readings", "as they stand", "with the differences above", "noise"):
        table.add_column(heading, justify="left" if heading == "instrument" else "right")
    for one in readings:
        before, after = _size(one.rms_coordinate_before, one.unit), _size(one.rms_coordinate_after, one.unit)
        noise = "-" if one.noise is None else _size(one.noise, one.unit)
        table.add_row(one.instrument, str(one.rows), before, after, noise)
    return table


def _rows(file: ComparisonFile) -> str:
    alone = [
        f"{len(rows)} only {where}"
        for rows, where in ((file.only_measured_t_s, "measured"), (file.only_simulated_t_s, "simulated"))
        if rows
    ]
    return f"{file.matched} samples in both" + "".join(f", {text}" for text in alone)


def _chain(links: tuple[LinkRecord, ...]) -> Table:
    table = Table(title="settled samples, link by link", title_justify="left")
    for heading in ("link", "differ by (rms)", "of its own", "at most", "in", "noise", "found", "parts"):
        table.add_column(heading, justify="left" if heading in ("link", "in", "parts") else "right")
    for one in links:
        parts = f"from t = {one.first_t_s:.3f} s" if one.parts and one.first_t_s is not None else "no"
        table.add_row(
            one.link,
            _size(one.rms_raw, one.unit),
            _size(one.rms_own, one.unit),
            _size(one.largest_own, one.unit),
            one.largest_column,
            "-" if one.noise is None else _size(one.noise, one.unit),
            _size(one.scatter, one.unit),
            parts,
        )
    return table


def _streams(streams: tuple[StreamRecord, ...]) -> Table:
    table = Table(title="streams, each on the clock of its twin", title_justify="left")
    for heading in ("stream", "clocks apart (s)", "drift (µs/s)", "differ by (rms)", "noise", "parts"):
        table.add_column(heading, justify="left" if heading in ("stream", "parts") else "right")
    for one in streams:
        if one.offset_s is None or one.rms is None or one.noise is None:
            table.add_row(one.stream, "-", "-", "-", "-", one.status)
            continue
        drift = "-" if one.drift is None else with_sigma(1e6 * one.drift, 1e6 * (one.drift_sigma or 0.0))
        offset = with_sigma(one.offset_s, one.offset_sigma_s or 0.0)
        parts = "other motion" if one.parts is None else "yes" if one.parts else "no"
        table.add_row(one.stream, offset, drift, _size(one.rms, one.unit), _size(one.noise, one.unit), parts)
    return table


def _size(value: float, unit: str) -> str:
    return SAYS[unit](value)


MOST_LINES = 5  # lines of a list, cut at the width of the terminal; all of them stand whole in the file


def print_reconciliation(console: Console, file: ReconcileFile) -> None:
    """At most 25 lines at usual widths."""
    console.print(f"[bold]{file.verdict}[/bold]: {file.says}", highlight=False)
    for one in file.unseen:
        parts = (
            f"{what} {length(value)} ({significant(over)} times the noise)"
            for what, value, over in (
                ("before", one.before_m, one.before),
                ("after geometry", one.geometry_m, one.geometry),
                ("after physics", one.after_m, one.after),
            )
        )
        _say(console, f"{one.instrument}, {one.rows} unseen rows, rms: " + ", ".join(parts))
    _list(console, "what the simulation lacks:", [one.says for one in file.left_out])
    _list(console, "what remains:", file.remains)
    _list(console, "what to do next:", file.next if file.remains else ())


def _list(console: Console, title: str, lines: Sequence[str]) -> None:
    if not lines:
        return
    _say(console, title)
    for line in lines[:MOST_LINES]:
        console.print(f"  {line}", highlight=False, markup=False, no_wrap=True, overflow="ellipsis")
    if len(lines) > MOST_LINES:
        _say(console, f"  {len(lines) - MOST_LINES} more, all in reconcile.json")


def _say(console: Console, line: str) -> None:
    console.print(line, highlight=False, markup=False)
