"""The arm as a MuJoCo model, written from the true geometry.

Each axis is a body `axis<i>` with a hinge `joint<i>`; inside it stands the body `link<i>`, which is the
Denavit-Hartenberg frame after the link and carries its mass. A soft joint or a soft pedestal is one more joint in a
`link<i>` or `axis1` body: only hinges named `joint<i>` are driven, gravity loads all of them.

What it does not imitate: contact (the arm passes through the fixture) and the flexibility of links.
"""

import math
from xml.etree import ElementTree

import msgspec

from simulators.wire import TICK_S
from simulators.world.rig import ArmOfRig, Joint, Pose, Tool, Vector, WorldRig
from simulators.world.truth import TrueLink, Truth, arm_of

STEP_S = 0.001  # physics step; an e-Series joint controller closes its position loop at about this rate
STEPS_PER_COMMAND = round(TICK_S / STEP_S)  # of the controller's cycle
NO_MASS_KG = 1e-4  # stands for a mass that the rig does not give: nothing beside the armature, but MuJoCo wants some
CASTING_KG_M3 = 1350.0  # aluminium (2700) about half hollow: the size of a link follows from its mass
TORQUE_FLOOR_NM = 28.0  # UR5e wrist joints; Universal Robots, "Max. joint torques", article 17260
TORQUE_MARGIN = 3.0  # drive against worst static load: UR5e shoulder 150 N m against about 50 N m


def build_mjcf(rig: WorldRig, truth: Truth) -> str:
    """MJCF text of the true arm. Sites: `flange`, and `laser` at the beam's origin with z along the beam."""
    root = ElementTree.Element("mujoco", model="arm")
    ElementTree.SubElement(root, "compiler", angle="radian", eulerseq="xyz", autolimits="true")
    option = ElementTree.SubElement(
        root,
        "option",
        timestep=repr(STEP_S),
        gravity=_numbers(*rig.arm.gravity_m_s2),
        integrator="implicitfast",
    )
    ElementTree.SubElement(option, "flag", contact="disable", constraint="disable")
    parent = ElementTree.SubElement(root, "worldbody")
    if truth.parts:
        _add_parts(parent, rig, truth)
        return ElementTree.tostring(root, encoding="unicode")
    for number, (joint, link) in enumerate(zip(rig.arm.joint, truth.links, strict=True), start=1):
        parent = _add_link(parent, number, joint, link)
    _add_flange(parent, rig.tool, truth)
    return ElementTree.tostring(root, encoding="unicode")


def _add_parts(parent: ElementTree.Element, rig: WorldRig, truth: Truth) -> None:
    """An arm that is given by its fixed parts; each mass turns with its joint, where the drawing has it."""
    com_m = arm_of(rig, truth).com_m
    for number, (joint, part) in enumerate(zip(rig.arm.joint, truth.parts[:-1], strict=True), start=1):
        parent = _add_frame(parent, f"axis{number}", part)
        ElementTree.SubElement(
            parent, "joint", name=f"joint{number}", type="hinge", axis="0 0 1", armature=repr(joint.rotor_inertia_kg_m2)
        )
        x, y, z = com_m[number - 1].tolist()
        _add_inertia(parent, joint.mass_kg, (x, y, z), reach_m=math.hypot(joint.a_m, joint.d_m))
    _add_flange(parent, rig.tool, msgspec.structs.replace(truth, flange=truth.parts[-1]))


def _add_link(parent: ElementTree.Element, number: int, joint: Joint, link: TrueLink) -> ElementTree.Element:
    """Rz(theta_offset + q), then Tz(d) Tx(a) Rx(alpha) Ry(beta): "xyz" Euler angles turn about axes carried along."""
    axis = ElementTree.SubElement(parent, "body", name=f"axis{number}", euler=_numbers(0.0, 0.0, link.theta_offset_rad))
    ElementTree.SubElement(
        axis, "joint", name=f"joint{number}", type="hinge", axis="0 0 1", armature=repr(joint.rotor_inertia_kg_m2)
    )
    frame = ElementTree.SubElement(
        axis,
        "body",
        name=f"link{number}",
        pos=_numbers(link.a_m, 0.0, link.d_m),
        euler=_numbers(link.alpha_rad, link.beta_rad, 0.0),
    )
    _add_inertia(frame, joint.mass_kg, joint.com_m, reach_m=math.hypot(joint.a_m, joint.d_m))
    return frame


def _add_flange(parent: ElementTree.Element, tool: Tool, truth: Truth) -> None:
    flange = _add_frame(parent, "flange", truth.flange)
    _add_inertia(flange, tool.mass_kg, tool.com_m, reach_m=0.0)
    ElementTree.SubElement(flange, "site", name="flange")
    ElementTree.SubElement(
        flange, "site", name="laser", pos=_numbers(*truth.laser_origin_m), zaxis=_numbers(*truth.laser_direction)
    )


def _add_frame(parent: ElementTree.Element, name: str, pose: Pose) -> ElementTree.Element:
    frame = ElementTree.SubElement(parent, "body", name=name, pos=_numbers(*pose.origin_m))
    angle_rad = math.sqrt(sum(component * component for component in pose.rotation_rad))
    if angle_rad > 0.0:
        # of length 1: MuJoCo refuses an axis as short as what rounding leaves of a rotation
        frame.set("axisangle", _numbers(*(component / angle_rad for component in pose.rotation_rad), angle_rad))
    return frame


def _add_inertia(frame: ElementTree.Element, mass_kg: float, com_m: Vector, reach_m: float) -> None:
    """No data sheet gives the tensor; only the motion between two stands depends on it, and the servo knows it."""
    mass = max(mass_kg, NO_MASS_KG)
    inertia = inertia_kg_m2(mass, reach_m)
    ElementTree.SubElement(
        frame, "inertial", pos=_numbers(*com_m), mass=repr(mass), diaginertia=_numbers(inertia, inertia, inertia)
    )


def inertia_kg_m2(mass_kg: float, reach_m: float) -> float:
    """About any axis through the centre of mass: a solid ball plus a slender rod as long as the link reaches.

    2/5 m r^2 and m l^2/12 (any mechanics textbook).
    """
    radius_m = (3.0 * mass_kg / (4.0 * math.pi * CASTING_KG_M3)) ** (1.0 / 3.0)
    return 0.4 * mass_kg * radius_m**2 + mass_kg * reach_m**2 / 12.0


def torque_limits_nm(arm: ArmOfRig, tool: Tool) -> tuple[float, ...]:
    """What each drive can give, (n,): above an upper bound of its static load, all that follows stretched out level."""
    g_m_s2 = math.sqrt(sum(component * component for component in arm.gravity_m_s2))
    distal_kg = tool.mass_kg
    load_nm = tool.mass_kg * g_m_s2 * math.dist(tool.com_m, (0.0, 0.0, 0.0))
    limits: list[float] = []
    for joint in reversed(arm.joint):
        reach_m = math.hypot(joint.a_m, joint.d_m)
        load_nm += g_m_s2 * (distal_kg * reach_m + joint.mass_kg * (reach_m + math.dist(joint.com_m, (0.0, 0.0, 0.0))))
        distal_kg += joint.mass_kg
        limits.append(max(TORQUE_FLOOR_NM, TORQUE_MARGIN * load_nm))
    return tuple(reversed(limits))


def _numbers(*values: float) -> str:
    return " ".join(repr(float(value)) for value in values)
