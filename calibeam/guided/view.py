"""What a person at the arm sees: where to put the probe next, each joint's way, coverage, repeatability so far."""

from collections.abc import Generator
from contextlib import contextmanager

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from acquisition.guided.guide import GuidedProgress, Request

CLOSE_RAD = 0.35  # a joint this near the wanted posture is good: nobody copies a picture better
REFRESH_HZ = 5.0


class PersonGuide:
    """Implements acquisition.guided.guide.Guide for a person who reads the terminal; it waits for nobody's key."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live: Live | None = None
        self._said: str | None = None

    @contextmanager
    def open(self) -> Generator[None]:
        """The view stays in one place inside."""
        with Live(console=self._console, refresh_per_second=REFRESH_HZ, transient=True) as live:
            self._live = live
            try:
                yield
            finally:
                self._live = None

    def ask(self, request: Request) -> bool:
        again = "" if request.attempt == 1 else f" again ({request.attempt}), lift it out first"
        text = f"put the probe on {request.target.says}{again}"
        if text != self._said:
            self._console.print(text, highlight=False, markup=False)
            self._said = text
        return True

    def tell(self, progress: GuidedProgress) -> None:
        if self._live is not None:
            self._live.update(drawn(progress))


def drawn(progress: GuidedProgress) -> Group:
    """The whole view."""
    return Group(_head(progress), _joints(progress))


def _head(progress: GuidedProgress) -> Text:
    text = Text(f"{progress.done} of {progress.planned} readings; {progress.request.target.says}: ")
    text.append(progress.says, style="bold green" if progress.says.startswith("taken") else "bold")
    if progress.repeatability_m is not None:
        text.append(f"; the probe repeats to {1e6 * progress.repeatability_m:.1f} um so far")
    return text


def _joints(progress: GuidedProgress) -> Table:
    table = Table("joint", "now", "wanted", "", "range visited", box=None)
    each = zip(progress.q_rad, progress.request.posture_rad, strict=True)
    for joint, (now_rad, wanted_rad) in enumerate(each):
        table.add_row(
            str(joint + 1),
            f"{np.degrees(now_rad):+.0f}°",
            f"{np.degrees(wanted_rad):+.0f}°",
            _way(now_rad, wanted_rad),
            progress.coverage.marks(joint),
        )
    return table


def _way(now_rad: float, wanted_rad: float) -> str:
    left_rad = wanted_rad - now_rad
    if not np.isfinite(left_rad) or abs(left_rad) <= CLOSE_RAD:
        return "good"
    arrow = "→" if left_rad > 0.0 else "←"
    return arrow * min(3, 1 + int(abs(left_rad) / np.radians(45.0)))
