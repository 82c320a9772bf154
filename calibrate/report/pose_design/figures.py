"""Pictures of a design: how many poses are enough, how the plan uses the joints, and which causes look alike."""

import numpy as np
from matplotlib.figure import Figure

from calibrate.pose_design.design import Design
from calibrate.pose_design.seen import Seen
from calibrate.report.elements import Html
from calibrate.report.svg import drawn, log_axis
from calibrate.report.tones import PLACES, Tone

SHOWN_MM = 1.0  # of the curve: beyond, there are fewer readings than unknowns, and beliefs alone speak


def curve_figure(made: Design) -> Html:
    """Predicted error by number of poses."""
    says = "curve of the predicted error over the workspace over the number of poses"
    return drawn("design-curve", says, 6.0, 3.4, lambda figure: paint_curve(figure, made))


def paint_curve(figure: Figure, made: Design) -> None:
    """Chosen one by one, drawn at random, and the plan."""
    axes, curve = figure.subplots(), made.curve
    shown = curve.random_m < 1e-3 * SHOWN_MM
    axes.plot(curve.poses[shown], 1e6 * curve.random_m[shown], "--", color=Tone.SOFT.value, label="random, median")
    axes.plot(curve.poses[shown], 1e6 * curve.chosen_m[shown], color=PLACES[0].value, label="one by one")
    axes.plot(len(made.taken.poses), 1e6 * made.free_space_m, "o", color=PLACES[1].value, label="the plan, exchanged")
    if curve.enough is not None:
        axes.axvline(curve.enough, color=Tone.SOFT.value, lw=0.8)
        axes.annotate("enough", (curve.enough, 1.0), xycoords=("data", "axes fraction"), fontsize=8, va="top")
    values = 1e6 * np.concatenate([curve.chosen_m[shown], curve.random_m[shown]])
    log_axis(axes, "y", [float(values.min()), float(values.max())], lambda y: f"{y:g}")
    axes.set(xlabel="poses", ylabel="predicted error over the workspace, rms (µm)")
    axes.legend()


def joints_figure(made: Design) -> Html:
    """Angles of every joint in time."""
    says = "angles of every joint over the number of the pose in the plan"
    return drawn("design-joints", says, 9.0, 3.2, lambda figure: _paint_joints(figure, made))


def _paint_joints(figure: Figure, made: Design) -> None:
    axes, q = figure.subplots(), np.degrees(made.candidates.q_rad[made.taken.poses])
    number, place = np.arange(1, len(q) + 1), made.candidates.placement[made.taken.poses]
    for joint, angle in enumerate(q.T):
        axes.plot(number, angle, ".", color=PLACES[joint % len(PLACES)].value, label=f"J{joint + 1}", ms=4)
    for change in np.flatnonzero(np.diff(place)):
        axes.axvline(change + 1.5, color=Tone.SOFT.value, lw=0.8)
    axes.set(xlabel="pose in time (lines: the fixture is moved)", ylabel="angle (°)")
    axes.legend(ncols=6, loc="upper center", bbox_to_anchor=(0.5, 1.2))


def isolability_figure(seen: Seen) -> Html:
    """R2 between physics."""
    says = "matrix of how much of the signal of each cause every other could explain"
    return drawn("design-isolability", says, 9.4, 8.2, lambda figure: paint_isolability(figure, seen))


def paint_isolability(figure: Figure, seen: Seen) -> None:
    """The largest R2 of any two terms of each two physics, the same place or not."""
    names = list(dict.fromkeys(term.physics for term in seen.isolability.terms))
    owner = np.array([names.index(term.physics) for term in seen.isolability.terms])
    r2 = seen.isolability.r2.copy()
    np.fill_diagonal(r2, 0.0)
    table = np.zeros((len(names), len(names)))
    for a in range(len(names)):
        for b in range(len(names)):
            block = r2[np.ix_(owner == a, owner == b)]
            table[a, b] = block.max(initial=0.0)
    axes = figure.subplots()
    axes.grid(visible=False)
    for a in range(len(names)):
        for b in range(len(names)):
            share = float(table[a, b])
            tone = PLACES[1].value if share >= 0.97 else PLACES[0].value
            axes.fill_between([b - 0.5, b + 0.5], a - 0.5, a + 0.5, color=tone, alpha=0.03 + 0.7 * share, lw=0)
            if share >= 0.5:
                axes.text(b, a, f"{100.0 * share:.0f}", ha="center", va="center", fontsize=7)
    axes.set(xlim=(-0.5, len(names) - 0.5), ylim=(len(names) - 0.5, -0.5))
    axes.set(xlabel="by so much (%) could this cause explain it", ylabel="signal of this cause")
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
