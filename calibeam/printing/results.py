"""A diagnosis in a terminal: verdict, causes with their size, proof, uncertainty, what to do next; and the end of a
calibration in ten lines.
"""

from collections.abc import Iterator

from rich.table import Table

from acquisition.recording.examination import not_examined, not_examined_lines
from acquisition.recording.recording_examinations import READINGS
from calibeam.console import Console
from calibrate.diagnose.record.schema import ClockRecord, DiagnosisFile, FindingRecord, TorquesRecord, of_poses
from calibrate.model.effects.term import with_sigma
from calibrate.report.diagnosis import (
    SPLITS,
    before_after,
    free_space_words,
    limit_words,
    micrometres,
    missing_lines,
    noise_words,
    place_words,
    rival_words,
    stream_words,
    verdict_words,
)
from calibrate.report.elements.verdict import Answers

MOST = 8  # of what is of less weight; all of it stands in the file


def print_diagnosis(console: Console, file: DiagnosisFile, *, verbose: bool = False) -> None:
    """Verdict first, then what decides; `verbose`: all causes and alternatives, clocks, what was not recorded, the
    proof.
    """
    console.print(verdict_words(file), style="bold", highlight=False)
    if verbose:
        _print_details(console, file)
        return
    for line in _brief(file):
        console.print(line, highlight=False, markup=False)


FEW, CAUSES, RIVALS = 2, 3, 1  # of a kind, of causes, of other names for one


def _brief(file: DiagnosisFile) -> Iterator[str]:
    """Causes with their best alternative, what is unexplained, unseen rows before and after, what to do next."""
    yield from _few([f"fault of the file: {gross_error.says}" for gross_error in file.blunders])
    for number, finding in enumerate(file.findings[:CAUSES], start=1):
        yield from list(_finding(number, finding))[: 2 + RIVALS]
    if len(file.findings) > CAUSES:
        yield f"and {len(file.findings) - CAUSES} more causes: --verbose"
    yield from _few(list(_changes(file)))
    for one in (u for u in (file.unexplained, *file.also_unexplained) if u is not None):
        yield f"unexplained{f' at {one.where}' if one.where else ''}: {one.says}"
    if file.free_space is not None:
        yield free_space_words(file.free_space)
    floors = {f.instrument: f.rms_m for f in file.floors}
    for split in file.splits:
        before, after = before_after(split)
        of = f", {split.instrument}" if len(floors) > 1 else ""
        yield (
            f"unseen rows ({SPLITS.get(split.split, split.split)}){of}, rms of a coordinate: {before} geometry alone, "
            f"{after} with the physics; noise floor {micrometres(floors.get(split.instrument))}"
        )
    yield from _few([f"noise: {line}" for line in noise_words(file)])
    yield from limit_words(file)
    yield from _few([f"not completed: {one.stage}: {one.reason}" for one in file.incomplete])
    left = not_examined(file.examinations)
    yield from _few(list(not_examined_lines([one for one in left if one.expected])))
    if others := dict.fromkeys(one.what for one in left if not one.expected):
        yield f"not recorded, and not examined: {', '.join(others)} (--verbose)"
    yield from _few(missing_lines(file))
    yield from _few([f"next: {line}" for line in file.next])


def calibration_lines(answers: Answers, diagnosis: DiagnosisFile | None, kept: str) -> Iterator[str]:
    """`kept`: which model was kept, and why."""
    judged = answers.verdict
    yield judged.sentence
    yield f"trust: {judged.trust.value}"
    yield from (f"  {reason}" for reason in judged.reasons[:FEW])
    found = () if diagnosis is None else of_poses(diagnosis)
    for number, one in enumerate(found[:CAUSES], start=1):
        yield f"{number}. {one.says} (confidence {one.confidence:.2f})"
    if len(found) > CAUSES:
        yield f"and {len(found) - CAUSES} more causes: in the report"
    yield kept
    yield from (f"to do: {advice}" for advice in judged.advice[:1])


def unseen_words(file: DiagnosisFile) -> str:
    """Of each way to leave rows out, what both models miss of them."""
    several = len({split.instrument for split in file.splits}) > 1
    each = ((split, *before_after(split)) for split in file.splits)
    parts = (
        f"{SPLITS.get(split.split, split.split)}{f', {split.instrument}' if several else ''}: {before} with the "
        f"geometry alone, {after} with the physics"
        for split, before, after in each
    )
    return f"unseen rows, rms of a coordinate: {'; '.join(parts)}"


def _few(lines: list[str]) -> Iterator[str]:
    """The first ones, and how many more there are."""
    yield from lines[:FEW]
    if len(lines) > FEW:
        yield f"  and {len(lines) - FEW} more: --verbose"


