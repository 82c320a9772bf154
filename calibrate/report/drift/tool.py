"""What the change of the arm does to the tool: base and tool the same, only what both sessions determine is changed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.parameters import index_of
from calibrate.report.drift.parameters import Change
from calibrate.report.workspace.known_arm import KnownArm
from calibrate.report.workspace.room import Room, target_at
from calibrate.uncertainty.free_space import target_by_parameter

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ToolChange:
    """At the poses of a Room."""

    moved_m: Floats  # (pose,) distance between the tool now and then
    sigma_m: Floats  # (pose,) doubt of it, three axes together
    largest_m: float  # over the supported poses
    largest_sigma_m: float  # there


def tool_change(known: KnownArm, room: Room, changes: tuple[Change, ...], doubt: Floats) -> ToolChange:
    """`doubt` (change, change): covariance of the changes."""
    column = index_of(known.parameters)
    own = [column[c.name] for c in changes]
    then = known.theta.copy()
    then[own] -= np.array([c.change for c in changes])
    moved = np.linalg.norm(target_at(known, known.theta, room.q_rad) - target_at(known, then, room.q_rad), axis=1)
    J = target_by_parameter(known.arm, known, known.point_m, room.q_rad)[1][..., own]
    sigma = np.sqrt(np.maximum(np.einsum("nip,pq,niq->n", J, doubt, J, optimize=True), 0.0))
    worst = int(np.argmax(np.where(room.supported, moved, -1.0)))
    return ToolChange(moved, sigma, float(moved[worst]), float(sigma[worst]))
