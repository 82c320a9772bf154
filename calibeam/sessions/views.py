"""Who follows a session: a terminal, plain lines where there is none, and the live page.

The terminal is for somebody with gloves a step away: what is going on in colour and capitals, few words. The view
stays at the bottom; what is reported scrolls by above it, and stands in the log (calibeam/site_log.py).
"""

from collections.abc import Generator
from contextlib import contextmanager, suppress

import numpy as np
from rich.console import Group, RenderableType
from rich.live import Live
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from acquisition.session.control import RunState
from acquisition.session.records import Progress
from calibeam.console import Console
from calibeam.live.feed import Feed
from calibeam.live.feed import Progress as PageProgress
from calibeam.sessions.status import Quality, SessionStatus, clock_words

EVERY = 10  # poses


class PlainView:
    """Implements calibeam.sessions.status.Listener."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._reported, self._step = 0, ""

    def report(self, text: str, on_screen: bool) -> None:
        if on_screen:
            self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    def shows(self, shown: SessionStatus) -> None:
        if shown.step != self._step:
            self._step = shown.step
            self.report(shown.step, on_screen=True)
        progress = shown.progress
        if progress is None or progress.done < self._reported + EVERY:
            return
        self._reported = progress.done
        left = "" if shown.left_s is None else f", about {clock_words(shown.left_s)} left"
        accuracy = "" if shown.forecast is None else f"; accuracy {shown.forecast.says}"
        self.report(f"{progress.done} of {progress.total} poses{left}{accuracy}", on_screen=True)


class PageView:
    """Implements calibeam.sessions.status.Listener."""

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        self._stands: tuple[int, int] | None = None
        self._samples = -1

    def report(self, text: str, on_screen: bool) -> None:
        if on_screen:
            self._feed.said(text)

    def shows(self, shown: SessionStatus) -> None:
        progress, forecast = shown.progress, shown.forecast
        if progress is not None and (progress.placement, progress.first) != self._stands:
            self._stands = progress.placement, progress.first
            self._feed.stands(*self._stands)
        if forecast is not None and forecast.corrections is not None and forecast.samples != self._samples:
            self._samples = forecast.samples
            self._feed.believes(forecast.corrections)
        note = shown.asked or ("" if forecast is None else f"accuracy: {forecast.says}")
        done, total = (0, None) if progress is None else (progress.done, progress.total)
        self._feed.progress(PageProgress(shown.head, done, total, shown.left_s, note))


class PageLines(PageView):
    """Of a session that reports its progress itself."""

    def shows(self, shown: SessionStatus) -> None:
        """Nothing more."""


REFRESH_HZ = 4.0
BAR = 30  # characters
SOON_S = 0.01  # half a window of acquisition/wires/bench.py: nearer it does not look
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
    RunState.HALTED: "h repeat the stop",
}


class TerminalView:
    """Implements calibeam.sessions.status.Listener; `opened` while the keys are listened to."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live: Live | None = None
        self._shown = SessionStatus()

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

    def report(self, text: str, on_screen: bool) -> None:
        if on_screen and not (
            self._live is not None and text in {state.value for state in RunState}
        ):  # the view shows these
            self._console.print(text, highlight=False, markup=False, soft_wrap=self._live is None)

    def shows(self, shown: SessionStatus) -> None:
        asks = bool(shown.asked) and not self._shown.asked
        if shown.step != self._shown.step:
            self._console.rule(shown.step, align="left", style="bold")
        self._shown = shown
        if asks:
            self._console.bell()
            if self._live is not None:
                self._live.refresh()  # at once: only an answer to what is on the screen counts

    def _drawn(self) -> RenderableType:
        return drawn(self._shown)


def drawn(shown: SessionStatus) -> Group:
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


def _head(shown: SessionStatus) -> Text:
    style = STOPS if shown.undelivered else ASKS if shown.asked else STYLES.get(shown.state, MOVES)
    text = Text(f"   {shown.head.upper()}   ", style=style)
    if shown.progress is not None:
        text.append(
            f"   station {shown.progress.placement}, PSD {shown.progress.first} first",
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


def _facts(shown: SessionStatus) -> Table:
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
    spots = [f"{1e3 * v:+z6.2f}" if np.isfinite(v) else "  dark" for v in quality.spots_m]
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
        joints = "  ".join(f"{j + 1} {quality.marks[j]:{longest}} {spans[j]:4.0f}°" for j in pair)
        table.add_row("   joints" if row == 0 else "", joints)


def _soon(seconds: float) -> str:
    return f"in {seconds:.2f} s" if seconds >= SOON_S else "at once"
