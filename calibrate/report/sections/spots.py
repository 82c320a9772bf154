"""The chapter on where the light fell."""

import numpy as np

from calibrate.report.elements import Html, figure, panels, section
from calibrate.report.spot_session import SpotSession
from calibrate.report.spots_figure import face
from calibrate.report.tones import colour_key

TITLE = "Spots on the faces"


def spots(session: SpotSession) -> Html:
    """Both faces, and how much of them was used."""
    fixture = session.rig.fixture
    if fixture is None:
        return section("spots", TITLE, "The rig has no fixture.")
    half_m, data = fixture.half_size_m, session.data
    lead = (
        "Every settled sample. Circles: the face was struck directly; triangles: by light that the other face reflects."
    )
    figures = [
        figure(face(data, psd, half_m, session.places), _reach(data.spots_m[:, 2 * psd - 2 : 2 * psd], half_m))
        for psd in (1, 2)
    ]
    return section("spots", TITLE, lead, colour_key(session.places), panels(*figures))


def _reach(spots_m: np.ndarray, half_m: float) -> str:
    x, y = np.ptp(spots_m, axis=0) / (2.0 * half_m)
    return f"Spots cover {x:.0%} of the face in x and {y:.0%} in y; the square is the face, {2e3 * half_m:g} mm wide."
