"""Which plots an example leaves, and the figures beside them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from acquisition.motion.inverse.solver import Solver
from calibeam.motion import figures
from calibeam.motion.examples import Shown


def plot(shown: Shown, solver: Solver, out: Path) -> None:
    """The SVG files of one example."""

    def with_solver(draw: Callable[[Figure, Shown, Solver], None]) -> Callable[[Figure], None]:
        return lambda figure: draw(figure, shown, solver)

    match shown.name:
        case "joint":
            figures.write_figure(out / "joint.svg", 9.0, 6.0, lambda figure: figures.draw_joints(figure, shown))
        case "belt":
            figures.write_figure(out / "belt.svg", 9.0, 4.5, with_solver(figures.draw_belt))
        case name:
            figures.write_figure(out / f"{name}.svg", 9.0, 4.5, with_solver(figures.draw_track))
            if name == "straight":
                figures.write_figure(out / "blend.svg", 12.0, 3.5, with_solver(figures.draw_blend))


def numbers_of(shown: Shown, solver: Solver) -> dict[str, float]:
    """By what is measured; names that end in ", m" are lengths."""
    out = {
        "seconds planned": float(shown.plan.t_s[-1]),
        "set-points": float(shown.followed.sent),
        "cycles missed": float(shown.followed.missed),
        "restarts": float(shown.followed.restarts),
        "arm behind its set-points, s": shown.lag_s,
    }
    if not shown.plan.carried:
        track = figures.tips(solver, figures.fine(shown.plan)[1])
        said = figures.tips(solver, figures.thinned(shown.q_rad))
        out["hand off its planned track at most, m"] = float(np.max(figures.off_track_m(said, track)))
    return {**out, **(shown.figures or {})}
