"""A diagnosis or a comparison in a terminal: verdict, causes with their size, proof, uncertainty, what to do next."""

from collections.abc import Iterator

from rich.console import Console
from rich.table import Table

from calibeam.results.comparison import CLEAR, SAYS, ComparisonFile, LinkRecord, StreamRecord
from calibrate.diagnose.schema import DiagnosisFile, FindingRecord
from calibrate.report.diagnosis.words import (
    before_after,
    free_space_words,
    micrometres,
    place_words,
    rival_words,
    stream_words,
    verdict_words,
)

MOST = 8  # of what is only told by the way; all of it stands in the file


def print_diagnosis(console: Console, file: DiagnosisFile) -> None:
    """Everything that decides; the rest is in the file and in the report."""
    for blunder in file.blunders:
        console.print(f"fault of the file: {blunder.says}", highlight=False, markup=False)
    console.print(f"\n[bold]{verdict_words(file)}[/bold]", highlight=False)
    for number, finding in enumerate(file.findings, start=1):
        for line in _finding(number, finding):
            console.print(line, highlight=False, markup=False)
    for line in _changes(file):
        console.print(line, highlight=False, markup=False)
    for line in _doubt(file):
        console.print(line, highlight=False, markup=False)
    if file.splits:
        console.print(_proof(file))
    for one in file.incomplete:
        console.print(f"not completed: {one.stage}: {one.reason}", highlight=False, markup=False)
    for line in file.next:
        console.print(f"next: {line}", highlight=False, markup=False)


def _finding(number: int, finding: FindingRecord) -> Iterator[str]:
    yield f"{number}. {finding.says}"
    found = f"in the stream of {finding.stream}"
    if finding.share is not None:
        found = f"{100 * finding.share:.0f} % of what was found"
    yield f"   {place_words(finding)}; {found}; confidence {finding.confidence:.3f}"
    for rival in finding.rivals:
        yield f"   or: {rival_words(rival)}"


def _changes(file: DiagnosisFile) -> Iterator[str]:
    """Beside a model: which of its values are others now, and which of its effects took no part."""
    for one in file.changed:
        known = "" if one.known is None else f" (known: {one.known:.6g})"
        yield f"changed: {one.parameter} by {one.by:+.3g} ± {one.sigma:.2g}{known}"
    if file.known is not None and file.known.left_out:
        yield f"not applied, true of another recording only: {', '.join(file.known.left_out)}"


def _doubt(file: DiagnosisFile) -> Iterator[str]:
    for one in (u for u in (file.unexplained, *file.also_unexplained) if u is not None):
        where = f" at {one.where}" if one.where else ""
        yield f"unexplained{where}: {one.says}"
    if file.free_space is not None:
        yield free_space_words(file.free_space)
    yield from stream_words(file)
    for missing in file.not_recorded[:MOST]:
        yield f"not recorded: {missing.column} (without it no word about {missing.physics})"


def _proof(file: DiagnosisFile) -> Table:
    table = Table(title="on samples that the fit has not seen (rms)", title_justify="left")
    for heading in ("left out", "instrument", "samples", "geometry alone", "with the physics", "floor"):
        table.add_column(heading, justify="left" if heading in ("left out", "instrument") else "right")
    floors = {f.instrument: f.rms_m for f in file.floors}
    for split in file.splits:
        before, after = before_after(split)
        floor = floors.get(split.instrument)
        table.add_row(
            split.split,
            split.instrument,
            str(split.observations),
            before,
            after,
            micrometres(floor),
        )
    return table


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
