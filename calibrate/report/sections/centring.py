"""The chapter on how the spots were brought to where they were wanted."""

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from calibrate.report.centring_figures import courses, step_counts
from calibrate.report.centring_traces import Trace, Traces, traces_of
from calibrate.report.elements import Html, figure, panels, section, table, tag
from calibrate.report.quantities import stated
from calibrate.report.spot_session import SpotSession
from calibrate.report.tones import colour_key

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
            f"{len(runs)} runs that wanted {stated(wanted_m)}. A line breaks where a face was dark.",
        ),
        figure(
            step_counts(runs, wanted_m, f"steps-{name}"),
            f"{_at_once(steps)}The median is {np.median(steps):g} steps, the longest run took {max(steps)}.",
        ),
    )


def _at_once(steps: Sequence[int]) -> str:
    none = sum(s == 0 for s in steps)
    return f"{none} of {len(steps)} runs were centred at the first reading.  " if none else ""


def _endings(groups: dict[float, tuple[Trace, ...]]) -> Html:
    head = ("Wanted", "Strategy", "Ended as", "runs", "median steps", "most steps", "of them probing")
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
