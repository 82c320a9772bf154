"""The part of a rig file that a hand-held measuring arm is emulated from: links, encoders, cones, bars, spheres.

Keys that are not of this world are not looked at. A missing deviation is zero, as a perfect arm would have it.
"""

from collections.abc import Mapping
from typing import Annotated, Any

import msgspec

from simulators.world.errors import WorldError

Vector = tuple[float, float, float]
Sigma = Annotated[float, msgspec.Meta(ge=0.0)]
Positive = Annotated[float, msgspec.Meta(gt=0.0)]
Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Identity = Annotated[int, msgspec.Meta(ge=1)]
ZERO: Vector = (0.0, 0.0, 0.0)
LOCAL_POE = "local-poe"


class Part(msgspec.Struct, frozen=True):
    """The fixed part in front of a joint, or behind the last one: origin and rotation vector."""

    origin_m: Vector = ZERO
    rotation_rad: Vector = ZERO


class Joint(Part, frozen=True, kw_only=True):
    """A fixed part and the range of the joint behind it."""

    lower_rad: float
    upper_rad: float
    sign: int = 1
    follows: Mapping[str, float] | None = None


class Arm(msgspec.Struct, frozen=True):
    """The nominal arm, a local product of exponentials."""

    joint: Annotated[tuple[Joint, ...], msgspec.Meta(min_length=1)]
    model: str
    flange: Part = Part()


class Tool(msgspec.Struct, frozen=True):
    """The probe's ball."""

    point_m: Vector = ZERO
    probe_diameter_m: Sigma = 0.0


class Seat(msgspec.Struct, frozen=True):
    """A cone, about where it stands."""

    id: Identity
    origin_m: Vector


class Bar(msgspec.Struct, frozen=True):
    """A calibrated length."""

    id: Identity
    length_m: Positive


class BarPosition(msgspec.Struct, frozen=True):
    """A bar set up in one way."""

    id: Identity
    bar: Identity
    middle_m: Vector
    direction: Vector


class Sphere(msgspec.Struct, frozen=True):
    """A calibrated sphere, about where it stands."""

    id: Identity
    origin_m: Vector
    diameter_m: Positive


class Emulation(msgspec.Struct, frozen=True):
    """How far the truth lies from the drawing, one sigma each, and what the hand is like."""

    seed: Annotated[int, msgspec.Meta(ge=0)] = 0
    time_scale: Positive = 1.0
    length_sigma_m: Sigma = 0.0
    angle_sigma_rad: Sigma = 0.0
    joint_zero_max_rad: Sigma = 0.0
    artefact_sigma_m: Sigma = 0.0  # of where cones, bars and spheres truly stand
    disc_eccentricity_m: Sigma = 0.0  # of each of both coordinates of a disc's centre
    graduation_rad: Sigma = 0.0  # of the angle that a group of lines shows
    encoder_noise_rad: Sigma = 0.0  # of one reading
    axis_wobble_rad: Sigma = 0.0  # lean of a turning axis
    radial_runout_m: Sigma = 0.0  # of a turning axis sideways
    axial_runout_m: Sigma = 0.0  # of a turning axis along itself
    contact_m: Sigma = 0.0  # of the ball in its seat, each time it is put there
    tremor_rad: Sigma = 0.0  # of the hand, as the joints show it
    slip_share: Share = 0.0  # of the times that the ball sits askew or slips while it is read
    hand_force_n: Sigma = 0.0  # along the probe
    joint_compliance_rad_nm: Sigma = 0.0


class HandRig(msgspec.Struct, frozen=True):
    """Everything that this world wants to know, as believed; the deviations come on top."""

    arm: Arm
    tool: Tool = Tool()
    seat: tuple[Seat, ...] = ()
    bar: tuple[Bar, ...] = ()
    bar_position: tuple[BarPosition, ...] = ()
    sphere: tuple[Sphere, ...] = ()
    emulation: Emulation = Emulation()


def is_hand_held(rig: Mapping[str, Any]) -> bool:
    """Whether a rig as `tomllib` gives it is one that a person's hand moves: artefacts to probe, encoders, no robot."""
    devices = rig.get("devices", {})
    probed = any(rig.get(section) for section in ("seat", "bar_position", "sphere"))
    return probed and "encoders" in devices and not {"robot", "psd"} & set(devices)


def read_hand_rig(rig: Mapping[str, Any]) -> HandRig:
    """What this world wants of a rig as `tomllib` gives it. WorldError naming the key, or what cannot be emulated."""
    try:
        checked = msgspec.convert(dict(rig), type=HandRig)
    except msgspec.ValidationError as error:
        raise WorldError(f"rig file: {error}; an emulated measuring arm needs [arm] with joints in its form") from error
    if any(joint.sign != 1 or joint.follows for joint in checked.arm.joint):
        raise WorldError("rig file: an emulated arm has no sign and no follows; emulate a rig without them")
    if checked.arm.model != LOCAL_POE:
        raise WorldError(
            f'rig file: arm.model = "{checked.arm.model}": a hand-held arm is emulated as "{LOCAL_POE}" only'
        )
    lengths = {bar.id for bar in checked.bar}
    for position in checked.bar_position:
        if position.bar not in lengths:
            raise WorldError(f"rig file: bar position {position.id} holds bar {position.bar}, which is no [[bar]]")
    return checked
