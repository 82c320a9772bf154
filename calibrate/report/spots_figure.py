"""Where the light fell: all settled spots on each face."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from calibrate.observations import Observations
from calibrate.report.elements import Html
from calibrate.report.svg import drawn
from calibrate.report.tones import Tone, place_mark

Floats = NDArray[np.float64]


def face(data: Observations, psd: int, half_size_m: float, places: Sequence[int]) -> Html:
    """One face as the beam sees it from its front; circle: struck directly, triangle: by reflection."""
    says = f"spots on the face of PSD {psd}"
    return drawn(f"spots-{psd}", says, 3.5, 3.65, lambda figure: _paint(figure, data, psd, half_size_m, places))


def _paint(figure: Figure, data: Observations, psd: int, half_size_m: float, places: Sequence[int]) -> None:
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    half_mm = half_size_m * 1e3
    axes.add_patch(Rectangle((-half_mm, -half_mm), 2 * half_mm, 2 * half_mm, fill=False, ec=Tone.INK.value, lw=1.4))
    axes.axhline(0.0, color=Tone.SOFT.value, lw=0.6)
    axes.axvline(0.0, color=Tone.SOFT.value, lw=0.6)
    spots_mm = data.spots_m[:, 2 * psd - 2 : 2 * psd] * 1e3
    for number, place in enumerate(places):
        for direct, marker in ((True, "o"), (False, "^")):
            rows = (data.placement == place) & ((data.first_psd == psd) == direct)
            style = place_mark(number)
            axes.plot(*spots_mm[rows].T, marker, ms=5.5, mew=1.3, clip_on=False, **style)  # pyright: ignore[reportArgumentType]
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set(xlim=(-1.06 * half_mm, 1.06 * half_mm), ylim=(-1.06 * half_mm, 1.06 * half_mm))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(nbins=5, steps=[1, 2, 5, 10]))
    axes.set(xlabel="x (mm)", ylabel="y (mm)", title=f"PSD {psd}")
