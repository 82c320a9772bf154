"""The chapter of figures that can be turned and asked: Plotly within the page, no network and no other file."""

from collections.abc import Sequence

import msgspec

from calibrate.report.elements import Html, section, tag
from calibrate.report.interactive.plots import Plot

TITLE = "To turn and to ask"
LEAD = "Drag to turn, scroll to come nearer, point at a mark for its numbers, click on a name to hide it."
CONFIG = {"displaylogo": False, "responsive": True, "showSendToCloud": False}


def interactive_chapter(plots: Sequence[Plot]) -> Html:
    """Every plot with its caption, the library once in front of them."""
    return section("interactive", TITLE, LEAD, _script(_library()), *(part for p in plots for part in _plot(p)))


def _library() -> str:
    """Five megabytes: read only when they are asked for."""
    from plotly.offline import get_plotlyjs

    return str(get_plotlyjs())


def _plot(plot: Plot) -> tuple[Html, Html]:
    content = (plot.name, plot.traces, plot.layout, CONFIG)
    told = ", ".join(msgspec.json.encode(part).decode() for part in content)
    drawing = tag("div", "", id=plot.name, cls="plot", role="img", aria_label=plot.says)
    return tag("figure", drawing, tag("figcaption", plot.caption)), _script(f"Plotly.newPlot({told});")


def _script(text: str) -> Html:
    """JavaScript that the parser of HTML does not end early: https://html.spec.whatwg.org/#restrictions-for-contents-of-script-elements."""
    for begins in ("</script", "<script", "<!--"):
        text = text.replace(begins, f"\\x3c{begins[1:]}")
    return tag("script", Html(text))
