"""A comparison and a reconciliation in a terminal: the verdict, the differences, what was left out, what remains."""

from collections.abc import Iterator, Sequence
from itertools import groupby

from rich.table import Table
from rich.text import Text

from acquisition.recording.examination import ExaminationRecord, not_examined, not_examined_lines
from calibeam.console import Console
from calibeam.printing.results import print_diagnosis
from calibrate.compare import comparison_file
from calibrate.compare.comparison_file import (
    ComparedTorques,
    ComparisonFile,
    DifferenceRecord,
    DroppedRecord,
    Level,
    ReadingRecord,
    StreamRecord,
    in_words,
)
from calibrate.compare.link_differs import JudgedLink
from calibrate.compare.reconciled_rows import ReconcileFile
from calibrate.compare.rig_and_streams import SAYS
from calibrate.model.effects.term import Size, with_sigma
from calibrate.quantities import length, significant

FEW = 3  # alternatives of one
CAUSES = frozenset(level.value for level in comparison_file.CAUSES)
SHORT = (Level.JOINT_ZEROS.value, Level.LINKS.value)


def print_comparison(console: Console, file: ComparisonFile, *, verbose: bool = False) -> None:
    """The verdict first, then every cause, then constants; `verbose`: also alternatives of constants, the readings, the
    links of the chain, the streams and the diagnosis of what differs.
    """
    console.print(Text.assemble((file.verdict, "bold"), f": {file.says}"), highlight=False)
    if file.torques is None or file.matched:
        console.print(_rows(file), highlight=False)
    for line in (*_causes(file), *_constants(file), *_dropped(file.dropped)):
        console.print(line, highlight=False, markup=False)
    for note in file.notes:
        console.print(note, highlight=False, markup=False)
    for line in _not_examined(file.examinations, verbose=verbose):
        console.print(line, highlight=False, markup=False)
    if file.torques is not None:
        console.print(_torques(file.torques))
        console.print(file.torques.made, highlight=False, markup=False)
    if verbose:
        _print_details(console, file)


def _torques(found: ComparedTorques) -> Table:
    table = Table(title="torque over the moments at which a joint turns (Nm rms)", title_justify="left")
    for heading in ("joint", "moments", "measured", "simulated", "difference", "with what was found", "noise"):
        table.add_column(heading, justify="right")
    for one in found.joints:
        sizes = (one.measured_nm, one.simulated_nm, one.difference_nm, one.left_nm, one.noise_nm)
        table.add_row(str(one.joint), str(one.moments), *(f"{size:.3g}" for size in sizes))
    return table


def _print_details(console: Console, file: ComparisonFile) -> None:
    for one in file.differences:
        if one.alternatives and one.level not in CAUSES:
            console.print(f"{one.where}: {_alternatives(one)}", highlight=False, markup=False)
    console.print(_readings(file.readings))
    console.print(_chain(file.links))
    if file.streams:
        console.print(_streams(file.streams))
    if file.diagnosis is not None:
        console.print(
            "\nphysics sought beside the simulation's geometry, the constants above refitted:", highlight=False
        )
        print_diagnosis(console, file.diagnosis)


def _causes(file: ComparisonFile) -> Iterator[str]:
    """All of them: what is one of many differences is seldom the least."""
    found = (one for one in file.differences if one.decides and one.level in CAUSES)
    for number, one in enumerate(found, start=1):
        yield f"{number}. {one.says}{_simulated(one)}"
        if one.alternatives:
            yield f"   {_alternatives(one)}"


def _alternatives(one: DifferenceRecord) -> str:
    listed = ", ".join(f"{a.physics} at {a.where}" for a in one.alternatives[:FEW])
    more = "" if len(one.alternatives) <= FEW else f" and {len(one.alternatives) - FEW} more"
    return f"alternative: {listed}{more}"


def _constants(file: ComparisonFile) -> Iterator[str]:
    """One line a level, in the order of the file, where the target on the flange is last; then what is no mismatch."""
    rest = [one for one in file.differences if one.decides and one.level not in CAUSES]
    for level, found in groupby(rest, key=lambda one: one.level):
        yield f"{level.replace('-', ' ')}: {'; '.join(_short(one) + _simulated(one) for one in found)}"
    if anew := [_short(one) for one in file.differences if not one.decides]:
        yield f"set up or stated otherwise, no mismatch: {'; '.join(anew)}"


def _short(one: DifferenceRecord) -> str:
    """Place and size; of a frame and of a rig key the sentence."""
    if one.level not in SHORT:
        return one.says
    (size,) = (in_words(name, Size(s.value or 0.0, s.sigma or 0.0)) for name, s in one.sizes.items())
    return f"{one.where.removesuffix('.angle')} {size}"


def _simulated(one: DifferenceRecord) -> str:
    listed = ", ".join(f"{name} {value:.6g}" for name, value in one.simulated.items())
    return f" (in the simulation: {listed})" if listed else ""


def _dropped(dropped: tuple[DroppedRecord, ...]) -> Iterator[str]:
    if dropped:
        listed = ", ".join(name for one in dropped for name in one.sizes)
        yield f"no difference found, which the sigmas allow for (sizes in the file): {listed}"


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


def _chain(links: tuple[JudgedLink, ...]) -> Table:
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
    console.print(Text.assemble((file.verdict, "bold"), f": {file.says}"), highlight=False)
    for one in file.unseen:
        parts = (
            f"{what} {length(value)} ({significant(over)} times the noise)"
            for what, value, over in (
                ("before", one.before_m, one.before),
                ("after geometry", one.geometry_m, one.geometry),
                ("after physics", one.after_m, one.after),
            )
        )
        stated = "" if one.stated_m is None else f"; stated noise {length(one.stated_m)}"
        _say(console, f"{one.instrument}, {one.rows} unseen rows, rms: " + ", ".join(parts) + stated)
    for line in _torque_lines(file):
        _say(console, line)
    _list(console, "what the simulation lacks:", [one.says for one in file.left_out])
    _list(console, "what remains:", file.remains)
    for line in _not_examined(file.examinations):
        _say(console, line)
    _list(console, "what to do next:", file.next if file.remains else ())


def _not_examined(records: Sequence[ExaminationRecord], *, verbose: bool = False) -> Iterator[str]:
    """What rig and recordings allow and what did not take place; `verbose`: the rest, too."""
    yield from not_examined_lines([one for one in not_examined(records) if one.expected or verbose])


def _torque_lines(file: ReconcileFile) -> Iterator[str]:
    """One a joint: the torque that is left on the unseen part of a motion, and how far a replay is off."""
    for one in file.torques:
        left = [("before", one.before_nm), ("links fitted", one.links_nm), ("with the physics", one.after_nm)]
        torque = ", ".join(f"{what} {significant(size)}" for what, size in left if size is not None)
        line = (
            f"joint {one.joint}, Nm rms of {significant(one.torque_nm)}: {torque} (noise {significant(one.noise_nm)})"
        )
        off = [one.tracking_before_rad, one.tracking_links_rad, one.tracking_after_rad]
        replayed = ", ".join(significant(1e3 * size) for size in off if size is not None)
        yield f"{line}; replay {replayed} mrad" if replayed else line


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
