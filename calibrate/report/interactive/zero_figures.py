"""Figures to turn of a dual-PSD session: the rig with its beams, and the spots that the model misses, one by one."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.report.evidence import Evidence
from calibrate.report.interactive.plots import (
    BEAM,
    INK,
    SYMBOLS,
    TONES,
    Plot,
    Trace,
    coordinates,
    line3,
    numbers,
    plane,
    posture,
    space,
)
from calibrate.report.quantities import length
from calibrate.report.residual_figures import COORDINATES
from calibrate.report.rig_scene import FittedRig, Scene, fitted_rig, scene

Floats = NDArray[np.float64]


def zero_figures(evidence: Evidence) -> tuple[Plot, ...]:
    """Without a rig that can be drawn, the residuals alone."""
    try:
        rig = fitted_rig(evidence)
    except DataError:
        return (_one_by_one(evidence),)
    return _in_space(evidence, rig), _one_by_one(evidence)


def _in_space(evidence: Evidence, rig: FittedRig) -> Plot:
    drawn = scene(rig, evidence.data, evidence.places)
    return space(
        [*_standing(drawn), *_faces(drawn), *_beams(evidence, rig), _lasers(evidence, rig)],
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


def _beams(evidence: Evidence, rig: FittedRig) -> Iterator[Trace]:
    data = evidence.data
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


def _lasers(evidence: Evidence, rig: FittedRig) -> Trace:
    error = 1e6 * np.linalg.norm(evidence.result.residual_after_m, axis=1)
    bar = {"title": {"text": "spots off (µm)"}}
    return {
        "type": "scatter3d",
        "mode": "markers",
        **coordinates(np.array([rig.believed.beam(q)[0] for q in evidence.data.q_rad])),
        "name": "laser",
        "marker": {
            "size": 4,
            "color": numbers(error),
            "colorscale": "Cividis",
            "reversescale": True,
            "colorbar": bar,
        },
        "text": _labels(evidence),
        "hoverinfo": "text",
    }


def _labels(evidence: Evidence) -> list[str]:
    data, result = evidence.data, evidence.result
    errors = (np.linalg.norm(r, axis=1) for r in (result.residual_before_m, result.residual_after_m))
    rows = zip(data.placement, data.first_psd, data.q_rad, *errors, strict=True)
    return [
        f"pose {i}, place {place}, PSD {first} first<br>as drawn {length(float(b))}, identified {length(float(a))}<br>"
        f"{posture(q)}"
        for i, (place, first, q, b, a) in enumerate(rows, start=1)
    ]


def _one_by_one(evidence: Evidence) -> Plot:
    result = evidence.result
    states = (("identified", result.residual_after_m), ("as drawn", result.residual_before_m))
    traces = [
        {
            "type": "scatter",
            "mode": "markers",
            "x": list(range(1, result.n_poses + 1)),
            "y": numbers(1e6 * values[:, k]),
            "name": f"{name}, {state}",
            "hovertemplate": "pose %{x}: %{y} µm",
            "marker": {"color": TONES[k], "symbol": SYMBOLS[k], "size": 5},
            "visible": True if state == "identified" else "legendonly",
        }
        for state, values in states
        for k, name in enumerate(COORDINATES)
    ]
    return plane(
        traces,
        "plot-residuals",
        "residuals of the four spot coordinates against the number of the pose",
        "Spots, expected minus observed, pose by pose. Those of the arm as drawn come with a click on their names.",
        "pose",
        "residual (µm)",
    )
