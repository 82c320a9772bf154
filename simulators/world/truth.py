"""What the emulated rig truly is: drawn once from the seed, frozen, and written only outside of any recording.

Every sigma of the rig file scales a normal number that is drawn whether or not the sigma is zero, and each kind of
deviation has a random stream of its own: switching one off leaves the others as they were.

The true arm of a world in numbers: fixed parts between its axes, zeros, and masses where its links truly are.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simulators.arm.kinematics import Arm, moved, shifted, turned
from simulators.errors import WorldError
from simulators.world.rig import Emulation, Joint, Placement, Pose, Tool, Vector, WorldRig, read_rig

Floats = NDArray[np.float64]
SCHEMA = 1
PARALLEL_COSINE = 0.9  # of the twist between two axes: within 25 deg the common normal is badly defined


class TrueLink(msgspec.Struct, frozen=True):
    """T = Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta); theta = true joint angle + theta_offset.

    beta is Hayati's fifth parameter: without it a link between parallel axes could not be off in every direction
    (Hayati, "Robot arm geometric link parameter estimation", CDC 1983). Between crossing axes it is zero: there the
    second tilt is a turn about the joint's own axis, which is what the joint zero already is.
    """

    a_m: float
    alpha_rad: float
    d_m: float
    theta_offset_rad: float
    beta_rad: float


class TruePlacement(msgspec.Struct, frozen=True):
    """Where the fixture stands when it has been put at place `id`."""

    id: int
    psd1_in_base: Pose


class Truth(msgspec.Struct, frozen=True):
    """The concealed rig. True joint angle = controller reading + joint_zero + what repeatability adds."""

    seed: int
    links: tuple[TrueLink, ...]
    flange: Pose
    joint_zero_rad: tuple[float, ...]
    link_encoder_offset_rad: tuple[float, ...]
    laser_origin_m: Vector
    laser_direction: Vector
    placements: tuple[TruePlacement, ...]
    schema: int = SCHEMA
    parts: tuple[Pose, ...] = ()  # of an arm that is given: n + 1 fixed parts between turns about z, in place of links
    psd2_in_psd1: Pose | None = None  # of a fixture that is given
    target_m: Vector = (0.0, 0.0, 0.0)  # a tracker's target in the flange frame
    device: Pose = Pose()  # the tracker in the base frame


class Given(msgspec.Struct, frozen=True):
    """A rig that is given in numbers, instead of drawn: what a calibration found. What it does not hold is drawn.

    T_base_flange(q) = F0 Rz(q1 + zero1) F1 ... Rz(qn + zeron) Fn with the `parts` F.
    """

    parts: tuple[Pose, ...]
    joint_zero_rad: tuple[float, ...]
    laser_origin_m: Vector | None = None
    laser_direction: Vector | None = None
    placements: tuple[TruePlacement, ...] = ()
    psd2_in_psd1: Pose | None = None
    target_m: Vector | None = None
    device: Pose | None = None
    rest_degC: dict[str, float] = {}  # by place: the temperature at which it is so


def given_truth(rig: WorldRig, seed: int, given: Given) -> Truth:
    """The truth of a given rig; the seed draws only what no calibration finds. WorldError for another arm or places."""
    drawn = draw_truth(rig, seed)
    if len(given.parts) != len(drawn.links) + 1:
        raise WorldError(f"an arm of {len(given.parts) - 1} joints is given; the rig file has {len(drawn.links)}")
    missing = {place.id for place in drawn.placements} - {place.id for place in given.placements}
    if missing:
        raise WorldError(f"place {min(missing)} of the rig file is not among the given ones; give all of them")
    instruments = {
        "laser_origin_m": given.laser_origin_m,
        "laser_direction": given.laser_direction,
        "psd2_in_psd1": given.psd2_in_psd1,
        "target_m": given.target_m,
        "device": given.device,
    }
    return msgspec.structs.replace(
        drawn,
        joint_zero_rad=given.joint_zero_rad,
        placements=given.placements,
        parts=given.parts,
        **{name: value for name, value in instruments.items() if value is not None},
    )


def draw_truth(rig: WorldRig, seed: int) -> Truth:
    """The truth that belongs to a rig and a seed; the same two always give the same. WorldError for a seed below 0."""
    if seed < 0:
        raise WorldError(f"seed {seed}; give a whole number from 0 on")
    streams = (np.random.default_rng(s) for s in np.random.SeedSequence([seed, 1]).spawn(6))
    link, zero, place, laser, encoder, tracker = streams
    sigma = rig.emulation
    n = len(rig.arm.joint)
    origin_m, direction = _draw_laser(rig.tool, sigma, laser)
    return Truth(
        seed=seed,
        links=tuple(_draw_link(joint, sigma, link) for joint in rig.arm.joint),
        flange=rig.arm.flange,
        joint_zero_rad=tuple((sigma.joint_zero_max_rad * zero.uniform(-1.0, 1.0, n)).tolist()),
        link_encoder_offset_rad=tuple(encoder.uniform(-np.pi, np.pi, n).tolist()),
        laser_origin_m=origin_m,
        laser_direction=direction,
        placements=tuple(_draw_placement(placement, sigma, place) for placement in rig.placement),
        target_m=_vector(np.asarray(rig.tool.point_m) + sigma.target_sigma_m * tracker.standard_normal(3)),
        device=_displaced(rig.device, sigma.device_origin_sigma_m, sigma.device_rotation_sigma_rad, tracker),
    )


def _draw_link(joint: Joint, sigma: Emulation, rng: np.random.Generator) -> TrueLink:
    a, d, alpha, beta = rng.standard_normal(4)
    parallel = abs(np.cos(joint.alpha_rad)) > PARALLEL_COSINE
    return TrueLink(
        a_m=float(joint.a_m + sigma.length_sigma_m * a),
        alpha_rad=float(joint.alpha_rad + sigma.angle_sigma_rad * alpha),
        d_m=float(joint.d_m + sigma.length_sigma_m * d),
        theta_offset_rad=joint.theta_offset_rad,
        beta_rad=float(sigma.angle_sigma_rad * beta) if parallel else 0.0,
    )


def _draw_placement(placement: Placement, sigma: Emulation, rng: np.random.Generator) -> TruePlacement:
    shift_m, turn_rad = sigma.placement_origin_sigma_m, sigma.placement_rotation_sigma_rad
    return TruePlacement(placement.id, _displaced(placement.psd1_in_base, shift_m, turn_rad, rng))


def _displaced(nominal: Pose, origin_sigma_m: float, rotation_sigma_rad: float, rng: np.random.Generator) -> Pose:
    """The nominal pose with a small pose composed on its right: what stands there is off in its own frame."""
    shift_m = origin_sigma_m * rng.standard_normal(3)
    turn_rad = rotation_sigma_rad * rng.standard_normal(3)
    turned = Rotation.from_rotvec(nominal.rotation_rad)
    return Pose(
        origin_m=_vector(np.asarray(nominal.origin_m) + turned.apply(shift_m)),
        rotation_rad=_vector((turned * Rotation.from_rotvec(turn_rad)).as_rotvec()),
    )


def _draw_laser(tool: Tool, sigma: Emulation, rng: np.random.Generator) -> tuple[Vector, Vector]:
    """Origin shifted along each axis; direction tilted about the two axes across it."""
    shift_m = sigma.laser_origin_sigma_m * rng.standard_normal(3)
    tilt_rad = sigma.laser_direction_sigma_rad * rng.standard_normal(2)
    along = np.asarray(tool.laser_direction, dtype=np.float64)
    along = along / np.linalg.norm(along)
    across = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    across = across / np.linalg.norm(across)
    tilt = Rotation.from_rotvec(tilt_rad[0] * across + tilt_rad[1] * np.cross(along, across))
    return _vector(np.asarray(tool.laser_origin_m) + shift_m), _vector(tilt.apply(along))


def _vector(values: NDArray[np.float64]) -> Vector:
    x, y, z = values.tolist()
    return (x, y, z)


def write_truth(truth: Truth, path: Path) -> None:
    """Writes the truth as JSON, SI names with their units; folders are made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(msgspec.json.format(msgspec.json.encode(truth), indent=1) + b"\n")


