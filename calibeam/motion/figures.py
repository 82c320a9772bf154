"""Drawings of motion: planned and reported positions on top of each other, and the cell around them."""

import io
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from acquisition.motion.cell import Box, Cell
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.plan import Plan
from acquisition.motion.setpoints import SolvedPath
from acquisition.recording.output import text_output, write_output
from calibeam.motion.examples import TOOL, ExampleResult
from calibrate.report.elements.svg import house_style
from calibrate.report.elements.tones import Tone

Floats = NDArray[np.float64]

CREATOR = "calibeam, drawn with Matplotlib"
FIGURE = text_output(CREATOR, "drawing")
PRINTED = {
    Tone.INK: "#111111", Tone.SOFT: "#555555", Tone.FAINT: "#dddddd", Tone.PAPER: "#ffffff", Tone.BEAM: "#cc3311",
    Tone.PLACE_1: "#0072b2", Tone.PLACE_2: "#e69f00", Tone.PLACE_3: "#009e73", Tone.PLACE_4: "#cc79a7",
    Tone.PLACE_5: "#56b4e9", Tone.PLACE_6: "#d55e00",
}  # fmt: skip


def draw_cell(axes: Axes, cell: Cell, plane: tuple[int, int], drawn_m: Floats) -> None:
    """Keep-out boxes filled, slow areas outlined, each with its name; limits of the axes stay.

    A box beside all that is drawn (point, 3), as a table seen from above, would only cover it, and is left out.
    """
    axes.apply_aspect()
    slow = [(area.box, f"{area.box.name}, {area.speed_m_s:g} m/s") for area in cell.slow]
    _boxes(axes, plane, drawn_m, [(box, box.name) for box in cell.keep_out], "keep out", (Tone.BEAM.value, 0.15))
    _boxes(axes, plane, drawn_m, slow, "slow area", (Tone.SOFT.value, 0.0))


def _boxes(
    axes: Axes,
    plane: tuple[int, int],
    drawn_m: Floats,
    named: list[tuple[Box, str]],
    kind: str,
    colour: tuple[str, float],
) -> None:
    """`kind`: in the legend, once. `colour`: its alpha is that of the filling."""
    across = next(k for k in range(3) if k not in plane)
    low_m, high_m = drawn_m[:, across].min(), drawn_m[:, across].max()
    for box, name in named:
        if box.lower_m[across] <= high_m and box.upper_m[across] >= low_m:
            _box(axes, box, plane, (name, kind), colour)
            kind = "_"


def _box(axes: Axes, box: Box, plane: tuple[int, int], names: tuple[str, str], colour: tuple[str, float]) -> None:
    """`names`: beside the box, and in the legend."""
    (x0, y0), (x1, y1) = ([corner[k] for k in plane] for corner in (box.lower_m, box.upper_m))
    # Artists, not patches of the data: the limits stay.
    axes.add_artist(Rectangle((x0, y0), x1 - x0, y1 - y0, facecolor=colour[0], alpha=colour[1], linewidth=0.0))
    edge = Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, edgecolor=colour[0], linestyle="--", linewidth=1.0)
    edge.set_label(names[1])
    axes.add_artist(edge)
    seen_x, seen_y = np.clip((x0, x1), *axes.get_xlim()), np.clip((y0, y1), *axes.get_ylim())
    if seen_x[1] > seen_x[0] and seen_y[1] > seen_y[0]:
        axes.text(seen_x[0], seen_y[1], f" {names[0]}", color=colour[0], fontsize=7, va="top", clip_on=True)


FINE_S = 0.005  # between points of a plan that is drawn, or compared with
DRAWN = 1500  # points of a curve, more shows nothing more
PLANNED, ACTUAL, TARGET = Tone.PLACE_1.value, Tone.PLACE_6.value, Tone.INK.value


def fine(plan: Plan) -> tuple[Floats, Floats]:
    """Times (point,) and joints (point, joint) of a plan that needs no belt; of one that does, as it was expected."""
    if plan.carried:
        return plan.t_s, plan.q_rad
    path = SolvedPath(plan.path(), FINE_S)
    t_s = np.arange(0.0, path.ends_s, FINE_S)
    return t_s, np.array([path.at(float(t)) for t in t_s])


def tips(solver: Solver, q_rad: Floats) -> Floats:
    """(point, 3) m of the hand in the base."""
    out: Floats = (solver.arm.frames(q_rad)[:, -1] @ TOOL)[:, :3, 3]
    return out


def off_track_m(points: Floats, track: Floats) -> Floats:
    """(point,) from points (point, 3) to the polyline of a track (corner, 3), m."""
    begins, ways = track[:-1], np.diff(track, axis=0)
    lengths = np.maximum(np.sum(ways**2, axis=1), 1e-18)
    out = np.empty(len(points))
    for k, point in enumerate(points):
        shares = np.clip(np.sum((point - begins) * ways, axis=1) / lengths, 0.0, 1.0)
        out[k] = np.min(np.linalg.norm(point - begins - shares[:, None] * ways, axis=1))
    return out


