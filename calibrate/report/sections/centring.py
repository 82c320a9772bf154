"""The chapter on centring: runs of the servo from the events of the recording, error against step, number of steps."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from acquisition.recording import Event
from calibrate.quantities import length, stated
from calibrate.report.elements.html import (
    Html,
    figure,
    panels,
    section,
    table,
    tag,
)
from calibrate.report.elements.svg import drawn, log_axis
from calibrate.report.elements.tones import (
    Tone,
    colour_key,
    place_mark,
    tone_of,
)
from calibrate.report.evidence.session_evidence import SpotSession

Floats = NDArray[np.float64]

KIND = "centring"


@dataclass(frozen=True)
class Trace:
    """One run of the centring servo, from first look to last."""

    placement: int
    first_psd: int
    strategy: str
    status: str
    tolerance_m: float
    error_m: Floats  # (look,) largest of the four distances from the target; NaN where a face was dark
    probes: int  # of the steps, those that only measure

    @property
    def steps(self) -> int:
        """Motions after the first look."""
        return max(0, len(self.error_m) - 1)


@dataclass(frozen=True)
class Traces:
    """All runs of a session."""

    runs: tuple[Trace, ...]
    unreadable: int  # centring events that do not hold what a run is made of

    def by_tolerance(self) -> dict[float, tuple[Trace, ...]]:
        """Runs that wanted the same, the finest first."""
        wanted = sorted({run.tolerance_m for run in self.runs})
        return {tolerance: tuple(r for r in self.runs if r.tolerance_m == tolerance) for tolerance in wanted}


def traces_of(events: Iterable[Event]) -> Traces:
    """Never fails: what cannot be read is counted."""
    found = [_trace(event.detail) for event in events if event.kind == KIND]
    return Traces(tuple(t for t in found if t is not None), sum(t is None for t in found))


def _trace(detail: Mapping[str, Any]) -> Trace | None:
    try:
        spots = np.array(
            [[math.nan if v is None else float(v) for v in look] for look in detail["spots_m"]], dtype=np.float64
        ).reshape(-1, 4)
        target = np.array(detail["target_m"], dtype=np.float64).reshape(4)
        tolerance_m = float(detail["tolerance_m"])
        if not (np.all(np.isfinite(target)) and 0.0 < tolerance_m < math.inf):
            return None
        return Trace(
            int(detail["placement"]),
            int(detail["first_psd"]),
            str(detail["strategy"]),
            str(detail["status"]),
            tolerance_m,
            np.abs(spots - target).max(axis=1) if len(spots) else np.empty(0),
            sum(purpose == "probe" for purpose in detail["purpose"]),
        )
    except (KeyError, TypeError, ValueError):
        return None


FLOOR_M = 1e-8  # an error of exactly zero has no place on a log axis
DRAWN = 120  # traces in one picture; of more, every n-th


def courses(runs: Sequence[Trace], tolerance_m: float, places: Sequence[int], name: str) -> Html:
    """Error against step, one line a run, colour by placement."""
    says = f"error of {len(runs)} centring runs against the step"
    return drawn(name, says, 4.6, 2.9, lambda figure: _paint_courses(figure, runs, tolerance_m, places))


def step_counts(runs: Sequence[Trace], tolerance_m: float, name: str) -> Html:
    """How many runs took how many steps."""
    says = f"histogram of the steps of {len(runs)} centring runs to {stated(tolerance_m)}"
    return drawn(name, says, 4.6, 2.9, lambda figure: _paint_counts(figure, runs))


def _paint_courses(figure: Figure, runs: Sequence[Trace], tolerance_m: float, places: Sequence[int]) -> None:
    axes = figure.add_subplot()
    for run in runs[:: -(-len(runs) // DRAWN)]:
        number = places.index(run.placement) if run.placement in places else None
        tone, mark = (Tone.SOFT, {}) if number is None else (tone_of(number), place_mark(number))
        shown = np.maximum(run.error_m, FLOOR_M)
        axes.plot(shown, "o-", color=tone.value, lw=1.0, ms=3.4, alpha=0.6, **mark)  # pyright: ignore[reportArgumentType]
    axes.axhline(tolerance_m, color=Tone.INK.value, lw=1.2, linestyle=(0, (4, 3)))
    axes.annotate(
        f"tolerance: {stated(tolerance_m)}",
        (1.0, tolerance_m),
        xycoords=("axes fraction", "data"),
        xytext=(0, 4),
        textcoords="offset points",
        ha="right",
        fontsize=10,
    )
    seen = np.concatenate([[tolerance_m], *(run.error_m[np.isfinite(run.error_m)] for run in runs)])
    log_axis(axes, "y", np.maximum(seen, FLOOR_M).tolist(), lambda value: length(value, 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="step", title="Largest distance of a spot from its target")


def _paint_counts(figure: Figure, runs: Sequence[Trace]) -> None:
    axes = figure.add_subplot()
    steps = np.array([run.steps for run in runs])
    counts = np.bincount(steps)
    bars = axes.bar(np.arange(len(counts)), counts, width=0.72, color=Tone.SOFT.value)
    axes.bar_label(bars, labels=[str(c) if c else "" for c in counts], padding=2, fontsize=10)
    axes.margins(y=0.12)
    axes.grid(visible=False)
    axes.spines["left"].set_visible(False)
    axes.set_yticks([])
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="steps", title="Number of runs by their steps", xlim=(-0.6, max(len(counts), 6) - 0.4))


TITLE = "Laser centring"
PICTURED = 3  # tolerances, the finest first; all are in the table


def centring(session: SpotSession) -> Html:
    """Courses, steps, endings."""
    traces = traces_of(session.recording.events)
    if not traces.runs:
        return section("centring", TITLE, "The recording holds no centring run.", *_unreadable(traces))
    lead = "The servo loop moves the arm until all four spot coordinates are within the tolerance of their target."
    groups = traces.by_tolerance()
    drawings = [_pictures(runs, wanted, session.places) for wanted, runs in list(groups.items())[:PICTURED]]
    drawings = [*drawings[:1], *(tag("div", one, cls="no-print") for one in drawings[1:])]  # the table has them all
    return section(
        "centring", TITLE, lead, colour_key(session.places), *drawings, _endings(groups), *_unreadable(traces)
    )


def _pictures(runs: Sequence[Trace], wanted_m: float, places: Sequence[int]) -> Html:
    name = f"{wanted_m * 1e9:.0f}"
    steps = [run.steps for run in runs]
    return panels(
        figure(
            courses(runs, wanted_m, places, f"course-{name}"),
            f"{len(runs)} runs with a tolerance of {stated(wanted_m)}. A line breaks where a face was dark.",
        ),
        figure(
            step_counts(runs, wanted_m, f"steps-{name}"),
            f"{_at_once(steps)}Median of the steps: {np.median(steps):g}; longest run: {max(steps)}.",
        ),
    )


def _at_once(steps: Sequence[int]) -> str:
    none = sum(s == 0 for s in steps)
    return f"{none} of {len(steps)} runs were centred at the first reading. " if none else ""


def _endings(groups: dict[float, tuple[Trace, ...]]) -> Html:
    head = ("Tolerance", "strategy", "ended as", "runs", "median steps", "most steps", "probing steps")
    return table(head, _ending_rows(groups), numeric=(3, 4, 5, 6), caption="How the runs ended")


def _ending_rows(groups: dict[float, tuple[Trace, ...]]) -> Iterator[tuple[str, ...]]:
    for wanted, runs in groups.items():
        for (strategy, status), count in sorted(Counter((r.strategy, r.status) for r in runs).items()):
            same = [r for r in runs if (r.strategy, r.status) == (strategy, status)]
            steps = [r.steps for r in same]
            said = status.replace("_", " ").lower()
            numbers = (str(count), f"{np.median(steps):g}", str(max(steps)), str(sum(r.probes for r in same)))
            yield (stated(wanted), strategy, said, *numbers)


def _unreadable(traces: Traces) -> list[Html]:
    if not traces.unreadable:
        return []
    return [tag("p", f"{traces.unreadable} centring events of the file cannot be read and are left out.")]
