"""What hangs on the arm: stated masses and the payload, how far they may be off, and unknown ones.

A moment of weight is linear in each body's mass and first moment (Atkeson, An, Hollerbach, Estimation of Inertial
Parameters of Manipulator Loads and Links, Int. J. Robotics Research 5(3), 1986, section 2), so uncertainty of a stated
mass is one more load.
"""

from dataclasses import dataclass

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from acquisition.recording.rig import ArmModel, Rig
from calibrate.model.effects.drivers import Drivers
from calibrate.model.rigid import inverse, transform

Floats = NDArray[np.float64]
Point = tuple[float, float, float]

FIRST_MOMENT_M = 0.1  # a link's centre of mass is about this far from its frame: scales columns only
# One sigma of stated masses and centres: a judgement, no measurement. Data sheets and drawings leave cables, grease and
# motors to the reader, so a stated mass is known to about a seventh.
MASS_SHARE = 0.15
CENTRE_SHARE = 0.05  # of the longest link: 20 mm on a small arm
UNSTATED_CENTRE_M = 0.1  # one sigma along each axis, of a load at the flange whose centre is not stated: a gripper long
TOOL_SHARE = 0.05  # of all stated mass, where the tool's own is not stated


@dataclass(frozen=True, eq=False)
class Load:
    """A body fixed to a frame; each value one number, or one a pose."""

    frame: int
    mass_kg: Floats  # () or (pose,)
    moment_kg_m: Floats  # (3,) or (pose, 3) first moment about the origin of B_frame, in its axes


def load_at(frame: int, mass_kg: float, com_m: Point) -> Load:
    """A point mass."""
    return Load(frame, np.array(mass_kg), mass_kg * np.array(com_m))


def stated_masses(drivers: Drivers) -> list[tuple[float, int, Point]]:
    """Mass (kg), frame B_i and centre in it of every link and the tool that the rig states."""
    rig, at = drivers.rig, (0.0, 0.0, 0.0)
    links = [(link.mass_kg, i, link.com_m or at) for i, link in enumerate(rig.arm.joints, start=1) if link.mass_kg]
    stated = [(mass, i, _in_frame(drivers, i, com)) for mass, i, com in links]
    if rig.tool.mass_kg:
        stated.append((rig.tool.mass_kg, len(rig.arm.joints), rig.tool.com_m or at))
    return stated


def states_masses(rig: Rig) -> bool:
    """Whether the rig gives the mass of any link; the tool alone shows little of what a joint carries."""
    return any(link.mass_kg for link in rig.arm.joints)


def _in_frame(drivers: Drivers, link: int, com_m: Point) -> Point:
    """In B_link, of a centre in the link frame of the rig's notation.

    Denavit and Hartenberg's is B_link itself, but for the flange; all others' turn with the joint, at the link's start.
    """
    arm = drivers.rig.arm
    if arm.model is not ArmModel.DH:
        angle = drivers.q_rad[0, link - 1] + (arm.joints[link - 1].theta_offset_rad or 0.0)
        turned = drivers.frames[0, link - 1] @ transform((0.0, 0.0, 0.0), (0.0, 0.0, angle))
        to_frame = inverse(drivers.frames[0, link]) @ turned
    elif link == drivers.n_joints:
        to_frame = inverse(transform(arm.flange.origin_m, arm.flange.rotation_rad))
    else:
        return com_m
    x, y, z = (to_frame[:3, :3] @ np.array(com_m) + to_frame[:3, 3]).tolist()
    return x, y, z


def carried(drivers: Drivers) -> list[Load]:
    """All that the rig states, and the payload."""
    loads = [load_at(i, mass, com) for mass, i, com in stated_masses(drivers)]
    return loads if drivers.payload_kg is None else [*loads, payload(drivers, drivers.payload_kg)]


def payload(drivers: Drivers, payload_kg: Floats) -> Load:
    """At its stated centre, else at the flange."""
    com = drivers.payload_com_m
    moment = np.zeros((len(payload_kg), 3)) if com is None else payload_kg[:, None] * com
    return Load(drivers.n_joints, payload_kg, moment)


def mass_tolerance(drivers: Drivers) -> tuple[float, float]:
    """One sigma of a stated mass, as a share of it, and of a stated centre (m): as [tolerance] has them, else usual."""
    stated = drivers.rig.tolerance
    share = None if stated is None else stated.mass_share
    off_m = None if stated is None else stated.com_m
    usual_m = CENTRE_SHARE * longest_link_m(drivers)
    return MASS_SHARE if share is None else share, usual_m if off_m is None else off_m


def uncertain_loads(drivers: Drivers) -> list[Load]:
    """What one sigma of every stated mass and centre adds; of a tool that is not stated, at the flange."""
    stated = stated_masses(drivers)
    share, off_m = mass_tolerance(drivers)
    out: list[Load] = []
    for mass, i, com in stated:
        out.append(load_at(i, share * mass, com))
        out += [Load(i, np.array(0.0), mass * off_m * axis) for axis in np.eye(3)]
    if stated and drivers.rig.tool.mass_kg is None:
        out.append(load_at(drivers.n_joints, TOOL_SHARE * sum(mass for mass, _, _ in stated), (0.0, 0.0, 0.0)))
    return out


def possible_rigs(drivers: Drivers) -> tuple[Rig, ...]:
    """The rig with each stated mass and centre in turn off by one sigma, as `uncertain_loads` has it."""
    rig, (share, off_m) = drivers.rig, mass_tolerance(drivers)
    stated = stated_masses(drivers)
    out: list[Rig] = []
    for i, link in enumerate(rig.arm.joints):
        if link.mass_kg:
            for mass, com in _off(link.mass_kg, link.com_m, share, off_m):
                joints = (*rig.arm.joints[:i], structs.replace(link, mass_kg=mass, com_m=com), *rig.arm.joints[i + 1 :])
                out.append(structs.replace(rig, arm=structs.replace(rig.arm, joints=joints)))
    if rig.tool.mass_kg:
        moved = _off(rig.tool.mass_kg, rig.tool.com_m, share, off_m)
        out += [structs.replace(rig, tool=structs.replace(rig.tool, mass_kg=mass, com_m=com)) for mass, com in moved]
    elif stated and rig.tool.mass_kg is None:
        tool_kg = TOOL_SHARE * sum(mass for mass, _, _ in stated)
        out.append(structs.replace(rig, tool=structs.replace(rig.tool, mass_kg=tool_kg)))
    return tuple(out)


def _off(mass_kg: float, com_m: Point | None, share: float, off_m: float) -> list[tuple[float, Point]]:
    """Mass and centre with one of them off."""
    x, y, z = com_m or (0.0, 0.0, 0.0)
    centres = ((x + off_m, y, z), (x, y + off_m, z), (x, y, z + off_m))
    return [((1.0 + share) * mass_kg, (x, y, z)), *((mass_kg, centre) for centre in centres)]


def unit_loads(drivers: Drivers, first: int) -> list[Load]:
    """One kilogram at every frame from `first` on, and the first moments of one whose centre is off it."""
    out: list[Load] = []
    for i in range(first, drivers.n_joints + 1):
        out.append(load_at(i, 1.0, (0.0, 0.0, 0.0)))
        out += [Load(i, np.array(0.0), FIRST_MOMENT_M * axis) for axis in np.eye(3)]
    return out


def longest_link_m(drivers: Drivers) -> float:
    """Between the origins of neighbouring frames."""
    return float(np.linalg.norm(np.diff(drivers.frames[0, :, :3, 3], axis=0), axis=1).max())
