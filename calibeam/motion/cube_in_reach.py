"""The test cube of ISO 9283 in the reach of a rig's arm: the largest one that stands before it, or the one asked for.

The standard wants the cube where the arm is used most, as large as it can be, and one orientation of the tool in all
poses (clause 6.8). Here it stands before the arm, along x of the base first, and all five poses and its eight corners
are reached with one posture, a margin to every limit, above the table and clear of the boxes of [motion]. The way
between the poses is not planned: what else stands in the cell is unknown here.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Rig
from calibeam.motion.motion_inverse import MotionInverse
from calibeam.motion.reachable_poses import clear_for_device
from calibrate.errors import DataError
from calibrate.iso9283 import Plane, cube_corners_m, cube_poses_m
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.rigid import inverse

Floats = NDArray[np.float64]

POSTURES, SEED = 2000, 1  # drawn to see how far the tool reaches
BEARINGS_DEG = (0.0, 90.0, -90.0, 180.0)  # about z of the base: the next one where the last has room for no cube
OUT = (0.4, 0.5, 0.6, 0.7)  # of the reach: where centres are tried, outwards
UP = (0.1, 0.25, 0.4, 0.55)  # and above the base
EDGES = tuple(float(share) for share in np.arange(0.1, 0.95, 0.05))  # of the reach
TILTS_DEG = (180.0, 135.0, 90.0)  # of the tool from straight up, towards outwards: down, inclined, level
MARGIN_RAD = np.radians(5.0)  # to every limit: room for overshoot points and corrections
BRANCHES = 4  # postures that are tried for one cube
STILL = 1e-3  # rad of a joint for 1 m: it does not take part in a way
STEP_RAD = 1e-6  # of a derivative


@dataclass(frozen=True, eq=False)
class CubeInReach:
    """A cube with its five poses and the joints that reach them."""

    centre_m: Floats  # (3,)
    edge_m: float
    plane: Plane
    T_base_tool: Floats  # (5, 4, 4) P1 to P5
    q_rad: Floats  # (5, joint)


def cube_in_reach(
    rig: Rig, plane: Plane, centre_m: Floats | None = None, edge_m: float | None = None, turn: Floats | None = None
) -> CubeInReach:
    """The largest cube of those tried; `centre_m` (3,), `edge_m`, `turn` (3, 3) of the tool in the base: as asked for.

    DataError where none is in reach.
    """
    arm = RigArm.of_rig(rig)
    q = np.random.default_rng(SEED).uniform(arm.lower_rad, arm.upper_rad, (POSTURES, arm.n_joints))
    reach_m = float(np.max(np.linalg.norm(arm.tip_m(q), axis=1)))
    for bearing in BEARINGS_DEG if centre_m is None else (0.0,):
        best: CubeInReach | None = None
        for middle_m in _centres(reach_m, np.radians(bearing)) if centre_m is None else (centre_m,):
            heading = np.arctan2(middle_m[1], middle_m[0])
            for one in _turns(float(heading)) if turn is None else (turn,):
                edges = [share * reach_m for share in EDGES] if edge_m is None else [edge_m]
                larger = [edge for edge in edges if best is None or edge > best.edge_m]
                best = _largest(rig, arm, plane, middle_m, one, larger) or best
        if best is not None:
            return best
    raise DataError(
        f"rig {rig.name}: no cube whose poses and corners one posture of the arm reaches, {np.degrees(MARGIN_RAD):g}° "
        "from every limit and clear of table and boxes; give another --centre-m, --edge-m or --turn-deg"
    )


def ways_to(rig: Rig, q_rad: Floats) -> tuple[tuple[int, ...], ...]:
    """Three times (joint,) -1, 0, 1: how joints move at `q_rad` (joint,) when the tool comes along x, y, z of the base
    without turning.
    """
    arm = RigArm.of_rig(rig)
    n = arm.n_joints
    about = np.concatenate([q_rad + STEP_RAD * np.eye(n), q_rad - STEP_RAD * np.eye(n)])
    T, tip_m = arm.frames(about)[:, -1], arm.tip_m(about)
    turn = Rotation.from_matrix(T[:n, :3, :3] @ np.swapaxes(T[n:, :3, :3], 1, 2)).as_rotvec()
    J = np.concatenate([tip_m[:n] - tip_m[n:], turn], axis=1).T / (2.0 * STEP_RAD)
    by_metre = np.linalg.pinv(J)[:, :3].T
    return tuple(tuple(int(np.sign(v)) if abs(v) > STILL else 0 for v in one) for one in by_metre)


def _centres(reach_m: float, bearing_rad: float) -> Iterator[Floats]:
    for out in OUT:
        for up in UP:
            yield reach_m * np.array([out * np.cos(bearing_rad), out * np.sin(bearing_rad), up])


def _turns(heading_rad: float) -> Iterator[Floats]:
    """Tools that point down, inclined outwards, and outwards."""
    for tilt in TILTS_DEG:
        yield Rotation.from_euler("ZY", [heading_rad, np.radians(tilt)]).as_matrix()


def _largest(
    rig: Rig, arm: RigArm, plane: Plane, centre_m: Floats, turn: Floats, edges_m: list[float]
) -> CubeInReach | None:
    """The largest cube of these edges, which grow, before the first one that a posture does not reach."""
    best: CubeInReach | None = None
    middle = _flanges(arm, centre_m[None], turn)[0]
    starts = MotionInverse(arm).solutions(arm, middle, 0.5 * (arm.lower_rad + arm.upper_rad))[:BRANCHES]
    for start in starts:
        for edge_m in edges_m:
            if best is not None and edge_m <= best.edge_m:
                continue
            places_m = np.vstack([cube_poses_m(centre_m, edge_m, plane), cube_corners_m(centre_m, edge_m)])
            goal = _flanges(arm, places_m, turn)
            q_rad, found = MotionInverse(arm).refined(arm, goal, np.tile(start, (len(goal), 1)))
            room = np.minimum(q_rad - arm.lower_rad, arm.upper_rad - q_rad)
            if not (found.all() and room.min() > MARGIN_RAD and clear_for_device(rig, q_rad).all()):
                break
            T = goal[:5].copy()
            T[:, :3, 3] = places_m[:5]
            best = CubeInReach(centre_m, edge_m, plane, T, q_rad[:5])
    return best


def _flanges(arm: RigArm, places_m: Floats, turn: Floats) -> Floats:
    """(place, 4, 4) of the flange whose tool point is at places (place, 3), turned as `turn` (3, 3)."""
    tool = np.eye(4)
    tool[:3, 3] = arm.point_m
    T = np.tile(np.eye(4), (len(places_m), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = turn, places_m
    return T @ inverse(tool)
