"""The chapter that shows the rig."""

import numpy as np

from calibrate.errors import DataError
from calibrate.report.elements import Html, figure, panels, section, table, tag
from calibrate.report.reflection_figure import reflection
from calibrate.report.rig_figures import from_above, oblique
from calibrate.report.rig_scene import fitted_rig, scene
from calibrate.report.spot_session import SpotSession
from calibrate.report.tones import patch, place_name

TITLE = "The rig"


def rig(session: SpotSession) -> Html:
    """Drawings with beam and reflection, and how many poses each place has."""
    source = "the recording and the fit" if session.corrections else "the recording and the rig file, for want of a fit"
    lead = f"Drawn from {source}: true proportions, real poses, beams that end on the observed spots."
    return section("rig", TITLE, lead, *_drawings(session))


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
                f"The arm at its best centred pose at place {first}, its joints numbered; other places in colour. "
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
                f"The fixture at place {first}, both faces seen on edge. The beam strikes one face, which reflects it "
                "onto the other; the arrows are the best centred pose of each order, the thin lines the other poses.",
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
    head = ("Place", "PSD 1 first", "PSD 2 first", "poses")
    return table(head, rows, numeric=(1, 2, 3), caption="Poses by place, and by the face that is struck first")
