"""The chapter that shows the rig."""

import numpy as np

from calibrate.errors import DataError
from calibrate.report.colour_key import patch, place_name
from calibrate.report.elements import Html, figure, panels, section, table, tag
from calibrate.report.evidence import Evidence
from calibrate.report.reflection_figure import reflection
from calibrate.report.rig_figures import from_above, oblique
from calibrate.report.rig_scene import fitted_rig, scene

TITLE = "The rig"


def rig(evidence: Evidence) -> Html:
    """Drawings with beam and reflection, and how many poses each place has."""
    source = (
        "the recording and the fit" if evidence.corrections else "the recording and the rig file, for want of a fit"
    )
    lead = f"Drawn from {source}: true proportions, real poses, beams that end on the observed spots."
    return section("rig", TITLE, lead, *_drawings(evidence))


def _drawings(evidence: Evidence) -> list[Html]:
    try:
        fitted = fitted_rig(evidence)
    except DataError as why:
        return [tag("p", f"No drawing: {why}."), _poses(evidence)]
    first = evidence.places[0]
    drawn = scene(fitted, evidence.data, evidence.places)
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
                reflection(fitted, evidence.data, first),
                f"The fixture at place {first}, both faces seen on edge. The beam strikes one face, which reflects it "
                "onto the other; the arrows are the best centred pose of each order, the thin lines the other poses.",
            ),
            _poses(evidence),
        ),
    ]


def _poses(evidence: Evidence) -> Html:
    data = evidence.data
    rows = [
        (
            patch(i, place_name(place)),
            *(str(int(np.sum((data.placement == place) & (data.first_psd == first)))) for first in (1, 2)),
            str(int(np.sum(data.placement == place))),
        )
        for i, place in enumerate(evidence.places)
    ]
    head = ("Place", "PSD 1 first", "PSD 2 first", "poses")
    return table(head, rows, numeric=(1, 2, 3), caption="Poses by place, and by the face that is struck first")
