"""A tool found by single axes as a person reads it in a terminal: the axes first, then the tool with its doubt."""

import numpy as np
from rich.console import Console
from rich.table import Table

from calibrate.tool_axes.tool_file import AxisRecord, ToolFile


def print_tool(console: Console, tool: ToolFile) -> None:
    """Circles, flange, tool, and the line that a rig file wants."""
    table = Table(title="single-axis rotations, in the device's frame", title_justify="left")
    for heading in ("joint", "rows", "arc (deg)", "radius (mm)", "sigma (um)", "axis sigma (urad)", "scatter (um)"):
        table.add_column(heading, justify="right")
    for axis in tool.axes:
        table.add_row(*_axis(axis))
    console.print(table)
    flange = tool.flange
    sigma_um = " ".join(f"{1e6 * s:.1f}" for s in flange.origin_sigma_m)
    console.print(
        f"flange: origin {_mm(flange.origin_m)} mm, sigma {sigma_um} um; z to {1e6 * flange.z_sigma_rad:.1f} urad",
        highlight=False,
    )
    console.print(f"tool by axis lines alone: {_mm(tool.by_axes_m)} mm in the flange", highlight=False)
    console.print(f"distances missed by {1e6 * tool.distance_rms_m:.1f} um rms", highlight=False)
    if tool.tool_m is None or tool.tool_sigma_m is None:
        console.print(f"[bold]tool: not determined[/bold]: {tool.undetermined}", highlight=False)
        return
    sigma_um = " ".join(f"{1e6 * s:.1f}" for s in tool.tool_sigma_m)
    console.print(f"[bold]tool: {_mm(tool.tool_m)} mm in the flange, sigma {sigma_um} um[/bold]", highlight=False)
    point = ", ".join(f"{v:.7f}" for v in tool.tool_m)
    console.print(f"for the rig file, under [tool]:  point_m = [{point}]", highlight=False, markup=False)


def _axis(axis: AxisRecord) -> tuple[str, ...]:
    rows, arc = f"{axis.rows[0]}-{axis.rows[1]}", f"{np.degrees(axis.span_rad):.1f}"
    told = axis.radius_sigma_m is not None and axis.direction_sigma_rad is not None
    radius = f"{1e3 * axis.radius_m:.3f}" if told else axis.status
    sigma = f"{1e6 * (axis.radius_sigma_m or 0.0):.1f}" if told else "-"
    turn = f"{1e6 * (axis.direction_sigma_rad or 0.0):.1f}" if told else "-"
    return f"J{axis.joint}", rows, arc, radius, sigma, turn, f"{1e6 * axis.scatter_m:.1f}"


def _mm(values_m: tuple[float, ...]) -> str:
    return "[" + ", ".join(f"{1e3 * v:+.4f}" for v in values_m) + "]"
