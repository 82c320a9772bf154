"""Figures to turn of a session: where the errors are, the residuals one by one, and the rig with its beams."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.model.arms.serial import SerialArm
from calibrate.quantities import length
from calibrate.report.evidence.session_evidence import (
    Readings,
    SessionEvidence,
    SpotSession,
    spot_session,
)
from calibrate.report.figures.plots import (
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
from calibrate.report.figures.rig_scene import (
    FittedRig,
    Scene,
    fitted_rig,
    scene,
)

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
        "The rig as identified: the arm at the best centred pose of every station, both faces to scale, the beam of "
        "every pose from laser to second face, and where the laser was, darker where the spots are missed by more.",
    )


def _standing(drawn: Scene) -> Iterator[Trace]:
    for i, arm in enumerate(drawn.arms):
        colour = INK if i == 0 else TONES[i % len(TONES)]
        yield line3(arm.bones_m, f"arm at station {arm.placement}", colour, width=7.0 if i == 0 else 3.0, shown=i == 0)


def _faces(drawn: Scene) -> Iterator[Trace]:
    for i, (place, corners) in enumerate(drawn.faces_m.items()):
        outlines = np.concatenate([np.concatenate([c, c[:1], np.full((1, 3), np.nan)]) for c in corners])
        yield line3(outlines, f"faces at station {place}", TONES[i % len(TONES)], width=5.0)


def _beams(session: SpotSession, rig: FittedRig) -> Iterator[Trace]:
    data = session.data
    parts = [
        np.concatenate(
            [rig.assumed.beam(q)[0][None], rig.struck_m(int(place), int(first), spots), np.full((1, 3), np.nan)]
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
        **coordinates(np.array([rig.assumed.beam(q)[0] for q in session.data.q_rad])),
        "name": "laser",
        "marker": {"size": 4, "color": numbers(error), "colorscale": "Cividis", "reversescale": True, "colorbar": bar},
        "text": _spot_labels(session),
        "hoverinfo": "text",
    }


def _spot_labels(session: SpotSession) -> list[str]:
    data, errors = session.data, session.readings
    rows = zip(data.placement, data.first_psd, data.q_rad, errors.error_before, errors.error_after, strict=True)
    return [
        f"pose {i}, station {place}, PSD {first} first<br>nominal {length(float(b))}, calibrated {length(float(a))}<br>"
        f"{posture(q)}"
        for i, (place, first, q, b, a) in enumerate(rows, start=1)
    ]


COORDINATES = {3: ("x", "y", "z"), 4: ("PSD 1 x", "PSD 1 y", "PSD 2 x", "PSD 2 y")}
SCALES = {"m": (1e6, "µm"), "rad": (1e6, "µrad")}


def session_figures(evidence: SessionEvidence) -> tuple[Plot, ...]:
    """The workspace of the first instrument, and what remains of its readings."""
    first, spots = evidence.readings[0], spot_session(evidence)
    drawn = spots_in_space(spots) if spots is not None and spots.readings is first else None
    return (_in_space(evidence, first) if drawn is None else drawn), _one_by_one(evidence, first)


def _in_space(evidence: SessionEvidence, readings: Readings) -> Plot:
    q_rad = evidence.recording.samples.joints()[readings.rows[:, 0]]
    points, scale = _targets(evidence, q_rad), SCALES[readings.unit]
    after = scale[0] * readings.error_after
    worst = int(np.argmax(after))
    bar = {"title": {"text": f"error ({scale[1]})"}}
    marks = {"size": 4, "color": numbers(after), "colorscale": "Cividis", "reversescale": True, "colorbar": bar}
    poses = {
        "type": "scatter3d",
        "mode": "markers",
        **coordinates(points),
        "name": "target",
        "marker": marks,
        "text": _labels(evidence, readings),
        "hoverinfo": "text",
    }
    return space(
        [poses, *_arms(evidence, q_rad, points, worst), *_device(evidence)],
        "plot-space",
        "target at every pose, coloured by error, with the arm at its worst pose",
        "Where the target was in the base frame, darker where the identified arm misses it by more; the arm stands as "
        "in its worst pose.",
    )


def _one_by_one(evidence: SessionEvidence, readings: Readings) -> Plot:
    factor, unit = SCALES[readings.unit]
    names = COORDINATES.get(readings.after.shape[1], tuple(str(i + 1) for i in range(readings.after.shape[1])))
    number = (readings.rows[:, 0] + 1).tolist()
    traces = [
        {
            "type": "scatter",
            "mode": "markers",
            "x": number,
            "y": numbers(factor * values[:, k]),
            "name": f"{name}, {state}",
            "hovertemplate": f"sample %{{x}}: %{{y}} {unit}",
            "marker": {"color": TONES[k % len(TONES)], "symbol": SYMBOLS[k % len(SYMBOLS)], "size": 5},
            "visible": True if state == "calibrated" else "legendonly",
        }
        for state, values in (("calibrated", readings.after), ("nominal", readings.before))
        for k, name in enumerate(names)
    ]
    return plane(
        traces,
        "plot-residuals",
        f"residuals of {readings.title} against the number of the sample",
        f"{readings.title}, expected minus observed, sample by sample. A click on the names shows those of the "
        "nominal arm."
        "their names.",
        "sample",
        f"residual ({unit})",
    )


def _labels(evidence: SessionEvidence, readings: Readings) -> list[str]:
    q_rad = evidence.recording.samples.joints()[readings.rows[:, 0]]
    errors = zip(readings.error_before, readings.error_after, strict=True)
    return [
        f"sample {row + 1}<br>nominal {readings.says(float(b))}, calibrated {readings.says(float(a))}<br>{posture(q)}"
        for row, q, (b, a) in zip(readings.rows[:, 0].tolist(), q_rad, errors, strict=True)
    ]


def _values(evidence: SessionEvidence) -> dict[str, float]:
    return {p.name: float(v) for p, v in zip(evidence.parameters, evidence.theta, strict=True)}


def _targets(evidence: SessionEvidence, q_rad: Floats) -> Floats:
    """(pose, 3) in the base, of the identified arm."""
    values = _values(evidence)
    drawn = evidence.model.about.get("tool", evidence.recording.rig.tool.point_m or (0.0, 0.0, 0.0))[:3]
    point = np.array([drawn[k] + values.get(f"tool.{a}", 0.0) for k, a in enumerate("xyz")])
    T = evidence.arm.flange(np.array([values[p.name] for p in evidence.arm.parameters]), q_rad)
    return T[:, :3, :3] @ point + T[:, :3, 3]


def _arms(evidence: SessionEvidence, q_rad: Floats, points: Floats, pose: int) -> Iterator[Trace]:
    """The arm from frame to frame to the target; none of a model that shows no frames."""
    arm = getattr(evidence.arm, "arm", evidence.arm)
    if isinstance(arm, SerialArm):
        values = _values(evidence)
        theta = np.array([values[p.name] for p in arm.parameters])
        corners = arm.frames(theta, q_rad[pose : pose + 1])[0, :, :3, 3]
        bones = np.concatenate([np.zeros((1, 3)), corners, points[pose : pose + 1]])
        yield line3(bones, "arm at the worst pose", INK, width=7.0)


def _device(evidence: SessionEvidence) -> Iterator[Trace]:
    """Shown on a click, since it may stand metres away."""
    device = evidence.model.about.get("device")
    if device is not None:
        yield {
            "type": "scatter3d",
            "mode": "markers",
            **coordinates(np.array([device[:3]])),
            "name": "measuring device",
            "marker": {"size": 6, "color": BEAM, "symbol": "diamond"},
            "hoverinfo": "name",
            "visible": "legendonly",
        }