def read_truth(path: Path) -> Truth:
    """The truth that `write_truth` left. WorldError when the file is not one."""
    try:
        truth = msgspec.json.decode(path.read_bytes(), type=Truth)
    except msgspec.DecodeError as error:
        raise WorldError(
            f"{path}: not a truth file: {error}; write one by emulating with a truth file asked for"
        ) from error
    if truth.schema != SCHEMA:
        raise WorldError(f"{path}: truth of schema {truth.schema}, this version reads {SCHEMA}; emulate the seed again")
    return truth


def truth_of(rig: Mapping[str, Any], seed: int) -> Truth:
    """The truth of a rig as `tomllib` gives it, without starting a world."""
    return draw_truth(read_rig(rig), seed)


NO_LIMIT_RAD = 2.0 * np.pi


def arm_of(rig: WorldRig, truth: Truth) -> Arm:
    """T_base_flange(q) = F0 Rz(q1) F1 Rz(q2) ... Fn, of the links that were drawn. Limits: a full turn both ways."""
    n = len(truth.links)
    ends = [_end(link) for link in truth.links]
    offsets = [turned((0.0, 0.0, link.theta_offset_rad)) for link in truth.links]
    flange = moved(truth.flange.origin_m, truth.flange.rotation_rad)
    between = [end @ offset for end, offset in zip(ends[:-1], offsets[1:], strict=True)]
    com_m = [end[:3, :3] @ joint.com_m + end[:3, 3] for end, joint in zip(ends, rig.arm.joint, strict=True)]
    fixed = [moved(part.origin_m, part.rotation_rad) for part in truth.parts]
    return Arm(
        fixed=np.stack(fixed or [offsets[0], *between, ends[-1] @ flange]),
        zero_rad=np.array(truth.joint_zero_rad),
        lower_rad=np.full(n, -NO_LIMIT_RAD),
        upper_rad=np.full(n, NO_LIMIT_RAD),
        mass_kg=np.array([joint.mass_kg for joint in rig.arm.joint]),
        com_m=np.array(com_m),
        tool_kg=rig.tool.mass_kg,
        tool_com_m=np.array(rig.tool.com_m),
        gravity_m_s2=np.array(rig.arm.gravity_m_s2),
    )


def _end(link: TrueLink) -> Floats:
    """Tz(d) Tx(a) Rx(alpha) Ry(beta)."""
    return shifted((link.a_m, 0.0, link.d_m)) @ turned((link.alpha_rad, 0.0, 0.0)) @ turned((0.0, link.beta_rad, 0.0))
