"""Centring runs as the events of a recording tell them."""

import math
from typing import Any

import numpy as np

from acquisition.recording import Event
from calibrate.report.sections.centring import traces_of


def run(**changed: Any) -> Event:
    detail: dict[str, Any] = {
        "placement": 2,
        "first_psd": 1,
        "strategy": "measured",
        "status": "CENTRED",
        "tolerance_m": 5e-6,
        "target_m": [1e-3, 0.0, 0.0, 0.0],
        "spots_m": [[3e-3, 0.0, -1e-3, 0.0], [1e-3, 0.0, 0.0, 4e-6]],
        "purpose": ["start", "correct"],
    }
    return Event(0.0, "centring", detail | changed)


def test_the_error_is_the_largest_distance_from_the_target() -> None:
    (trace,) = traces_of([run()]).runs
    np.testing.assert_allclose(trace.error_m, [2e-3, 4e-6])


def test_the_first_look_is_no_step() -> None:
    assert traces_of([run()]).runs[0].steps == 1


def test_a_dark_face_leaves_a_hole_in_the_trace() -> None:
    """A NaN is written into a recording as null."""
    (trace,) = traces_of([run(spots_m=[[None] * 4, [1e-3, 0.0, math.nan, 0.0], [1e-3, 0.0, 0.0, 0.0]])]).runs
    assert np.isnan(trace.error_m).tolist() == [True, True, False]


def test_probing_steps_are_counted() -> None:
    probed = run(spots_m=[[0.0] * 4] * 3, purpose=["start", "probe", "probe"])
    assert traces_of([probed]).runs[0].probes == 2


def test_runs_are_grouped_by_tolerance_the_finest_first() -> None:
    groups = traces_of([run(tolerance_m=1.5e-3), run(), run()]).by_tolerance()
    assert [(wanted, len(runs)) for wanted, runs in groups.items()] == [(5e-6, 2), (1.5e-3, 1)]


def test_what_cannot_be_read_is_counted_and_other_events_are_not() -> None:
    broken = [run(spots_m="none"), run(target_m=None), run(tolerance_m=0.0), Event(0.0, "centring", {})]
    traces = traces_of([*broken, Event(0.0, "placement", {"id": 1})])
    assert (len(traces.runs), traces.unreadable) == (0, 4)
