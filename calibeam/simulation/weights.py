"""Weights that load a spring as was found, where masses are not known or were corrected.

The effect is linear in masses and first moments (Atkeson, An, Hollerbach, Int. J. Robotics Research 5(3), 1986), and so
is the mechanism: least squares of the one in the other over the session's samples, the smallest weights that do it.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from calibeam.simulation.found import Found
from simulators.arm.statics import Load, Weight, carried_by, loaded_by
from simulators.defects.link import cantilever

Floats = NDArray[np.float64]
Weights = tuple[tuple[Weight, ...], float]  # and the compliance towards the payload
Felt = Callable[[tuple[Floats, Floats]], Floats]  # moment and force at the start of a link -> (row, k)
CENTRE_M = 0.1  # first moments are sought as masses at this distance
WEAKEST = 1e-8  # of the strongest: a combination of weights that shows less is none


def spring_weights(found: Found) -> Weights:
    """Of a soft joint."""
    joint = found.number
    return _fitted(found, joint, joint, lambda at: at[0][:, 2:], found.turn_rad()[:, np.newaxis])


def beam_weights(found: Found) -> Weights:
    """Of a link that bends, by the slope and the sag at its end."""
    link, session = found.number, found.session
    end = session.arm.fixed[link]
    length_m = float(np.linalg.norm(end[:3, 3]))

    def felt(at: tuple[Floats, Floats]) -> Floats:
        return np.concatenate(cantilever(end[:3, 3], *at), axis=1) / length_m

    slope = found.amount[:, 3:]
    sag = found.amount[:, :3] - np.cross(slope, [0.0, 0.0, session.beyond_m[link]])
    return _fitted(found, link, link + 1, felt, np.concatenate([sag @ end[:3, :3].T, slope @ end[:3, :3].T], axis=1))


def pedestal_weights(found: Found) -> Weights:
    """Of a soft pedestal. The effect turns what stands around it."""
    return _fitted(found, 0, 1, lambda at: at[0][:, :2], -found.amount[:, 3:5])


def _fitted(found: Found, link: int, first: int, felt: Felt, wanted: Floats) -> Weights:
    """Weights of the bodies from `first` on that make `wanted` (row, k) of what is felt at the start of `link`."""
    session = found.session
    load, n = session.load, session.drivers.n_joints
    bodies = [Weight(body, 1.0, (0.0, 0.0, 0.0)) for body in range(first, n + 1)]
    bodies += [Weight(body, 0.0, _moment(axis)) for body in range(first, n + 1) for axis in range(3)]
    columns = [felt(loaded_by(load, [body], link)).ravel() for body in bodies]
    carries = bool(np.ptp(session.payload_kg) > 0.0)
    if carries:
        columns.append(felt(_payload(found, load, link)).ravel())
    sizes, *_ = np.linalg.lstsq(np.stack(columns, axis=1), wanted.ravel(), rcond=WEAKEST)
    weights = tuple(_times(body, float(size)) for body, size in zip(bodies, sizes, strict=False))
    return weights, float(sizes[-1]) if carries else 0.0


def _payload(found: Found, load: Load, link: int) -> tuple[Floats, Floats]:
    return carried_by(load, found.session.payload_kg, found.session.payload_com_m, link)


def _moment(axis: int) -> tuple[float, float, float]:
    x, y, z = (CENTRE_M * np.eye(3)[axis]).tolist()
    return x, y, z


def _times(body: Weight, size: float) -> Weight:
    x, y, z = (size * m for m in body.moment)
    return Weight(body.body, size * body.mass, (x, y, z))
