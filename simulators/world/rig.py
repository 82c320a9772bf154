"""The part of a rig file that the emulated world is built from, checked and frozen.

Keys that are not of the world (devices, motion, tolerance) are not looked at: misspelt ones are refused where the rig
file itself is read. A missing deviation is zero, as a perfect arm would have it.
"""

from collections.abc import Mapping
from typing import Annotated, Any

import msgspec

from simulators.errors import WorldError

Vector = tuple[float, float, float]
Sigma = Annotated[float, msgspec.Meta(ge=0.0)]
Positive = Annotated[float, msgspec.Meta(gt=0.0)]
ZERO: Vector = (0.0, 0.0, 0.0)
ARMATURE_KG_M2 = 0.1  # rotor behind the gear; MuJoCo Menagerie, universal_robots_ur5e/ur5e.xml


class Pose(msgspec.Struct, frozen=True):
    """A frame in another: origin and rotation vector."""

    origin_m: Vector = ZERO
    rotation_rad: Vector = ZERO


class Joint(msgspec.Struct, frozen=True):
    """One axis and the link after it, standard Denavit-Hartenberg."""

    a_m: float
    alpha_rad: float
    d_m: float
    theta_offset_rad: float = 0.0
    encoder_counts: Annotated[int, msgspec.Meta(ge=1)] | None = None
    mass_kg: Sigma = 0.0
    com_m: Vector = ZERO
    sign: int = 1
    follows: Mapping[str, float] | None = None
    rotor_inertia_kg_m2: Positive = ARMATURE_KG_M2


class ArmOfRig(msgspec.Struct, frozen=True):
    """The nominal arm."""

    joint: Annotated[tuple[Joint, ...], msgspec.Meta(min_length=1)]
    model: str = "dh"
    gravity_m_s2: Vector = (0.0, 0.0, -9.81)
    flange: Pose = Pose()
    base: Pose = Pose()


class Tool(msgspec.Struct, frozen=True):
    """What hangs at the flange: the laser and its holder, or a tracker's target."""

    laser_origin_m: Vector = ZERO
    laser_direction: Vector = (0.0, 0.0, 1.0)
    mass_kg: Sigma = 0.0
    com_m: Vector = ZERO
    point_m: Vector = ZERO  # the target


class Fixture(msgspec.Struct, frozen=True):
    """Two square faces that see each other."""

    half_size_m: Positive
    psd2_in_psd1: Pose


class Placement(msgspec.Struct, frozen=True):
    """One place where the fixture can stand; id 0 means no fixture."""

    id: Annotated[int, msgspec.Meta(ge=1)]
    psd1_in_base: Pose


class Emulation(msgspec.Struct, frozen=True):
    """How far the truth lies from the drawing: one sigma, or the limit where the name has max."""

    seed: Annotated[int, msgspec.Meta(ge=0)] = 0
    time_scale: Positive = 1.0
    length_sigma_m: Sigma = 0.0
    angle_sigma_rad: Sigma = 0.0
    joint_zero_max_rad: Sigma = 0.0
    placement_origin_sigma_m: Sigma = 0.0
    placement_rotation_sigma_rad: Sigma = 0.0
    laser_origin_sigma_m: Sigma = 0.0
    laser_direction_sigma_rad: Sigma = 0.0
    joint_repeatability_rad: Sigma = 0.0
    psd_noise_m: Sigma = 0.0
    controller_link2_length_m: Sigma = 0.0  # by which the controller computes with a longer link 2 than the rig file
    laser_power_w: Sigma = 1e-3  # class 2 pointer (IEC 60825-1: at most 1 mW)
    position_noise_m: Sigma = 0.0  # of a tracker, on each axis
    target_sigma_m: Sigma = 0.0  # of its target at the flange
    device_origin_sigma_m: Sigma = 0.0  # of where it stands
    device_rotation_sigma_rad: Sigma = 0.0


NEEDED = (
    'emulation needs [arm] model = "dh", [tool], and, unless it has [devices.tracker], or [devices.robot] and '
    "tool.point_m alone, [fixture], [[placement]]"
)


class WorldRig(msgspec.Struct, frozen=True):
    """Everything the world wants to know, as assumed; the deviations come on top."""

    arm: ArmOfRig
    tool: Tool
    fixture: Fixture | None = None
    placement: tuple[Placement, ...] = ()
    emulation: Emulation = Emulation()
    device: Pose = Pose((2.0, 0.0, 0.5), (0.0, 0.0, 3.0))  # of a rig that does not state where its tracker stands


def read_rig(rig: Mapping[str, Any]) -> WorldRig:
    """The world's view of a rig as `tomllib` gives it. WorldError naming the key, or what cannot be emulated."""
    try:
        checked = msgspec.convert(dict(rig), type=WorldRig)
    except msgspec.ValidationError as error:
        raise WorldError(f"rig file: {error}; {NEEDED}") from error
    _refuse_what_is_missing(checked, rig)
    _refuse_what_cannot_be_built(checked)
    return checked


def _refuse_what_is_missing(rig: WorldRig, plain: Mapping[str, Any]) -> None:
    """A light needs a laser, a fixture and its places; a rig with a tracker, or a robot with a ball alone, has none."""
    devices, tool = plain.get("devices", {}), plain.get("tool", {})
    alone = "robot" in devices and "psd" not in devices and "point_m" in tool
    if rig.fixture is None and ("tracker" in devices or alone):
        return
    named = {"[fixture]": rig.fixture is not None, "[[placement]]": bool(rig.placement)}
    named |= {f"tool.{key}": key in tool for key in ("laser_origin_m", "laser_direction")}
    missing = next((name for name, there in named.items() if not there), None)
    if missing is not None:
        raise WorldError(f"rig file: {missing} is missing; {NEEDED}")


def _refuse_what_cannot_be_built(rig: WorldRig) -> None:
    if rig.arm.model != "dh":
        raise WorldError(f'rig file: arm.model = "{rig.arm.model}" cannot be emulated; write the arm as "dh"')
    if any(joint.sign != 1 or joint.follows for joint in rig.arm.joint) or rig.arm.base != Pose():
        raise WorldError(
            "rig file: the emulated controller counts every joint as the table draws it; emulate a rig without sign, "
            "follows and [arm.base]"
        )
    if not any(rig.tool.laser_direction):
        raise WorldError(
            "rig file: tool.laser_direction = [0, 0, 0] points nowhere; give a direction in the flange frame"
        )
    ids = [placement.id for placement in rig.placement]
    for placement_id in ids:
        if ids.count(placement_id) > 1:
            raise WorldError(f"rig file: placement id {placement_id} stands twice; give every [[placement]] its own id")
