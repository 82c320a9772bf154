"""A comparison as a person reads it in a terminal."""

from rich.console import Console
from rich.table import Table

from calibeam.diagnosis_lines import print_diagnosis
from calibeam.results.comparison import CLEAR, SAYS, ComparisonFile, LinkRecord, StreamRecord


def print_comparison(console: Console, file: ComparisonFile) -> None:
    """What decides first; then the chain, the streams, and what physics would explain it."""
    console.print(f"[bold]{file.says}[/bold]", highlight=False)
    console.print(_rows(file), highlight=False)
    console.print(_chain(file.links))
    if file.streams:
        console.print(_streams(file.streams))
    for one in file.streams:
        if (line := _late(one)) is not None:
            console.print(line, highlight=False, markup=False)
    for note in file.notes:
        console.print(note, highlight=False, markup=False)
    if file.diagnosis is not None:
        console.print("\nwhat the simulation lacks, sought in the difference of the readings:", highlight=False)
        print_diagnosis(console, file.diagnosis)


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
        drift = "-" if one.drift is None else f"{1e6 * one.drift:+.2f} ± {1e6 * (one.drift_sigma or 0.0):.2g}"
        offset = f"{one.offset_s:+.6f} ± {one.offset_sigma_s:.2g}"
        parts = "yes" if one.parts else "no"
        table.add_row(one.stream, offset, drift, _size(one.rms, one.unit), _size(one.noise, one.unit), parts)
    return table


def _late(one: StreamRecord) -> str | None:
    late, sigma = one.later_than_joints_s, one.later_than_joints_sigma_s
    if late is None or sigma is None or abs(late) < max(CLEAR * sigma, 1e-4):
        return None
    return f"{one.stream}: {1e3 * late:+.3f} ± {1e3 * sigma:.2g} ms later after the joints than in the simulation"


def _size(value: float, unit: str) -> str:
    return SAYS[unit](value)
