"""A session in a terminal, for somebody with gloves a step away: what is going on in colour and capitals, few words.

The view stays at the bottom; what is said scrolls by above it, and stands in the log.
"""

from collections.abc import Generator
from contextlib import contextmanager, suppress

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from acquisition.progress import Progress
from acquisition.session_states import RunState
from calibeam.session.pace import clock_words
from calibeam.session.quality import Quality
from calibeam.session.shown import Shown

REFRESH_HZ = 4.0
BAR = 30  # characters
SOON_S = 0.01  # half a window of acquisition/settling.py: nearer it does not look
MOVES, WAITS, STOPS, ASKS = "bold white on green", "bold black on yellow", "bold white on red", "bold black on cyan"
STYLES = {
    RunState.PAUSING: WAITS,
    RunState.PAUSED: WAITS,
    RunState.ENDING: WAITS,
    RunState.BREAKING: STOPS,
    RunState.ABORTING: STOPS,
    RunState.ABORTED: STOPS,
    RunState.HALTED: STOPS,
}
KEYS = {
    RunState.RUNNING: "SPACE pause    s finish here    a abort    h halt",
    RunState.PAUSING: "SPACE stop the arm now    r go on    s finish here    a abort    h halt",
    RunState.BREAKING: "a abort    h halt",
    RunState.PAUSED: "r go on    s finish here    a abort    h halt\n   leave the fixture where it is",
    RunState.ENDING: "SPACE SPACE stop the arm now    a abort    h halt",
    RunState.ABORTING: "h halt",
    RunState.HALTED: "h say the stop again",
}


class TerminalView:
    """Implements calibeam.session.shown.Listener; `opened` while the keys are listened to."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live: Live | None = None
        self._shown = Shown()

    @contextmanager
    def opened(self) -> Generator[None]:
        """The view stands at the bottom inside, and stays as it was last."""
        live = Live(console=self._console, refresh_per_second=REFRESH_HZ, get_renderable=self._drawn)
        live.start()
        self._live = live
        try:
            yield
        finally:
            self._live = None
            with suppress(OSError):  # the terminal was closed
                live.stop()  # draws it once more

    def said(self, text: str, loud: bool) -> None:
        if loud and not (
            self._live is not None and text in {state.value for state in RunState}
        ):  # the view shows these
            self._console.print(text, highlight=False, markup=False, soft_wrap=self._live is None)

    def shows(self, shown: Shown) -> None:
        asks = bool(shown.asked) and not self._shown.asked
        if shown.step != self._shown.step:
            self._console.rule(f"[bold]{shown.step}[/bold]", align="left", style="bold")
        self._shown = shown
        if asks:
            self._console.bell()
            if self._live is not None:
                self._live.refresh()  # at once: only an answer to what is on the screen counts

    def _drawn(self) -> RenderableType:
        return drawn(self._shown)


def drawn(shown: Shown) -> Group:
    """The whole view."""
    parts: list[RenderableType] = [Text(), _head(shown)]
    if shown.undelivered:
        parts.append(Padding(Text(shown.undelivered, style="bold red"), (0, 3)))
    if shown.asked:
        return Group(*parts, Padding(Text(shown.asked, style="bold"), (1, 3)))
    if shown.progress is not None:
        parts.append(_bar(shown.progress, shown.left_s))
    parts += [_facts(shown), Text(f"\n   {KEYS.get(shown.state, '')}", style="bold")]
    return Group(*parts)


def _head(shown: Shown) -> Text:
    style = STOPS if shown.undelivered else ASKS if shown.asked else STYLES.get(shown.state, MOVES)
    text = Text(f"   {shown.head.upper()}   ", style=style)
    if shown.progress is not None:
        text.append(
            f"   place {shown.progress.placement}, PSD {shown.progress.first} first",
            style="not bold default on default",
        )
    return text


def _bar(progress: Progress, left_s: float | None) -> Text:
    full = round(BAR * progress.done / max(1, progress.total))
    text = Text("\n   ")
    text.append("█" * full, style="green")
    text.append("░" * (BAR - full), style="dim")
    text.append(f"   {progress.done} of {progress.total}", style="bold")
    text.append("" if left_s is None or not progress.left else f"   {clock_words(left_s)} left", style="bold")
    text.append(f"   {progress.skipped} left out" if progress.skipped else "", style="yellow")
    return text


def _facts(shown: Shown) -> Table:
    table = Table.grid(padding=(0, 1))
    table.add_column(min_width=11)
    table.add_column()
    if shown.forecast is not None:
        style = "bold" if shown.forecast.now_m is not None else ""
        table.add_row(Text("\n   accuracy"), Text(f"\n{shown.forecast.says}", style=style))
    if shown.quality is not None:
        _quality(table, shown.quality)
    return table


def _quality(table: Table, quality: Quality) -> None:
    spots = [f"{1e3 * v:+6.2f}" if np.isfinite(v) else "  dark" for v in quality.spots_m]
    for face in (1, 2):
        volts = quality.sums_v[face - 1]
        light = f"   light {volts:.2f} V" if np.isfinite(volts) else ""
        table.add_row(f"   PSD {face}", f"x {spots[2 * face - 2]}   y {spots[2 * face - 1]} mm{light}")
    if quality.settle_s is not None and quality.usual_settle_s is not None:
        never = f"   {quality.unsettled} did not settle" if quality.unsettled else ""
        table.add_row("   settled", f"{_soon(quality.settle_s)}, usually {_soon(quality.usual_settle_s)}{never}")
    spans, longest = np.degrees(quality.spans_rad), max(map(len, quality.marks))
    half = (len(spans) + 1) // 2
    for row in range(half):
        pair = [j for j in (row, row + half) if j < len(spans)]
        told = "  ".join(f"{j + 1} {quality.marks[j]:{longest}} {spans[j]:4.0f}°" for j in pair)
        table.add_row("   joints" if row == 0 else "", told)


def _soon(seconds: float) -> str:
    return f"in {seconds:.2f} s" if seconds >= SOON_S else "at once"
