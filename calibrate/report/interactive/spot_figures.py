"""A figure to turn of a session with spots: the rig with its beams."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.report.interactive.plots import (
    BEAM,
    INK,
    TONES,
    Plot,
    Trace,
    coordinates,
    line3,
    numbers,
    posture,
    space,
)
from calibrate.report.quantities import length
from calibrate.report.rig_scene import FittedRig, Scene, fitted_rig, scene
from calibrate.report.session_evidence import SpotSession

Floats = NDArray[np.float64]


def spots_in_space(session: SpotSession) -> Plot | None:
    """The rig with the beam of every pose; None for a rig that cannot be drawn."""
    try:
        rig = fitted_rig(session)
    except DataError:
        return None
    drawn = scene(rig, session.data, session.places)
    return space(
        [*_standing(drawn), *_faces(drawn), *_beams(session, rig), _lasers(session, rig)],
        "plot-space",
        "the rig in space: arm, faces, beams, and where the laser was at every pose",
        "The rig as identified: the arm at the best centred pose of every place, both faces to scale, the beam of "
        "every pose from laser to second face, and where the laser was, darker where the spots are missed by more.",
    )


def _standing(drawn: Scene) -> Iterator[Trace]:
    for i, arm in enumerate(drawn.arms):
        colour = INK if i == 0 else TONES[i % len(TONES)]
        yield line3(arm.bones_m, f"arm at place {arm.placement}", colour, width=7.0 if i == 0 else 3.0, shown=i == 0)


def _faces(drawn: Scene) -> Iterator[Trace]:
    for i, (place, corners) in enumerate(drawn.faces_m.items()):
        parted = np.concatenate([np.concatenate([c, c[:1], np.full((1, 3), np.nan)]) for c in corners])
        yield line3(parted, f"faces at place {place}", TONES[i % len(TONES)], width=5.0)


def _beams(session: SpotSession, rig: FittedRig) -> Iterator[Trace]:
    data = session.data
    parts = [
        np.concatenate(
            [
                rig.believed.beam(q)[0][None],
                rig.struck_m(int(place), int(first), spots),
                np.full((1, 3), np.nan),
            ]
        )
        for q, place, first, spots in zip(data.q_rad, data.placement, data.first_psd, data.spots_m, strict=True)
    ]
    yield line3(np.concatenate(parts), "beams", BEAM, width=1.0)


def _lasers(session: SpotSession, rig: FittedRig) -> Trace:
    error = 1e6 * session.readings.error_after
    bar = {"title": {"text": "spots off (µm)"}}
    return {
        "type": "scatter3d",
        "mode": "markers",
        **coordinates(np.array([rig.believed.beam(q)[0] for q in session.data.q_rad])),
        "name": "laser",
        "marker": {
            "size": 4,
            "color": numbers(error),
            "colorscale": "Cividis",
            "reversescale": True,
            "colorbar": bar,
        },
        "text": _labels(session),
        "hoverinfo": "text",
    }


def _labels(session: SpotSession) -> list[str]:
    data, errors = session.data, session.readings
    rows = zip(data.placement, data.first_psd, data.q_rad, errors.error_before, errors.error_after, strict=True)
    return [
        f"pose {i}, place {place}, PSD {first} first<br>nominal {length(float(b))}, calibrated {length(float(a))}<br>"
        f"{posture(q)}"
        for i, (place, first, q, b, a) in enumerate(rows, start=1)
    ]
