"""The chapters that show the rig, and where the light fell on each face."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.model.observations import Observations
from calibrate.report.elements.html import (
    Html,
    figure,
    panels,
    section,
    table,
    tag,
)
from calibrate.report.elements.svg import drawn
from calibrate.report.elements.tones import (
    Tone,
    colour_key,
    patch,
    place_mark,
    place_name,
)
from calibrate.report.evidence.session_evidence import SpotSession
from calibrate.report.figures.reflection_figure import reflection
from calibrate.report.figures.rig_figures import from_above, oblique
from calibrate.report.figures.rig_scene import fitted_rig, scene

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


SPOTS_TITLE = "Spots on the faces"


def spots(session: SpotSession) -> Html:
    """Both faces, and how much of them was used."""
    fixture = session.rig.fixture
    if fixture is None:
        return section("spots", SPOTS_TITLE, "The rig has no fixture.")
    half_m, data = fixture.half_size_m, session.data
    lead = (
        "Every settled sample. Circles: the face was struck directly; triangles: by light that the other face reflects."
    )
    figures = [
        figure(face(data, psd, half_m, session.places), _reach(data.spots_m[:, 2 * psd - 2 : 2 * psd], half_m))
        for psd in (1, 2)
    ]
    return section("spots", SPOTS_TITLE, lead, colour_key(session.places), panels(*figures))


def _reach(spots_m: np.ndarray, half_m: float) -> str:
    x, y = np.ptp(spots_m, axis=0) / (2.0 * half_m)
    return f"Spots cover {x:.0%} of the face in x and {y:.0%} in y; the square is the face, {2e3 * half_m:g} mm wide."


RIG_TITLE = "The rig"


def rig(session: SpotSession) -> Html:
    """Drawings with beam and reflection, and how many poses each station has."""
    source = "the recording and the fit" if session.corrections else "the recording and the rig file, for want of a fit"
    lead = f"Drawn from {source}: true proportions, real poses, beams that end on the observed spots."
    return section("rig", RIG_TITLE, lead, *_drawings(session))


def _drawings(session: SpotSession) -> list[Html]:
    try:
        fitted = fitted_rig(session)
    except DataError as why:
        return [tag("p", f"No drawing: {why}."), _poses(session)]
    first = session.places[0]
    drawn = scene(fitted, session.data, session.places)
    return [
        panels(
            figure(
                oblique(drawn),
                f"The arm at its best centred pose at station {first}, its joints numbered; other stations in colour. "
                "The laser beam is drawn through to the second face. Tiles of the floor are 0.2 m.",
            ),
            figure(
                from_above(drawn),
                "The same from above. Circles only mark where the fixture stands; the bars in them are its two faces.",
            ),
        ),
        panels(
            figure(
                reflection(fitted, session.data, first),
                f"The fixture at station {first}, both faces seen on edge. The beam strikes one face, which reflects "
                "it onto the other; arrows: the best centred pose of each beam order; thin lines: the other poses.",
            ),
            _poses(session),
        ),
    ]


def _poses(session: SpotSession) -> Html:
    data = session.data
    rows = [
        (
            patch(i, place_name(place)),
            *(str(int(np.sum((data.placement == place) & (data.first_psd == first)))) for first in (1, 2)),
            str(int(np.sum(data.placement == place))),
        )
        for i, place in enumerate(session.places)
    ]
    head = ("Station", "PSD 1 first", "PSD 2 first", "poses")
    return table(head, rows, numeric=(1, 2, 3), caption="Poses by station, and by the face that is struck first")
