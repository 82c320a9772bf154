"""The whole chain with its hidden mechanisms, in order of the signal: shaft, joint, links, tool, instrument.

Each defect takes hold where it has a method for (see `defects.defect`). Weight and deflection depend on each other: the
arm's pose is iterated until it carries its own weight.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Arm, Frames, forward
from simulators.arm.statics import Load, weigh
from simulators.conceal.rig import TrueRig
from simulators.defects import Scene
from simulators.defects.defect import Defect, MovesBase, MovesLink, MovesTool, ReadsAngle, TurnsJoint

Floats = NDArray[np.float64]
READING_STEPS = 12  # an error of slope 1e-2 shrinks to 1e-24
BALANCE_STEPS = 6  # deflections of 1e-2 at most: what is left is below 1e-12
SETTLED = 1e-10  # m, rad: what the last step of the balance may still change


@dataclass(frozen=True, eq=False)
class Stance:
    """How the arm truly stands, row by row."""

    joint_rad: Floats  # (row, n)
    frames: Frames
    load: Load | None  # None when nothing is there that could give way
    T_base_tool: Floats  # (row, 4, 4) the flange with the tool's own motion
    settled: bool  # the balance was found


def stand(rig: TrueRig, scene: Scene, defects: Sequence[Defect], reading_rad: Floats) -> Stance:
    """The arm whose encoders say `reading_rad` (row, n)."""
    shaft_rad = true_shaft_rad(defects, scene, reading_rad)
    return balanced(rig.arm, scene, defects, shaft_rad)


def true_shaft_rad(defects: Sequence[Defect], scene: Scene, reading_rad: Floats) -> Floats:
    """Shaft angles at which the encoders say `reading_rad`: reading = shaft + error(shaft), solved for the shaft."""
    readers = [defect for defect in defects if isinstance(defect, ReadsAngle)]
    shaft_rad = reading_rad
    for _ in range(READING_STEPS if readers else 0):
        shaft_rad = reading_rad - sum(reader.reading_error_rad(shaft_rad, scene) for reader in readers)
    return shaft_rad


def said_rad(defects: Sequence[Defect], scene: Scene, shaft_rad: Floats) -> Floats:
    """What the encoders say of shafts at `shaft_rad`."""
    readers = [defect for defect in defects if isinstance(defect, ReadsAngle)]
    return shaft_rad + sum((reader.reading_error_rad(shaft_rad, scene) for reader in readers), np.zeros_like(shaft_rad))


def balanced(arm: Arm, scene: Scene, defects: Sequence[Defect], shaft_rad: Floats) -> Stance:
    """The pose in which the deflections belong to the load that they cause."""
    turners = [defect for defect in defects if isinstance(defect, TurnsJoint)]
    movers = [defect for defect in defects if isinstance(defect, (MovesLink, MovesBase))]
    foot = np.broadcast_to(np.eye(4), (len(scene), 4, 4))
    joint_rad = shaft_rad + arm.zero_rad
    frames = forward(arm, joint_rad)
    if not defects:
        return Stance(joint_rad, frames, None, frames.flange, True)
    load = weigh(arm, frames, foot, scene.payload_kg, scene.payload_com_m)
    left = 0.0
    for _ in range(BALANCE_STEPS if turners or movers else 0):
        extra_rad = sum((turner.extra_turn_rad(shaft_rad, scene, load) for turner in turners), np.zeros_like(shaft_rad))
        joint_rad = shaft_rad + arm.zero_rad + extra_rad
        foot = _foot(defects, scene, load)
        moved = forward(arm, joint_rad, foot=foot, links=_links(arm, defects, joint_rad, scene, load))
        left = float(np.abs(moved.flange - frames.flange).max())
        frames = moved
        load = weigh(arm, frames, foot, scene.payload_kg, scene.payload_com_m)
    return Stance(joint_rad, frames, load, _tool(frames.flange, defects, scene, load), left < SETTLED)


def _foot(defects: Sequence[Defect], scene: Scene, load: Load) -> Floats:
    foot = np.broadcast_to(np.eye(4), (len(scene), 4, 4))
    for defect in defects:
        if isinstance(defect, MovesBase):
            foot = defect.base_motion(scene, load) @ foot
    return foot


def _links(arm: Arm, defects: Sequence[Defect], joint_rad: Floats, scene: Scene, load: Load) -> dict[int, Floats]:
    motions: dict[int, Floats] = {}
    for defect in defects:
        if isinstance(defect, MovesLink):
            for link in defect.links:
                motion = defect.link_motion(link, arm.fixed[link, :3, 3], joint_rad, scene, load)
                motions[link] = motion @ motions[link] if link in motions else motion
    return motions


def _tool(flange: Floats, defects: Sequence[Defect], scene: Scene, load: Load) -> Floats:
    for defect in defects:
        if isinstance(defect, MovesTool):
            flange = flange @ defect.tool_motion(scene, load)
    return flange
