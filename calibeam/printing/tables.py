"""Tools found by single axes, and error simulations, in a terminal: verdict first, then values with uncertainty."""

from collections.abc import Iterator

import numpy as np
from rich.table import Table

from calibeam.console import Console
from calibrate.error_simulation import SHARE, Simulation
from calibrate.quantities import (
    DASH,
    angle,
    decimals_of,
    fixed,
    length,
    significant,
)
from calibrate.tool_axes import ArmErrorsRecord, AxisRecord, TargetRecord, ToolFile

COLOUR = {"yes": "green", "with care": "yellow", "no": "red"}
WHERE = "in the flange"


def print_tool_axes(console: Console, tool: ToolFile) -> None:
    """Verdict, target, what its uncertainty consists of, circles, and the line that a rig file wants."""
    console.print(f"target determined: {tool.trust}", style=f"bold {COLOUR[tool.trust]}", highlight=False)
    for line in _lines(tool):
        console.print(line, highlight=False, markup=False)
    console.print(_tool_axes_table(tool.axes, several=len(tool.targets) > 1))
    if tool.tool_m is not None:
        point = ", ".join(f"{v + 0.0:.7f}" for v in tool.tool_m)
        console.print(f"for the rig file, under [tool]:  point_m = [{point}]", highlight=False, markup=False)


def _lines(tool: ToolFile) -> Iterator[str]:
    for target in tool.targets:
        yield from _target(target, tool)
    if tool.orientation is not None:
        turn = _values(tool.orientation.rotation_rad, tool.orientation.sigma_rad, 1.0, "rad")
        yield f"orientation ({tool.orientation.frame}): rotation vector {turn}"
    elif tool.tool_m is not None:
        yield f"orientation: not determined, because {tool.orientation_undetermined}"
    yield from (f"with care: {caution}" for caution in tool.cautions)
    yield _assumed(tool.arm_errors)
    if tool.flange is not None:
        joints = len(tool.flange.q_rad)
        used = sum(len(t.rows_used) for t in tool.targets)
        noise = length(tool.position_noise_m, 2)
        yield f"used: {used} rows in which only joints {joints - 1} and {joints} turn, noise {noise} per coordinate"
        origin = _values(tool.flange.origin_m, tool.flange.origin_sigma_m, 1e-3, "mm")
        yield f"flange in the device's frame: {origin}; direction of its z ± {angle(tool.flange.z_sigma_rad, 2)}"
    if tool.other_rows_rms_m is not None:
        yield f"check: {tool.other_rows} other rows differ from the fit by {length(tool.other_rows_rms_m, 2)} rms"


def _target(target: TargetRecord, tool: ToolFile) -> Iterator[str]:
    name = f"target {target.target}" if len(tool.targets) > 1 else "target"
    if target.point_m is None or target.sigma_m is None:
        yield f"{name}: not determined, because {tool.undetermined}"
        return
    yield f"{name}: {_values(target.point_m, target.sigma_m, 1e-3, 'mm')} {WHERE}"
    if target.instrument_sigma_m is not None and target.arm_sigma_m is not None:
        device, arm = (_sizes(s) for s in (target.instrument_sigma_m, target.arm_sigma_m))
        yield f"  measuring device ± ({device}) mm, errors of the arm ± ({arm}) mm"


def _assumed(errors: ArmErrorsRecord) -> str:
    sizes = (
        f"joint zeros {1e3 * errors.zero_sigma_rad:.6g} mrad, lengths {1e3 * errors.length_sigma_m:.6g} mm, "
        f"angles {1e3 * errors.angle_sigma_rad:.6g} mrad (1 sigma; {errors.source})"
    )
    if errors.model is None:
        return f"assumed errors of the arm: {sizes}"
    return f"errors of the arm: covariance of {errors.model}; for what it does not determine {sizes}"


def _values(values: tuple[float, ...], sigmas: tuple[float, ...], unit: float, name: str) -> str:
    """'x 35.12 ± 0.33, y −20.1 ± 1.2, z 110.00 ± 0.30 mm'."""
    parts: list[str] = []
    for axis, value, sigma in zip("xyz", values, sigmas, strict=True):
        decimals = decimals_of(sigma / unit)
        parts.append(f"{axis} {fixed(round(value / unit, decimals) + 0.0, decimals)} ± {fixed(sigma / unit, decimals)}")
    return f"{', '.join(parts)} {name}"


def _sizes(sigmas_m: tuple[float, ...]) -> str:
    return ", ".join(fixed(1e3 * s, decimals_of(1e3 * s)) for s in sigmas_m)


def _tool_axes_table(axes: tuple[AxisRecord, ...], *, several: bool) -> Table:
    table = Table(title="single-axis rotations, in the device's frame", title_justify="left")
    headings = ("joint", "rows", "arc (°)", "radius (mm)", "axis, 1 sigma (µrad)", "scatter (µm)")
    for heading in (*(("target",) if several else ()), *headings):
        table.add_column(heading, justify="right")
    for axis in axes:
        table.add_row(*((str(axis.target),) if several else ()), *_axis(axis))
    return table


def _axis(axis: AxisRecord) -> tuple[str, ...]:
    rows, arc = f"{axis.rows[0]}-{axis.rows[1]}", f"{np.degrees(axis.span_rad):.1f}"
    radius, turn = axis.status, DASH
    if axis.radius_sigma_m is not None and axis.direction_sigma_rad is not None:
        decimals = decimals_of(1e3 * axis.radius_sigma_m)
        radius = f"{fixed(1e3 * axis.radius_m, decimals)} ± {fixed(1e3 * axis.radius_sigma_m, decimals)}"
        turn = significant(1e6 * axis.direction_sigma_rad, 2)
    return f"J{axis.joint}", rows, arc, radius, turn, significant(1e6 * axis.scatter_m, 2)


SHOWN = 15


def print_error_simulation(console: Console, s: Simulation) -> None:
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
        console.print(f"worst posture: {length(p.rms_m)} rms at ({joints})°", highlight=False, markup=False)


def plain_table(title: str, *headings: str) -> Table:
    table = Table(title=title, title_justify="left", box=None)
    for i, heading in enumerate(headings):
        table.add_column(heading, justify="left" if i == 0 else "right")
    return table


def _print_budget(console: Console, s: Simulation) -> None:
    table = plain_table(
        "error budget, each group alone over the workspace", "group", "errors", "rms", "share of variance"
    )
    for line in s.budget:
        table.add_row(line.group, str(line.sources), length(line.rms_m), f"{100.0 * line.share:.2f} %")
    console.print(table)


def _print_poses(console: Console, s: Simulation) -> None:
    title = f"linear propagation beside {s.drawn.arms:,} drawn arms at every pose"
    table = plain_table(title, "pose", "linear rms", "drawn rms", "linear sigma x y z, µm", "drawn, µm", "95 % below")
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
    table = plain_table(title, "error", "alone, rms", "linear", "first order", "total")
    for i in s.ranking[:SHOWN]:
        table.add_row(
            s.sources[i].name,
            length(float(s.wide.alone_m[i])),
            f"{100.0 * s.wide.shares[i]:.2f} %",
            f"{100.0 * s.shares.first[i]:.2f} ± {100.0 * s.shares.first_sigma[i]:.2f} %",
            f"{100.0 * s.shares.total[i]:.2f} ± {100.0 * s.shares.total_sigma[i]:.2f} %",
        )
    console.print(table)
