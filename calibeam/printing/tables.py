"""An error simulation as a person reads it in a terminal."""

import numpy as np
from rich.console import Console
from rich.table import Table

from calibrate.error_simulation.record import SHARE
from calibrate.error_simulation.simulate import Simulation
from calibrate.report.quantities import length

SHOWN = 15


def print_simulation(console: Console, s: Simulation) -> None:
    """Budget, linear beside drawn, the most important errors, worst postures."""
    rms = float(np.sqrt(np.mean(s.wide.rms_m**2)))
    console.print(
        f"{s.machine.name}: {len(s.sources)} errors; probe error {length(rms)} rms over {len(s.wide_rad)} poses of the "
        "workspace, three axes together",
        highlight=False,
        markup=False,
    )
    _print_budget(console, s)
    _print_poses(console, s)
    _print_ranking(console, s)
    if not s.worst:
        console.print("no worst posture: none of these errors moves the probe", highlight=False, markup=False)
    for p in s.worst:
        joints = ", ".join(f"{np.degrees(q):.0f}" for q in p.q_rad)
        console.print(f"worst posture: {length(p.rms_m)} rms at ({joints}) deg", highlight=False, markup=False)


def _errors_table(title: str, *headings: str) -> Table:
    table = Table(title=title, title_justify="left", box=None)
    for i, heading in enumerate(headings):
        table.add_column(heading, justify="left" if i == 0 else "right")
    return table


def _print_budget(console: Console, s: Simulation) -> None:
    table = _errors_table(
        "error budget, each group alone over the workspace", "group", "errors", "rms", "share of variance"
    )
    for line in s.budget:
        table.add_row(line.group, str(line.sources), length(line.rms_m), f"{100.0 * line.share:.2f} %")
    console.print(table)


def _print_poses(console: Console, s: Simulation) -> None:
    title = f"linear propagation beside {s.drawn.arms:,} drawn arms at every pose"
    table = _errors_table(title, "pose", "linear rms", "drawn rms", "linear sigma x y z, µm", "drawn, µm", "95 % below")
    p95 = s.drawn.quantile_m(SHARE)
    for i in range(len(s.drawn_at_rad)):
        sigmas = (" ".join(f"{1e6 * v:.1f}" for v in values[i]) for values in (s.linear.sigma_m, s.drawn.sigma_m))
        rms = (length(float(values[i]), 4) for values in (s.linear.rms_m, s.drawn.rms_m))
        table.add_row(str(i + 1), *rms, *sigmas, length(float(p95[i])))
    console.print(table)


def _print_ranking(console: Console, s: Simulation) -> None:
    title = (
        f"the {min(SHOWN, len(s.sources))} most important errors: shares of the variance, linear over "
        f"{len(s.wide_rad)} poses, Sobol indices over {s.shares.poses} of them"
    )
    table = _errors_table(title, "error", "alone, rms", "linear", "first order", "total")
    for i in s.ranking[:SHOWN]:
        table.add_row(
            s.sources[i].name,
            length(float(s.wide.alone_m[i])),
            f"{100.0 * s.wide.shares[i]:.2f} %",
            f"{100.0 * s.shares.first[i]:.2f} ± {100.0 * s.shares.first_sigma[i]:.2f} %",
            f"{100.0 * s.shares.total[i]:.2f} ± {100.0 * s.shares.total_sigma[i]:.2f} %",
        )
    console.print(table)
