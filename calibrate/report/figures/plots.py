"""The chapter of figures that can be turned, and their plots as Plotly reads them: no network and no other file.

Plots are plain data, so that Plotly is loaded only where it is needed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from calibrate.report.elements.html import Html, section, tag

Floats = NDArray[np.float64]
Trace = Mapping[str, Any]

INK, SOFT, BEAM = "#16202b", "#55626f", "#c8003c"  # of report.css on white paper
TONES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")  # Okabe and Ito, as tones.py
SYMBOLS = ("circle", "diamond", "square", "cross", "x", "triangle-up")  # beside the colours
DIGITS = 7  # of a number in the page: metres to 0.1 µm


@dataclass(frozen=True)
class Plot:
    """One figure: `name` is unique in the page, `says` is read to who cannot see it."""

    name: str
    says: str
    caption: str
    traces: tuple[Trace, ...]
    layout: Mapping[str, Any]


def space(traces: Sequence[Trace], name: str, says: str, caption: str) -> Plot:
    """A figure in the base frame, all axes in m and of one scale."""
    axes = {f"{a}axis": {"title": {"text": f"{a} (m)"}} for a in "xyz"}
    scene = {"aspectmode": "data", **axes}
    return Plot(name, says, caption, tuple(traces), {"scene": scene, "height": 620, **_common()})


def plane(traces: Sequence[Trace], name: str, says: str, caption: str, across: str, up: str) -> Plot:
    """A flat figure."""
    axes = {"xaxis": {"title": {"text": across}}, "yaxis": {"title": {"text": up}}}
    return Plot(name, says, caption, tuple(traces), {**axes, "height": 420, "hovermode": "closest", **_common()})


def _common() -> dict[str, Any]:
    return {
        "margin": {"l": 60, "r": 10, "t": 10, "b": 50},
        "legend": {"orientation": "h", "y": 1.08},
        "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "#ffffff",
        "font": {"color": INK, "size": 13},
    }


def line3(points_m: Floats, name: str, colour: str, *, width: float = 4.0, shown: bool = True) -> Trace:
    """A line through points (n, 3) of the base frame; a row of NaN parts it."""
    return {
        "type": "scatter3d",
        "mode": "lines",
        **coordinates(points_m),
        "name": name,
        "line": {"color": colour, "width": width},
        "hoverinfo": "name",
        "visible": True if shown else "legendonly",
    }


def coordinates(points_m: Floats) -> dict[str, list[float | None]]:
    """x, y, z of points (n, 3)."""
    return {a: numbers(points_m[:, k]) for k, a in enumerate("xyz")}


def numbers(values: Floats) -> list[float | None]:
    """For JSON: null where there is no number."""
    return [float(f"{v:.{DIGITS}g}") if np.isfinite(v) else None for v in values.tolist()]


def posture(q_rad: Floats) -> str:
    """Joint angles of one pose for a label: 'J1 10.00°, J2 …'."""
    return ", ".join(f"J{i} {degrees(q):.2f}°" for i, q in enumerate(q_rad.tolist(), start=1))


INTERACTIVE_TITLE = "To turn and to ask"
LEAD = "Drag to turn, scroll to come nearer, point at a mark for its numbers, click on a name to hide it."
CONFIG = {"displaylogo": False, "responsive": True, "showSendToCloud": False}


def interactive_chapter(plots: Sequence[Plot]) -> Html:
    """Every plot with its caption, the library once in front of them."""
    return section(
        "interactive", INTERACTIVE_TITLE, LEAD, _script(_library()), *(part for p in plots for part in _plot(p))
    )


def _library() -> str:
    """Five megabytes: read only when they are asked for."""
    from plotly.offline import get_plotlyjs

    return str(get_plotlyjs())


def _plot(plot: Plot) -> tuple[Html, Html]:
    content = (plot.name, plot.traces, plot.layout, CONFIG)
    arguments = ", ".join(msgspec.json.encode(part).decode() for part in content)
    drawing = tag("div", "", id=plot.name, cls="plot", role="img", aria_label=plot.says)
    return tag("figure", drawing, tag("figcaption", plot.caption)), _script(f"Plotly.newPlot({arguments});")


def _script(text: str) -> Html:
    """JavaScript that the parser of HTML does not end early: https://html.spec.whatwg.org/#restrictions-for-contents-of-script-elements."""
    for begins in ("</script", "<script", "<!--"):
        text = text.replace(begins, f"\\x3c{begins[1:]}")
    return tag("script", Html(text))