def _print_details(console: Console, file: DiagnosisFile) -> None:
    """Everything; the figures are in the report."""
    for gross_error in file.blunders:
        console.print(f"fault of the file: {gross_error.says}", highlight=False, markup=False)
    for number, finding in enumerate(file.findings, start=1):
        for line in _finding(number, finding):
            console.print(line, highlight=False, markup=False)
    for line in _changes(file):
        console.print(line, highlight=False, markup=False)
    for line in noise_words(file):
        console.print(f"noise: {line}", highlight=False, markup=False)
    for line in _reasons_for_care(file):
        console.print(line, highlight=False, markup=False)
    if file.splits:
        console.print(_proof(file))
    _print_torques(console, file)
    for one in file.incomplete:
        console.print(f"not completed: {one.stage}: {one.reason}", highlight=False, markup=False)
    for line in not_examined_lines(file.examinations):
        console.print(line, highlight=False, markup=False)
    for line in file.next:
        console.print(f"next: {line}", highlight=False, markup=False)


def print_streams(console: Console, file: DiagnosisFile) -> None:
    """Of a recording without samples: each clock with its uncertainty, findings, and what the streams do not show."""
    console.print(f"\n{verdict_words(file)}", style="bold", highlight=False)
    lines = [line for number, finding in enumerate(file.findings, start=1) for line in _finding(number, finding)]
    if file.streams is not None:
        lines += [line for clock in file.streams.clocks for line in _clock(clock)]
        lines += [f"usual: {one.says}" for one in file.streams.usual]
    for line in lines:
        console.print(line, highlight=False, markup=False)
    _print_torques(console, file)
    failed = (f"not completed: {one.stage}: {one.reason}" for one in file.incomplete)
    ends = not_examined_lines(file.examinations)
    readings = (f"{one.what}: {one.says}" for one in file.examinations if one.what == READINGS.what and one.says)
    for line in (*_unexplained(file), *readings, *failed, *ends, *(f"next: {says}" for says in file.next)):
        console.print(line, highlight=False, markup=False)


def _print_torques(console: Console, file: DiagnosisFile) -> None:
    if file.torques is not None:
        console.print(_torques(file.torques))
        console.print(file.torques.made, highlight=False, markup=False)


def _torques(found: TorquesRecord) -> Table:
    table = Table(title="torque on the end of the motion, unseen (Nm rms)", title_justify="left")
    for heading in ("joint", "moments", "torque", "links alone", "with the physics", "noise"):
        table.add_column(heading, justify="right")
    for one in found.joints:
        sizes = (one.torque_nm, one.unseen_before_nm, one.unseen_after_nm, one.noise_nm)
        cells = ["-" if size is None else f"{size:.3g}" for size in sizes]
        table.add_row(str(one.joint), str(one.moments), *cells)
    return table


def _clock(clock: ClockRecord) -> Iterator[str]:
    """Joints' clock less that of the stream."""
    if clock.offset_s is None or clock.offset_sigma_s is None:
        yield f"clock of {clock.stream}: {clock.status}"
        return
    line = f"clock of {clock.stream}: joints' clock {1e3 * clock.offset_s:+z.3f} ± {1e3 * clock.offset_sigma_s:.3f} ms"
    if clock.drift is not None and clock.drift_sigma is not None:
        line += f", drift {1e6 * clock.drift:+z.1f} ± {1e6 * clock.drift_sigma:.1f} µs/s"
    yield f"{line}, at {clock.middle_s:.1f} s"


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
        yield f"changed: {one.parameter} by {with_sigma(one.by, one.sigma)}{known}"
    if file.known is not None and file.known.left_out:
        yield f"not applied, true of another recording only: {', '.join(file.known.left_out)}"


def _reasons_for_care(file: DiagnosisFile) -> Iterator[str]:
    yield from _unexplained(file)
    if file.free_space is not None:
        yield free_space_words(file.free_space)
    yield from stream_words(file)
    yield from missing_lines(file)[:MOST]


def _unexplained(file: DiagnosisFile) -> Iterator[str]:
    for one in (u for u in (file.unexplained, *file.also_unexplained) if u is not None):
        where = f" at {one.where}" if one.where else ""
        yield f"unexplained{where}: {one.says}"


def _proof(file: DiagnosisFile) -> Table:
    table = Table(title="on samples that the fit has not seen (rms of a coordinate)", title_justify="left")
    for heading in ("left out", "instrument", "samples", "geometry alone", "with the physics", "noise floor"):
        table.add_column(heading, justify="left" if heading in ("left out", "instrument") else "right")
    floors = {f.instrument: f.rms_m for f in file.floors}
    for split in file.splits:
        before, after = before_after(split)
        floor = floors.get(split.instrument)
        table.add_row(
            SPLITS.get(split.split, split.split),
            split.instrument,
            str(split.observations),
            before,
            after,
            micrometres(floor),
        )
    return table
