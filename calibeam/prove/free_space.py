"""Error in free space against the world's truth: where a model puts the tool, and where it truly is.

Where the base frame stands is nobody's error, so the best rigid motion between both is taken out first. A beam has no
point that is its own: its error is the distance of the true beam's points, at working distances, from the said line.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibeam.prove.truth import FreeSpace
from calibeam.prove.unseen_poses import Beam, Tool

Floats = NDArray[np.float64]

REACH_M = (0.08, 0.45)  # along a beam: from the nearest to the farthest detector of a session
TURNS = 6  # of Gauss-Newton for the best motion: errors are small, three are enough


def errors_m(said: Tool | None, truth: FreeSpace) -> float | None:
    """Rms over the poses, three axes together. None where the model says nothing, or not of the same tool."""
    if isinstance(said, Beam):
        if truth.beam_origin_m is None or truth.beam_direction is None:
            return None
        return _beams_m(said, np.array(truth.beam_origin_m), np.array(truth.beam_direction))
    if said is None or truth.tip_m is None:
        return None
    return _rms(_tips_m(said, np.array(truth.tip_m)))


def _tips_m(said: Floats, true: Floats) -> Floats:
    """(pose, 3) after the best rigid motion. Source: Kabsch, Acta Cryst. A32, 1976."""
    a, b = said - said.mean(axis=0), true - true.mean(axis=0)
    turn = Rotation.align_vectors(b, a)[0]
    return turn.apply(a) - b


def _beams_m(said: Beam, origin_m: Floats, direction: Floats) -> float:
    along = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    points = np.concatenate([origin_m + s * along for s in REACH_M])
    start = np.concatenate([said.origin_m] * len(REACH_M))
    line = np.concatenate([said.direction / np.linalg.norm(said.direction, axis=1, keepdims=True)] * len(REACH_M))
    turn, shift = Rotation.identity(), np.zeros(3)
    for _ in range(TURNS):
        away, d = _away(turn.apply(start) + shift, turn.apply(line), points)
        across = np.eye(3) - d[:, :, None] * d[:, None, :]
        step, *_ = np.linalg.lstsq(_slope(points, across), away.ravel(), rcond=None)
        small = Rotation.from_rotvec(step[3:])
        turn, shift = small * turn, small.apply(shift) + step[:3]
    return _rms(_away(turn.apply(start) + shift, turn.apply(line), points)[0])


def _away(start: Floats, line: Floats, points: Floats) -> tuple[Floats, Floats]:
    """(point, 3) from each line to its point, across the line; and the lines' directions."""
    span = points - start
    return span - np.sum(span * line, axis=1, keepdims=True) * line, line


def _slope(points: Floats, across: Floats) -> Floats:
    """(3 point, 6) by which the foot of each point moves across its line, by shift and turn [v; w] of the lines."""
    turned = np.cross(np.eye(3)[None, :, :], points[:, None, :])  # (point, axis, 3): w x p
    by = np.concatenate([np.broadcast_to(np.eye(3), (len(points), 3, 3)), np.swapaxes(turned, 1, 2)], axis=2)
    return (across @ by).reshape(-1, 6)


def _rms(errors: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))