def thinned(values: Floats) -> Floats:
    """Every so many of a long series."""
    return values[:: max(1, len(values) // DRAWN)]


def write_figure(path: Path, width_in: float, height_in: float, paint: Callable[[Figure], None]) -> None:
    """An SVG that opens anywhere, on white."""
    with house_style():
        figure = Figure(figsize=(width_in, height_in), layout="constrained", facecolor="white")
        paint(figure)
        drawn = io.StringIO()
        figure.savefig(drawn, format="svg", metadata={"Date": None, "Creator": CREATOR}, facecolor="white")
    text = drawn.getvalue()
    for tone, printed in PRINTED.items():
        text = text.replace(tone.value, printed)
    write_output(path, text, FIGURE)


def draw_joints(figure: Figure, shown: ExampleResult) -> None:
    """Readings and speeds over time: planned thin, reported by the controller broad."""
    position, speed = figure.subplots(2, 1, sharex=True)
    t_s, q_rad = fine(shown.plan)
    begin_s = _begin_s(shown, q_rad)
    for joint in range(q_rad.shape[1]):
        colour = list(PRINTED)[5 + joint % 6].value
        at_s, said = thinned(shown.t_s - begin_s), thinned(shown.q_rad[:, joint])
        position.plot(at_s, np.degrees(said), color=colour, alpha=0.35, linewidth=4.0)
        position.plot(t_s, np.degrees(q_rad[:, joint]), color=colour, label=f"joint {joint + 1}", linewidth=1.0)
        speed.plot(t_s, np.degrees(np.gradient(q_rad[:, joint], t_s)), color=colour, linewidth=1.0)
    _transitions((position, speed), shown.plan)
    position.set(ylabel="deg", title="Joints: planned (thin), reported by the controller (broad); transitions shaded")
    figure.legend(*position.get_legend_handles_labels(), loc="outside lower center", ncols=6)
    speed.set(ylabel="deg/s, planned", xlabel="s")


def draw_track(figure: Figure, shown: ExampleResult, solver: Solver) -> None:
    """From above and from the side, with the targets."""
    above, side = figure.subplots(1, 2)
    planned, said = tips(solver, fine(shown.plan)[1]), tips(solver, thinned(shown.q_rad))
    for axes, (i, j), title in ((above, (0, 1), "From above"), (side, (1, 2), "From the side")):
        axes.plot(said[:, i], said[:, j], color=ACTUAL, alpha=0.4, linewidth=4.0, label="reported by the controller")
        axes.plot(planned[:, i], planned[:, j], color=PLANNED, linewidth=1.0, label="planned")
        points = np.array([T[:3, 3] for T in shown.corners]).reshape(-1, 3)
        axes.plot(points[:, i], points[:, j], "+", color=TARGET, markersize=8, label="targets")
        axes.set(xlabel=f"{'xyz'[i]}, m", ylabel=f"{'xyz'[j]}, m", title=title, aspect="equal", adjustable="datalim")
    above.legend()


def draw_blend(figure: Figure, shown: ExampleResult, solver: Solver) -> None:
    """The first corner: track close up, and position, speed and acceleration of the hand through the transition."""
    t_s, q_rad = fine(shown.plan)
    tip, corner_s, tacc_s = tips(solver, q_rad), shown.plan.corners_s[1], shown.plan.pace.tacc_s
    corner = shown.corners[0][:3, 3]
    near = np.abs(t_s - corner_s) < 2.0 * tacc_s
    close, *curves = figure.subplots(1, 4)
    said = tips(solver, thinned(shown.q_rad))
    within = tip[np.abs(t_s - corner_s) < 1.1 * tacc_s]
    extent_m = float(np.max(np.linalg.norm(within - corner, axis=1)))
    said = said[np.linalg.norm(said - corner, axis=1) < extent_m]
    close.plot(1e3 * said[:, 0], 1e3 * said[:, 1], ".", color=ACTUAL, alpha=0.4, label="reported by the controller")
    close.plot(1e3 * within[:, 0], 1e3 * within[:, 1], color=PLANNED, label="planned")
    close.plot(1e3 * corner[0], 1e3 * corner[1], "+", color=TARGET, markersize=10, label="corner, missed by design")
    close.set(xlabel="x, mm", ylabel="y, mm", title="Blend close up", aspect="equal", adjustable="datalim")
    close.legend()
    speed = np.gradient(tip, t_s, axis=0)
    series = ((tip - corner, "mm from the corner"), (speed, "mm/s"), (np.gradient(speed, t_s, axis=0), "mm/s²"))
    for axes, (values, unit) in zip(curves, series, strict=True):
        for i, colour in enumerate((PLANNED, ACTUAL, Tone.PLACE_3.value)):
            axes.plot(t_s[near] - corner_s, 1e3 * values[near, i], color=colour, label="xyz"[i])
        for side in (-tacc_s, tacc_s):
            axes.axvline(side, color=Tone.SOFT.value, linestyle=":")
        axes.set(xlabel="s from the corner", title=unit)
    curves[0].legend()


def draw_belt(figure: Figure, shown: ExampleResult, solver: Solver) -> None:
    """The hand along the belt, and the belt itself."""
    along, above = figure.subplots(1, 2)
    at_s, said = thinned(shown.t_s), tips(solver, thinned(shown.q_rad))
    planned = tips(solver, shown.plan.q_rad)
    along.plot(at_s, said[:, 1], color=ACTUAL, linewidth=4.0, alpha=0.4, label="hand, reported by the controller")
    along.plot(shown.plan.t_s, planned[:, 1], color=PLANNED, linewidth=1.0, label="hand, planned")
    if shown.belt is not None:
        way = np.array([shown.belt(float(t)).s_m for t in at_s])
        offset = -0.45 + 0.10  # belt origin and part on it, along y of the base (rigs/tasks/conveyor.toml)
        along.plot(at_s, offset + way, color=Tone.PLACE_3.value, linestyle="--", label="part on the belt")
    along.set(xlabel="s", ylabel="y, m", title="Along the belt", ylim=(-0.5, 0.4))
    along.legend()
    above.plot(said[:, 1], said[:, 2], color=ACTUAL, linewidth=4.0, alpha=0.4)
    above.plot(planned[:, 1], planned[:, 2], color=PLANNED, linewidth=1.0)
    above.set(xlabel="y, m", ylabel="z, m", title="From the side", aspect="equal", adjustable="datalim")


def draw_plan(figure: Figure, plan: Plan, solver: Solver, cell: Cell) -> None:
    """A dry run: joints over time, and the flange from above and from the side, among the boxes of the cell."""
    joints, above, side = figure.subplots(1, 3)
    for joint in range(plan.q_rad.shape[1]):
        colour = list(PRINTED)[5 + joint % 6].value
        joints.plot(plan.t_s, np.degrees(plan.q_rad[:, joint]), color=colour, label=f"joint {joint + 1}")
    joints.set(xlabel="s", ylabel="deg", title="Joints")
    figure.legend(*joints.get_legend_handles_labels(), loc="outside lower center", ncols=6)
    _transitions((joints,), plan)
    flange = solver.arm.frames(plan.q_rad)[:, -1, :3, 3]
    for axes, (i, j), title in ((above, (0, 1), "Flange from above"), (side, (0, 2), "From the side")):
        axes.plot(flange[:, i], flange[:, j], color=PLANNED)
        axes.plot(flange[0, i], flange[0, j], "o", color=PLANNED, label="begins")
        axes.plot(flange[-1, i], flange[-1, j], "s", color=ACTUAL, label="ends")
        axes.set(xlabel=f"{'xyz'[i]}, m", ylabel=f"{'xyz'[j]}, m", title=title, aspect="equal", adjustable="datalim")
        axes.margins(0.15)
        draw_cell(axes, cell, (i, j), flange)
    above.legend()


def _transitions(many: Sequence[Axes], plan: Plan) -> None:
    for axes in many:
        for corner_s in plan.corners_s:
            axes.axvspan(corner_s - plan.pace.tacc_s, corner_s + plan.pace.tacc_s, color=Tone.FAINT.value, alpha=0.5)


def _begin_s(shown: ExampleResult, planned_rad: Floats) -> float:
    """When the arm set off, by what the controller reported, less when it was planned to."""
    moved = np.flatnonzero(np.max(np.abs(shown.q_rad - shown.q_rad[0]), axis=1) > 1e-3)
    planned = np.flatnonzero(np.max(np.abs(planned_rad - planned_rad[0]), axis=1) > 1e-3)
    if moved.size == 0 or planned.size == 0:
        return 0.0
    return float(shown.t_s[moved[0]] - FINE_S * planned[0])


def plot(shown: ExampleResult, solver: Solver, out: Path) -> None:
    """The SVG files of one example."""

    def with_solver(draw: Callable[[Figure, ExampleResult, Solver], None]) -> Callable[[Figure], None]:
        return lambda figure: draw(figure, shown, solver)

    match shown.name:
        case "joint":
            write_figure(out / "joint.svg", 9.0, 6.0, lambda figure: draw_joints(figure, shown))
        case "belt":
            write_figure(out / "belt.svg", 9.0, 4.5, with_solver(draw_belt))
        case name:
            write_figure(out / f"{name}.svg", 9.0, 4.5, with_solver(draw_track))
            if name == "straight":
                write_figure(out / "blend.svg", 12.0, 3.5, with_solver(draw_blend))


def numbers_of(shown: ExampleResult, solver: Solver) -> dict[str, float]:
    """By what is measured; names that end in ", m" are lengths."""
    out = {
        "seconds planned": float(shown.plan.t_s[-1]),
        "set-points": float(shown.followed.sent),
        "cycles missed": float(shown.followed.missed),
        "restarts": float(shown.followed.restarts),
        "arm behind its set-points, s": shown.lag_s,
    }
    if not shown.plan.carried:
        track = tips(solver, fine(shown.plan)[1])
        said = tips(solver, thinned(shown.q_rad))
        out["hand off its planned track at most, m"] = float(np.max(off_track_m(said, track)))
    return {**out, **(shown.figures or {})}
