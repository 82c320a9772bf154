"""A layout for Foxglove (also Lichtblick): both faces, spots and joints over time, flags as states, events in words.

Form: what the program's "Export layout" writes: panels by id in `configById`, a tree of splits in `layout`; message
paths are topic.field (docs.foxglove.dev, Message path syntax).
"""

from collections.abc import Sequence
from typing import Any

from acquisition.recording.mcap import EVENTS_TOPIC
from calibeam.layouts.views import Panel, Views, panels

FLAGS = "flags"  # whole numbers that stand for states
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")  # Okabe and Ito
FACE_M = 0.012  # half a side of what is drawn round a face: faces are 10 mm and less


def foxglove_layout(views: Views) -> dict[str, Any]:
    """The layout as its JSON document."""
    config: dict[str, dict[str, Any]] = {}
    for number, face in enumerate(_faces(views), start=1):
        config[f"Plot!face{number}"] = face
    for number, panel in enumerate(panels(views), start=1):
        states = all(field == FLAGS for _, field in panel.curves)
        config[f"{'StateTransitions' if states else 'Plot'}!panel{number}"] = _states(panel) if states else _plot(panel)
    if EVENTS_TOPIC in views.others:
        config["RawMessages!events"] = {"topicPath": EVENTS_TOPIC, "diffEnabled": False, "diffMethod": "custom"}
    return {
        "configById": config,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _tree(list(config), "row"),
    }


def _plot(panel: Panel) -> dict[str, Any]:
    return {
        "paths": [_path(topic, field, i) for i, (topic, field) in enumerate(panel.curves)],
        "xAxisVal": "timestamp",
        **_common(panel.name),
    }


def _states(panel: Panel) -> dict[str, Any]:
    return {
        "paths": [{"value": f"{t}.{f}", "timestampMethod": "receiveTime"} for t, f in panel.curves],
        "isSynced": True,
        "foxglovePanelTitle": panel.name,
    }


def _faces(views: Views) -> list[dict[str, Any]]:
    """The spot on each face, y against x."""
    return [
        {
            "paths": [_path(*y, 0)],
            "xAxisVal": "custom",
            "xAxisPath": {"value": ".".join(x), "enabled": True, "timestampMethod": "receiveTime"},
            **{f"{side}{axis}Value": sign * FACE_M for side, sign in (("min", -1), ("max", 1)) for axis in "XY"},
            **_common(f"PSD {k}, face (m)"),
        }
        for k in (1, 2)
        for x, y in zip(views.like("spots", f"psd{k}_x"), views.like("spots", f"psd{k}_y"), strict=False)
    ]


def _path(topic: str, field: str, number: int) -> dict[str, Any]:
    return {
        "value": f"{topic}.{field}",
        "enabled": True,
        "timestampMethod": "receiveTime",
        "label": field,
        "color": COLOURS[number % len(COLOURS)],
    }


def _common(title: str) -> dict[str, Any]:
    return {
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": True,
        "isSynced": True,
        "sidebarDimension": 240,
        "foxglovePanelTitle": title,
    }


def _tree(ids: Sequence[str], direction: str) -> Any:
    """Panels split in halves, across and down in turn."""
    if len(ids) == 1:
        return ids[0]
    half = (len(ids) + 1) // 2
    across = "column" if direction == "row" else "row"
    return {
        "first": _tree(ids[:half], across),
        "second": _tree(ids[half:], across),
        "direction": direction,
        "splitPercentage": 100.0 * half / len(ids),
    }
