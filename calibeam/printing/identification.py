"""An identified arm in a terminal: gross errors, alarms, rank, numbers with their uncertainty, proofs, verdict.

The verdict is the first sentence of the report. A model that was refitted by --model is printed here, too.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from rich.table import Table

from calibeam.console import Console
from calibrate.apply.export import cells, nominal_table
from calibrate.fit.fit_plan import ZEROS_ONLY_COMMAND
from calibrate.fit.identify.estimates import ONLY_ASSUMED, JointZero
from calibrate.fit.identify.point_constraint import PointConstraints
from calibrate.fit.identify.record import parameter_records
from calibrate.fit.identify.result import (
    Evidence,
    FreeSpace,
    HeldOutError,
    Identification,
)
from calibrate.fit.rank import Observability
from calibrate.model.default_tolerance import said_of
from calibrate.model.effect_records import EffectRecord
from calibrate.model.effects.term import Size, decimals_of, plain
from calibrate.model.model_file import ModelFile, ModelParameter
from calibrate.model.sensors import spots
from calibrate.model.sensors.catalogue import SENSORS, thousandth_of
from calibrate.quantities import (
    angle,
    counted,
    length,
    significant,
)
from calibrate.report.elements.verdict import (
    TOOL,
    Answers,
    Number,
    Trust,
    VerdictBox,
)
from calibrate.report.evidence import SessionEvidence, fit_end, session_verdict
from calibrate.report.workspace import session_room, tool_numbers

COLOUR = {Trust.GOOD: "green", Trust.CARE: "yellow", Trust.NONE: "red"}


def print_verdict(console: Console, judged: VerdictBox) -> None:
    """How far to trust what was found, and every reason for care."""
    console.print(judged.sentence, style=f"bold {COLOUR[judged.trust]}", highlight=False, markup=False)
    console.print(f"trust: {judged.trust.value}", highlight=False, markup=False)
    for reason in judged.reasons:
        console.print(f"  {reason}", highlight=False, markup=False)


def tool_lines(numbers: Sequence[Number]) -> Iterator[str]:
    """The tool error over the workspace: nominal, calibrated, with physics; or why there is none."""
    tool = [number for number in numbers if number.key.startswith(TOOL)]
    if not tool:
        return
    if tool[0].value is None:
        yield f"tool error over the workspace {tool[0].about}"
        return
    yield f"tool error over the workspace: {', '.join(f'{number.said} {number.name}' for number in tool)}"
    yield f"  {tool[-1].about}"


def verdict_words(answers: Answers) -> Iterator[str]:
    """The first screen of a report in a few lines: verdict, tool error, drift, what to do."""
    yield answers.verdict.sentence
    yield f"trust: {answers.verdict.trust.value}"
    yield from (f"  {reason}" for reason in answers.verdict.reasons)
    yield from tool_lines(answers.numbers)
    yield from answers.warnings
    if answers.drift:
        yield answers.drift
    yield from (f"to do: {advice}" for advice in answers.verdict.advice)


def evidence_lines(evidence: Evidence) -> list[str]:
    """Held-out error, observability, workspace, bootstrap; what was not asked for is left out."""
    out = [_held_out(unseen) for unseen in evidence.proven.held_out]
    out += [f"no proof ({why})" for why in evidence.proven.unproven]
    if evidence.observability is not None:
        out.append(_observability(evidence.observability))
    if evidence.free_space is not None:
        out += _free_space(evidence.free_space)
    if evidence.bootstrap is not None:
        drawn = evidence.bootstrap
        out.append(f"bootstrap: {len(drawn.theta)} refits to drawn rows, {drawn.failed} more without an answer")
    return out


def _held_out(unseen: HeldOutError) -> str:
    return (
        f"held out ({unseen.split}): {unseen.name}, {unseen.observations} rows, "
        f"{1e3 * unseen.rms_distance_before_m:.4g} {thousandth_of(unseen.name)} rms distance before, "
        f"{1e3 * unseen.rms_distance_after_m:.4g} {thousandth_of(unseen.name)} after"
    )


def _observability(shown: Observability) -> str:
    indices = ", ".join(f"O{i} {v:.3g}" for i, v in enumerate((shown.o1, shown.o2, shown.o3, shown.o4, shown.o5), 1))
    well = "" if shown.well_conditioned else " (usual limit 100: other poses would determine more)"
    return f"observability of {shown.n_free} parameters: {indices}, condition {shown.condition:.3g}{well}"


def _free_space(room: FreeSpace) -> list[str]:
    one, pose = room.geometry, room.pose
    if one.rms_m is None or one.p95_m is None or one.max_m is None:
        return [
            f"tool error between the joint limits: {one.status.value}",
            *(f"  {words}" for words in one.undetermined),
        ]
    out = [
        f"tool error between the joint limits, {room.poses} poses drawn evenly: "
        f"{1e3 * one.rms_m:.3g} mm rms, {1e3 * one.p95_m:.3g} mm at 95 %, {1e3 * one.max_m:.3g} mm at most "
        "(one sigma of the calibrated geometry)"
    ]
    if pose.rms_m is not None and pose.p95_m is not None and pose.max_m is not None:
        out.append(
            f"  of a single pose: {1e3 * pose.rms_m:.3g} mm rms, {1e3 * pose.p95_m:.3g} mm at 95 %, "
            f"{1e3 * pose.max_m:.3g} mm at most, with {room.scatter_says}"
        )
    if one.guessed:
        out.append(f"  known no better than their plausible size: {'; '.join(one.guessed)}")
    return out


UNITS = {"m": ("um", 1e6), "rad": ("urad", 1e6)}


MOST = 2  # of what is listed one by one; the rest is counted
SEE = "--verbose lists them"


def print_identification(
    console: Console, result: Identification, evidence: SessionEvidence, *, verbose: bool = False
) -> None:
    """Verdict first, then what a person acts on; `verbose`: rank, every parameter, second methods, observability."""
    rig = evidence.recording.rig
    print_verdict(console, session_verdict(evidence))
    for line in tool_lines(tuple(tool_numbers(session_room(evidence)))):
        console.print(line, highlight=False, markup=False)
    of_spots = any(one.name == spots.KIND.name for one in result.instruments)
    if of_spots and (assumed := said_of(rig)) is not None:
        console.print(assumed, highlight=False, markup=False)
    if verbose:
        _print_details(console, result, of_spots=of_spots)
        _print_arm(console, evidence)
        if (end := fit_end(evidence.model)) is not None:
            says = f"fit by {end[0]}: {counted(end[1], 'iteration')} in all rounds, ended by {end[2]}"
            console.print(says, highlight=False, markup=False)
        return
    for line in _brief(result):
        console.print(line, highlight=False, markup=False)


def _brief(result: Identification) -> Iterator[str]:
    """What was left out, the proof, joint zeros, and how much more there is."""
    for listed in ([f"left out: {b.says}" for b in result.blunders], [f"ALARM: {says}" for says in result.alarms]):
        yield from listed[:MOST]
        if len(listed) > MOST:
            yield f"  and {len(listed) - MOST} more: {SEE}"
    for one in result.evidence.proven.held_out:
        says, of = angle if one.name in IN_RAD else length, f", {one.name}" if len(result.instruments) > 1 else ""
        yield (
            f"unseen rows ({one.split}){of}: {says(one.rms_distance_before_m)} nominal, "
            f"{says(one.rms_distance_after_m)} calibrated"
        )
    listed = parameter_records(result.estimates, result.identifiability, result.evidence.bootstrap)
    known = [(p.name, p.value, p.sigma) for p in listed if p.value is not None and p.sigma is not None]
    zeros = [one for one in known if _of_joint(one[0])]
    for name, zero_rad, sigma_rad in zeros:
        sigma_deg = np.degrees(sigma_rad)
        value = f"{np.degrees(zero_rad):+z.{decimals_of(sigma_deg)}f}° ± {sigma_deg:.{decimals_of(sigma_deg)}f}°"
        yield f"  J{name.removeprefix('joint').removesuffix(ZERO)} zero {value} (± {angle(sigma_rad, 2)})"
    if more := len(known) - len(zeros):
        verb = "is" if more == 1 else "are"
        yield f"{counted(more, 'more parameter')} {verb} determined: {SEE}; all are in the model"
    missing = [p.name for p in listed if p.value is None]
    if missing:
        shown = ", ".join(missing[:NAMED]) + (f" and {len(missing) - NAMED} more" if len(missing) > NAMED else "")
        yield f"not determined: {shown} (why: --verbose)"
    if sum(map(_of_joint, missing)) > len(zeros) and any(name.startswith("link") for name, *_ in known):
        yield ZEROS_ONLY_COMMAND


NAMED = 4  # undetermined parameters
ZERO = ".zero"
IN_RAD = {kind.name for kind in SENSORS if kind.quantities[0].unit == "rad"}


def _print_details(console: Console, result: Identification, *, of_spots: bool) -> None:
    """What was wrong with the file comes first, since all that follows is without these rows."""
    for gross_error in result.blunders:
        console.print(f"left out: {gross_error.says}", highlight=False, markup=False)
    for alarm in result.alarms:
        console.print(f"ALARM: {alarm}", style="bold red", highlight=False, markup=False)
    seen = result.identifiability
    names = ", ".join(f"{i.name} ({i.observations})" for i in result.instruments)
    console.print(
        f"{names}: {counted(result.n_samples, 'sample')}, rank {seen.rank} of {seen.n_free} unknowns, "
        f"condition {seen.condition:.3g}",
        highlight=False,
    )
    for combination in seen.combinations:
        about = "" if len(combination.members) > 1 else f"{combination.words}: "
        console.print(f"  {about}{combination.says}", highlight=False, markup=False)
    assumed = [e.name for e in result.estimates if e.why is not None and e.why.startswith(ONLY_ASSUMED)]
    if assumed:
        console.print(
            f"  determined by the assumed tolerances only: {', '.join(assumed)}", highlight=False, markup=False
        )
    if of_spots:
        _print_zeros(console, result.zeros)
    listed = parameter_records(result.estimates, seen, result.evidence.bootstrap)
    _print_parameters(console, tuple(p for p in listed if not (of_spots and _of_joint(p.name))))
    if result.point_constraints is not None:
        _print_point_constraints(console, result.point_constraints)
    for line in (*_figures(result), *evidence_lines(result.evidence)):
        console.print(line, highlight=False, markup=False)


def _of_joint(name: str) -> bool:
    """Whether it is the zero of a joint; second encoders have zeros of their own."""
    return name.startswith("joint") and name.endswith(ZERO)


def _print_parameters(console: Console, parameters: tuple[ModelParameter, ...]) -> None:
    known = [p for p in parameters if p.value is not None]
    if not known:
        console.print("no single parameter is determined alone; together they predict (model.json: chain)")
        return
    _print_table(console, ("correction", "sigma", "predicted", "95 %"), known, _by_covariance)
    drawn = [p for p in known if p.bootstrap_sigma is not None]
    if drawn:
        _print_table(console, ("bootstrap sigma", "bootstrap 95 %"), drawn, _by_bootstrap)


def _print_arm(console: Console, evidence: SessionEvidence) -> None:
    """Nominal, correction, calibrated of every joint and link number."""
    table = Table(title="D-H table: nominal, correction, calibrated", title_justify="left")
    for heading in ("number", "nominal", "correction", "sigma", "calibrated"):
        table.add_column(heading, justify="right")
    shown = [cells(row) for row in nominal_table(evidence.calibrated_arm)]
    for row in shown:
        table.add_row(*(row if len(row) == len(table.columns) else (*row[:2], "-", "-", "-")))
    console.print(table)
    for name, _, *why in (row for row in shown if len(row) < len(table.columns)):
        console.print(f"  {name.partition(' ')[0]} {why[0]}", highlight=False, markup=False)


def _print_zeros(console: Console, zeros: tuple[JointZero, ...]) -> None:
    """Of a session with spots, which is made for them; true angle = reading + zero."""
    table = Table()
    for heading in ("joint", "zero (deg)", "sigma (deg)", "sigma (µrad)", "measurement alone (µrad)"):
        table.add_column(heading, justify="right")
    for zero in zeros:
        if zero.value_rad is None or zero.sigma_rad is None:
            table.add_row(f"J{zero.joint}", "not determined", "-", "-", "-")
            continue
        alone = "-" if zero.measurement_sigma_rad is None else significant(1e6 * zero.measurement_sigma_rad, 2)
        decimals = decimals_of(np.degrees(zero.sigma_rad))
        degrees, sigma = (f"{np.degrees(v):z.{decimals}f}" for v in (zero.value_rad, zero.sigma_rad))
        table.add_row(f"J{zero.joint}", degrees, sigma, significant(1e6 * zero.sigma_rad, 2), alone)
    console.print(table)
    for zero in zeros:
        if zero.value_rad is None:
            console.print(f"  J{zero.joint} not determined: {zero.why}", highlight=False, markup=False)


def _print_point_constraints(console: Console, found: PointConstraints) -> None:
    """The method beside the fit, in both forms."""
    console.print("\nfor comparison: point constraint, Deng, Ding, Zhang 2019; links and laser nominal")
    at = f"at station {found.placement}"
    forms = (
        (f"four poses {at}, as published", found.four_poses),
        (f"all {found.poses} centred poses {at}", found.all_poses),
    )
    for says, result in forms:
        seen = result.identifiability
        console.print(f"{says}: rank {seen.rank} of {seen.n_free} unknowns", highlight=False)
        _print_zeros(console, result.zeros)


def _print_table(
    console: Console,
    headings: tuple[str, ...],
    parameters: list[ModelParameter],
    cells: Callable[[ModelParameter, float], list[str]],
) -> None:
    table = Table()
    for heading in ("parameter", *headings, "unit"):
        table.add_column(heading, justify="right")
    for p in parameters:
        unit, factor = UNITS.get(p.unit, (p.unit, 1.0))
        table.add_row(p.name, *cells(p, factor), unit)
    console.print(table)


def _by_covariance(p: ModelParameter, factor: float) -> list[str]:
    return [
        _cell(p.value, factor, p.sigma, "+"),
        _cell(p.sigma, factor, p.sigma),
        _cell(p.predicted_sigma, factor, p.predicted_sigma),
        _interval(p.low, p.high, factor, p.sigma),
    ]


def _by_bootstrap(p: ModelParameter, factor: float) -> list[str]:
    sigma = p.bootstrap_sigma
    return [_cell(sigma, factor, sigma), _interval(p.bootstrap_low, p.bootstrap_high, factor, sigma)]


def _interval(low: float | None, high: float | None, factor: float, sigma: float | None) -> str:
    return f"{_cell(low, factor, sigma, '+')} {_cell(high, factor, sigma, '+')}"


def _cell(value: float | None, factor: float, sigma: float | None, sign: str = "") -> str:
    """To the second digit of its sigma."""
    return "-" if value is None else f"{factor * value:{sign}z.{decimals_of(factor * (sigma or 0.0))}f}"


def _figures(result: Identification) -> list[str]:
    out = [
        f"{one.name}: {1e3 * one.rms_distance_before_m:.4g} {thousandth_of(one.name)} rms distance "
        f"nominal, {1e3 * one.rms_distance_after_m:.4g} {thousandth_of(one.name)} calibrated"
        for one in result.instruments
    ]
    for noise in result.noise:
        unit = "µrad" if noise.source in ("joint", *IN_RAD) else "µm"
        found, assumed = f"{1e6 * noise.found:.3g} {unit}", f"{1e6 * noise.assumed:.3g} {unit}"
        out.append(f"noise of {noise.source}: {found} found, {assumed} stated")
    stated = result.stated_noise
    if np.isfinite(stated.p_above):
        out.append(f"chi-square under the noise as stated: {stated.chi2:.4g} at {stated.dof} degrees of freedom")
    return out


def refitted_lines(model: ModelFile) -> Iterator[str]:
    """Of `calibeam identify --model`."""
    determined = sum(p.value is not None for p in model.parameters)
    yield (
        f"{counted(model.poses, 'sample')}: {determined} of {len(model.parameters)} parameters of geometry determined, "
        f"{counted(sum(not e.after for e in model.effects), 'effect')} refitted"
    )
    yield (
        f"misfit of {model.instruments[0]}, rms distance: {length(model.rms_distance_before_m)} by geometry alone, "
        f"{length(model.rms_distance_after_m)} with the effects"
    )
    for effect in model.effects:
        if not effect.after:
            yield f"{effect.name}: {', '.join(_sizes(effect)) or 'not determined by these samples'}"


def _sizes(effect: EffectRecord) -> Iterator[str]:
    for name, size in effect.parameters.items():
        if size.value is not None and size.sigma is not None:
            yield f"{name}: {plain(name, Size(size.value, size.sigma))}"
