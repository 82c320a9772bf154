"""Candidate poses of a rig: within the joint limits, clear of table and keep-out boxes, and with light on both faces.

Before two detectors: random spots, stand-offs and rolls, by every branch of the inverse kinematics. For a device that
measures positions: joint angles drawn evenly. Collisions are those of calibeam's motion (acquisition/motion/cell.py)
and the table of a session (acquisition/centring/aim.py); a cell of boxes knows no collision between the arm's links.

The fixture may also stand at further stations: on rings about the base, at some heights, turned towards the arm.
"""

from collections.abc import Callable

import msgspec
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.centring.aim import BeamTarget, clear_of_table, flange_for
from acquisition.motion.cell import body_points
from acquisition.motion.inverse.solve import all_solutions
from acquisition.recording.rig import Placement, Pose, Rig
from acquisition.session.plan import PlanOptions
from calibeam.motion.gate_of_rig import cell_of, solver_of
from calibrate.design import Candidates
from calibrate.errors import DataError
from calibrate.model.arms.convert import pose_of
from calibrate.model.assumed_rig import AssumedRig, Light
from calibrate.model.rigid import transform

HEIGHTS_M = (-0.05, 0.0, 0.15)  # beside that of the rig's first place
RADII = (0.8, 1.0, 1.25)  # of the distance of the rig's first place from axis 1
BEARINGS_DEG = (-75.0, -35.0, 0.0, 35.0, 75.0)  # about axis 1, from the rig's first place


def with_grid(rig: Rig) -> Rig:
    """The rig with these places beside its own, numbered on; known distances between places are left out."""
    first = rig.placement_list[0].psd1_in_base
    T = transform(first.origin_m, first.rotation_rad)
    number, out = max(rig.placements), list(rig.placement_list)
    for height in HEIGHTS_M:
        for radius in RADII:
            for bearing in BEARINGS_DEG:
                if (height, radius, bearing) == (0.0, 1.0, 0.0):
                    continue
                number += 1
                out.append(Placement(number, _moved(T, height, radius, float(np.radians(bearing)))))
    return msgspec.structs.replace(rig, placement_list=tuple(out), known_distances=())


def _moved(T: np.ndarray, height_m: float, radius: float, bearing_rad: float) -> Pose:
    turn = transform((0.0, 0.0, 0.0), (0.0, 0.0, bearing_rad))
    moved = T.copy()
    moved[:2, 3] *= radius
    moved[2, 3] += height_m
    return pose_of(turn @ moved)


Floats = NDArray[np.float64]
Progress = Callable[[int, int], None]

TRIES = 40  # targets for each pose that is wanted: of a place out of reach none ever lands
# targets of a place of which none has landed: of a place that fills up in time, 1 in 170 comes to it
FUTILE = 5 * TRIES
BRANCHES = 2  # of one target, drawn at random
TURN_RAD = np.pi  # angles of robots that may turn further are drawn within this: a second turn shows nothing new
WAY_STEP_RAD = 0.05  # of the joint with the longest way, between the postures that are looked at
LOWEST_M = 0.05  # of a target that a tracker is to see, above the base plane


def candidates_of(
    rig: Rig, per_block: int, rng: Generator, progress: Progress = lambda done, total: None
) -> Candidates:
    """About `per_block` poses for each place and order. DataError for a rig without [fixture] or [device].

    A hand-held arm has no design: what it is asked for comes from where its joints have been (`Coverage`,
    acquisition/guided/reading.py).
    """
    if rig.fixture is not None and rig.placements:
        return _before_detectors(rig, per_block, rng, progress)
    if rig.device is not None and rig.tool.point_m is not None:
        return _before_device(rig, 6 * per_block, rng)
    if rig.seat_list or rig.bar_position_list:
        raise DataError(
            f"rig {rig.name}: poses are designed for [fixture] and [device], not for cones and bars; a `calibeam "
            "session` of a measuring arm needs no plan: it asks for the posture that the readings so far lack most"
        )
    raise DataError(
        f"rig {rig.name}: a design needs to know what will be measured; add [device] (where the tracker stands) and "
        "tool.point_m, or [fixture] and [[placement]]"
    )


