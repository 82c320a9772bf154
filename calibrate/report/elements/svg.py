"""A matplotlib figure as SVG inside the page: its text in the page's font, its colours the page's, its ids its own."""

import io
import re
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from typing import Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator
from numpy.typing import NDArray

from calibrate.fit.rank import WEAK
from calibrate.quantities import power_of_ten
from calibrate.report.elements.html import Html, escaped
from calibrate.report.elements.tones import Tone

FONT = "DejaVu Sans"  # comes with matplotlib, so that layouts are the same everywhere; the page puts in its own
STYLE = {
    "svg.fonttype": "none",
    "svg.hashsalt": "calibeam",  # the same figure gives the same bytes
    "font.family": [FONT],
    "font.size": 10.0,  # of 4.8 in in a panel, or 9.9 in over the page: 7.2 points on A4; none is smaller
    "hatch.linewidth": 0.6,
    "text.parse_math": False,
    "text.color": Tone.INK.value,
    "axes.labelcolor": Tone.SOFT.value,
    "axes.edgecolor": Tone.SOFT.value,
    "axes.linewidth": 0.8,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.use_mathtext": False,
    "grid.color": Tone.FAINT.value,
    "grid.linewidth": 0.8,
    "xtick.color": Tone.SOFT.value,
    "ytick.color": Tone.SOFT.value,
    "xtick.minor.visible": False,
    "ytick.minor.visible": False,
    "legend.frameon": False,
    "legend.fontsize": 10.0,
    "legend.handlelength": 1.4,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "savefig.facecolor": "none",
}
POINT_PX = 1.25  # largest magnification on a wide page


@contextmanager
def house_style() -> Generator[None]:
    """Figures made and written inside look alike, whatever the user's own matplotlib settings are."""
    with mpl.rc_context():
        mpl.rcdefaults()
        for key, value in STYLE.items():
            mpl.rcParams[key] = value  # pyright: ignore[reportArgumentType] - keys are checked by matplotlib itself
        yield


def drawn(
    name: str,
    says: str,
    width_in: float,
    height_in: float,
    paint: Callable[[Figure], None],
    margins: Mapping[str, float] | None = None,
) -> Html:
    """What `paint` draws, as inline SVG. `name` is unique in the page; `says` is read to who cannot see it.

    `margins` as of `Figure.subplots_adjust`, for figures of one kind on one page: a layout that fits each would take as
    long as drawing it.
    """
    with house_style():
        figure = Figure(figsize=(width_in, height_in), layout=None if margins else "constrained")
        if margins:
            figure.subplots_adjust(**margins)
        paint(figure)
        text = io.StringIO()
        FigureCanvasSVG(figure).print_svg(text)  # not savefig, which lays out and draws everything once more before
    return inlined(text.getvalue(), name, says)


def log_axis(axes: Axes, which: Literal["x", "y"], values: Sequence[float], says: Callable[[float], str]) -> None:
    """A logarithmic axis round these values, labelled 1 2 5 over less than two decades, else 1."""
    low, high = min(values) / 1.8, max(values) * 1.8
    axis = axes.xaxis if which == "x" else axes.yaxis
    if which == "x":
        axes.set(xscale="log", xlim=(low, high))
    else:
        axes.set(yscale="log", ylim=(low, high))
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100.0 * low else (1.0,)))
    axis.set_major_formatter(FuncFormatter(_labelling(says)))
    axis.set_minor_locator(NullLocator())
    axis.set_minor_formatter(NullFormatter())


def _labelling(says: Callable[[float], str]) -> Callable[[float, int | None], str]:
    """What matplotlib asks for: it passes the tick's number, too."""

    def label(value: float, _: int | None) -> str:
        return says(value)

    return label


def inlined(svg: str, name: str, says: str) -> Html:
    """The SVG without what only a file of its own needs, with ids that begin with `name` and the page's colours."""
    svg = svg[svg.index("<svg") :]
    for needless in (r"<metadata>.*?</metadata>", r"<style[^>]*>.*?</style>", r"<!--.*?-->", r"<defs>\s*</defs>"):
        svg = re.sub(needless, "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    svg = re.sub(r'(?:xlink:)?href="#', f'href="#{name}-', svg)
    svg = svg.replace("url(#", f"url(#{name}-")
    for tone in Tone:
        svg = svg.replace(tone.value, tone.css)
    svg = svg.replace(f"'{FONT}'", "var(--sans)").replace(f'"{FONT}"', "var(--sans)")
    return Html(_own_root(svg, says).strip())


def _own_root(svg: str, says: str) -> str:
    """Only the view box stays of the root element, so that the page gives the size."""
    box = re.search(r'viewBox="([^"]*)"', svg)
    if box is None:
        raise ValueError("matplotlib wrote an SVG without a viewBox; this version of it is not known")
    width = float(box[1].split()[2]) * POINT_PX
    root = f'<svg viewBox="{box[1]}" role="img" aria-label="{escaped(says)}" style="max-width: {width:.0f}px">'
    return re.sub(r"<svg[^>]*>", lambda _: root, svg, count=1)


Floats = NDArray[np.float64]

DRAWING = 2.0**0.5  # s^2 = data + 1 for a combination of toleranced links: below, the drawing shows more than the data


def spectrum(singular_values: Floats, rank: int, name: str, *, with_drawing: bool = True) -> Html:
    """Singular values in falling order on a log axis; hollow: not seen."""
    says = f"{len(singular_values)} singular values, {rank} of them above the threshold"
    return drawn(name, says, 4.8, 3.6, lambda figure: _paint_spectrum(figure, singular_values, rank, with_drawing))


def _paint_spectrum(figure: Figure, s: Floats, rank: int, with_drawing: bool) -> None:
    axes = figure.add_subplot()
    axes.set_yscale("log")
    number = np.arange(1, len(s) + 1)
    shown = np.maximum(s, np.finfo(float).eps * s[0])  # below is rounding, and zero has no place on a log axis
    drawing = np.zeros(len(s), dtype=bool) if not with_drawing else s < DRAWING
    drawing[rank:] = False
    data = ~drawing
    data[rank:] = False
    for rows, tone, mark, filled, label in (
        (data, Tone.PLACE_1, "o", True, "known from the data"),
        (drawing, Tone.PLACE_5, "s", True, "known from the nominal values"),
        (number > rank, Tone.BEAM, "o", False, "not known"),
    ):
        if rows.any():
            face = tone.value if filled else "none"
            text = f"{label}: {int(rows.sum())}"
            axes.plot(number[rows], shown[rows], mark, ms=5, mfc=face, mec=tone.value, mew=1.4, label=text)
    axes.axhline(WEAK, color=Tone.INK.value, lw=1.1, linestyle=(0, (4, 3)))
    axes.annotate("not determined below", (1.0, WEAK), (2, -11), textcoords="offset points", fontsize=10)
    axes.yaxis.set_major_formatter(FuncFormatter(_power))
    axes.set(xlabel="combination of parameters", title="Plausible size over sigma, of each combination")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 0.08))


def _power(value: float, _: int | None) -> str:
    return power_of_ten(round(np.log10(value)))
