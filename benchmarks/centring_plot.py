"""Steps to 5 um of every strategy from the same starts, as one picture: the share of runs that were there by then."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from acquisition.centring.loop import Centring, CentringStatus
from calibeam.motion.figures import PRINTED, write_figure

LONGEST = 40  # steps that are drawn


def write_plot(path: Path, runs: Mapping[str, Sequence[Centring]]) -> None:
    """The file is an SVG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_figure(path, 7.0, 4.0, lambda figure: _draw(figure, runs))


def shares(results: Sequence[Centring]) -> np.ndarray:
    """(LONGEST + 1,) share of all runs that were centred after so many motions."""
    steps = [run.steps for run in results if run.status is CentringStatus.CENTRED]
    return np.array([sum(s <= k for s in steps) for k in range(LONGEST + 1)]) / len(results)


def _draw(figure: Figure, runs: Mapping[str, Sequence[Centring]]) -> None:
    axes = figure.subplots()
    colours = [tone.value for tone in list(PRINTED)[5:]]
    for number, (name, results) in enumerate(runs.items()):
        axes.step(range(LONGEST + 1), 100.0 * shares(results), where="post", color=colours[number % 6], label=name)
    count = max(len(results) for results in runs.values())
    axes.set(
        title=f"The same {count} starts, fixture pose wrong by up to 80 deg and 50 mm",
        xlabel="motions, every probe and going back counted",
        ylabel="% of runs within 5 um",
        ylim=(0, 101),
    )
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