def _before_detectors(rig: Rig, per_block: int, rng: Generator, progress: Progress) -> Candidates:
    assumed, blocks = AssumedRig(rig), [(place, first) for place in rig.placements for first in (1, 2)]
    q, spots, place_of, first_of = list[Floats](), list[Floats](), list[int](), list[int]()
    for done, (place, first) in enumerate(blocks):
        for pose, seen in _landed(rig, assumed, place, first, per_block, rng):
            q.append(pose)
            spots.append(seen)
            place_of.append(place)
            first_of.append(first)
        progress(done + 1, len(blocks))
    if not q:
        raise DataError(f"rig {rig.name}: no pose lights both faces at any place; check placements and the laser")
    return Candidates(np.array(q), np.array(spots), np.array(place_of), np.array(first_of))


def _landed(
    rig: Rig, assumed: AssumedRig, place: int, first: int, wanted: int, rng: Generator
) -> list[tuple[Floats, Floats]]:
    options, solver, half_m = PlanOptions(), solver_of(rig), assumed.fixture.half_size_m
    home, T = np.array(rig.motion.home_rad or np.zeros(rig.n_joints)), assumed.T_base_psd1(place)
    edge_m, out = options.face_share * half_m, list[tuple[Floats, Floats]]()
    for tried in range(TRIES * wanted):
        if len(out) >= wanted or (tried == FUTILE and not out):
            break
        x1, y1, x2, y2 = rng.uniform(-edge_m, edge_m, 4).tolist()
        stand_off, roll = float(rng.uniform(*options.stand_off_m)), float(rng.uniform(-np.pi, np.pi))
        flange = flange_for(assumed.arm, assumed.fixture, T, BeamTarget(first, (x1, y1, x2, y2), stand_off, roll))
        found = all_solutions(solver.arm, flange, home, solver.starts, rng)
        for q_rad in rng.permutation(found)[:BRANCHES]:
            seen = assumed.expect(q_rad, place, first)
            if seen.light is Light.BOTH_LIT and clear_of_table(assumed.arm, q_rad) and _clear(rig, q_rad[None])[0]:
                out.append((q_rad, seen.spots_m))
    return out[:wanted]


def _before_device(rig: Rig, wanted: int, rng: Generator) -> Candidates:
    solver = solver_of(rig)
    lower, upper = np.maximum(solver.arm.lower_rad, -TURN_RAD), np.minimum(solver.arm.upper_rad, TURN_RAD)
    q = rng.uniform(lower, upper, (TRIES * wanted, rig.n_joints))
    frames = solver.arm.frames(q)
    tips = frames[:, -1, :3, :3] @ np.array(rig.tool.point_m) + frames[:, -1, :3, 3]
    good = np.flatnonzero(clear_for_device(rig, q))[:wanted]
    nothing = np.zeros(len(good), dtype=np.int64)
    if len(good) == 0:
        raise DataError(f"rig {rig.name}: no pose is clear of table and keep-out boxes; check [motion]")
    device = transform(rig.device.origin_m, rig.device.rotation_rad) if rig.device is not None else np.eye(4)
    seen = (tips[good] - device[:3, 3]) @ device[:3, :3]
    return Candidates(q[good], seen, nothing, nothing)


def clear_for_device(rig: Rig, q_rad: Floats) -> NDArray[np.bool_]:
    """(pose,) whether arm and target are above the table and keep their clearance of every keep-out box."""
    frames = solver_of(rig).arm.frames(q_rad)
    tips = frames[:, -1, :3, :3] @ np.array(rig.tool.point_m or (0.0, 0.0, 0.0)) + frames[:, -1, :3, 3]
    above = (frames[:, 2:, 2, 3].min(axis=1) > LOWEST_M) & (tips[:, 2] > LOWEST_M)
    return np.asarray(above & _clear(rig, q_rad), dtype=np.bool_)


def way_is_clear(rig: Rig, from_rad: Floats, to_rad: Floats) -> bool:
    """Whether a motion by joints keeps links, flange and target above the table and clear of every keep-out box."""
    way_rad = float(np.max(np.abs(to_rad - from_rad)))
    q = from_rad + np.linspace(0.0, 1.0, int(way_rad / WAY_STEP_RAD) + 2)[:, None] * (to_rad - from_rad)
    return bool(clear_for_device(rig, q).all())


def _clear(rig: Rig, q_rad: Floats) -> NDArray[np.bool_]:
    """(pose,) whether the body keeps its clearance of every keep-out box."""
    cell = cell_of(rig)
    points = (
        body_points(solver_of(rig).arm.frames(q_rad), cell.tool_m, cell.com_m)
        if cell.keep_out
        else np.zeros((len(q_rad), 1, 3))
    )
    out = np.ones(len(q_rad), dtype=np.bool_)
    for box in cell.keep_out:
        out &= np.min(box.distance_m(points), axis=1) >= cell.clearance_m
    return out
