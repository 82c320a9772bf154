"""An identified arm as a person reads it in a terminal: blunders, rank, then numbers, each with its doubt."""

import numpy as np
from rich.console import Console
from rich.table import Table

from calibrate.identification.result import Identification
from calibrate.uncertainty.chi_square import Alarm
from calibrate.zeros.result import Estimate


def print_identification(console: Console, result: Identification) -> None:
    """What was wrong with the file comes first, since all that follows is without these rows."""
    for blunder in result.blunders:
        console.print(f"left out: {blunder.says}", highlight=False, markup=False)
    seen = result.identifiability
    names = ", ".join(f"{i.name} ({i.observations})" for i in result.instruments)
    console.print(f"{names}: {result.n_samples} samples, rank {seen.rank} of {seen.n_free} unknowns", highlight=False)
    for combination in seen.combinations:
        about = "" if len(combination.members) > 1 else f"{combination.words}: "
        console.print(f"  {about}{combination.says}", highlight=False, markup=False)
    _print_estimates(console, result.estimates)
    _print_figures(console, result)
    console.print(f"{result.status.name}: {result.status.value}", highlight=False)


def _print_estimates(console: Console, estimates: tuple[Estimate, ...]) -> None:
    known = [(e.name, e.unit, e.value, e.sigma) for e in estimates if e.value is not None and e.sigma is not None]
    if not known:
        console.print("no single parameter can be told alone; together they predict (model.json: chain)")
        return
    table = Table()
    for heading in ("parameter", "correction", "sigma", "unit"):
        table.add_column(heading, justify="right")
    for name, unit, value, sigma in known:
        small = {"m": "um", "rad": "urad"}.get(unit)
        factor = 1e6 if small else 1.0
        table.add_row(name, f"{factor * value:+.2f}", f"{factor * sigma:.2f}", small or unit)
    console.print(table)


def _print_figures(console: Console, result: Identification) -> None:
    for one in result.instruments:
        console.print(
            f"{one.name}: {1e3 * one.rms_before:.4g} mm rms with the arm as drawn, {1e3 * one.rms_after:.4g} mm after",
            highlight=False,
        )
    for unseen in result.held_out:
        console.print(
            f"held out ({unseen.split}): {unseen.name}, {unseen.observations} rows, {1e3 * unseen.rms_before:.4g} mm "
            f"rms before, {1e3 * unseen.rms_after:.4g} mm after",
            highlight=False,
        )
    for noise in result.noise:
        found, believed = 1e6 * noise.found, 1e6 * noise.believed
        console.print(f"noise of {noise.source}: {found:.3g}e-6 found, {believed:.3g}e-6 believed", highlight=False)
    stated = result.stated_noise
    if stated.alarm is not Alarm.NONE:
        factor = "" if np.isnan(stated.noise_factor) else f" ({stated.noise_factor:.3g} times)"
        console.print(f"chi-square: {stated.alarm.value}{factor}", highlight=False)
