"""The part of a rig file that a hand-held measuring arm is emulated from, and what that arm truly is.

Links, encoders, cones, bars, spheres. Keys that are not of this world are not read. A missing deviation is zero, as a
perfect arm would have it. The truth is drawn once from the seed, frozen, and written only outside of any recording.
Every kind of deviation has a random stream of its own: switching one off leaves the others as they were.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simulators.arm.kinematics import moved
from simulators.encoders.discs import TrueDisc, draw_disc
from simulators.errors import WorldError

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


class MeasuringJoint(Part, frozen=True, kw_only=True):
    """A fixed part and the range of the joint behind it."""

    lower_rad: float
    upper_rad: float
    sign: int = 1
    follows: Mapping[str, float] | None = None


class MeasuringArm(msgspec.Struct, frozen=True):
    """The nominal arm, a local product of exponentials."""

    joint: Annotated[tuple[MeasuringJoint, ...], msgspec.Meta(min_length=1)]
    model: str
    flange: Part = Part()


class ProbeTool(msgspec.Struct, frozen=True):
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


class HandEmulation(msgspec.Struct, frozen=True):
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
    """Everything that this world wants to know, as assumed; the deviations come on top."""

    arm: MeasuringArm
    tool: ProbeTool = ProbeTool()
    seat: tuple[Seat, ...] = ()
    bar: tuple[Bar, ...] = ()
    bar_position: tuple[BarPosition, ...] = ()
    sphere: tuple[Sphere, ...] = ()
    emulation: HandEmulation = HandEmulation()


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


Floats = NDArray[np.float64]
SCHEMA = 1
KIND = "hand-held-arm"
CYCLES = (-3, -2, -1, 2, 3)  # error motions of an axis a turn, see simulators/hand/held_arm.py
AXIAL_CYCLES = (1, 2, 3)


class TrueAxis(msgspec.Struct, frozen=True):
    """How one axis leans while it turns."""

    lean_rad: float
    cycles: int
    bearing_rad: float


class TrueRunout(msgspec.Struct, frozen=True):
    """How far one axis stands aside, and goes to and fro along itself, while it turns."""

    radial_m: float
    radial_cycles: int
    radial_bearing_rad: float
    axial_m: float
    axial_cycles: int
    axial_bearing_rad: float


class TruePoint(msgspec.Struct, frozen=True):
    """The middle of a cone or a sphere, in the base."""

    id: int
    origin_m: Vector


class TrueBar(msgspec.Struct, frozen=True):
    """A bar in one of its positions: the middles of both ends, in the base."""

    id: int
    bar: int
    a_m: Vector
    b_m: Vector


class HandTruth(msgspec.Struct, frozen=True):
    """The concealed arm. True joint angle = shaft angle + joint zero; the encoders see shafts."""

    seed: int
    parts: tuple[Part, ...]
    joint_zero_rad: tuple[float, ...]
    discs: tuple[TrueDisc, ...]
    axes: tuple[TrueAxis, ...]
    runouts: tuple[TrueRunout, ...]
    tool_point_m: Vector
    seats: tuple[TruePoint, ...]
    bars: tuple[TrueBar, ...]
    spheres: tuple[TruePoint, ...]
    encoder_noise_rad: float
    kind: str = KIND
    schema: int = SCHEMA


def draw_hand_truth(rig: HandRig, seed: int) -> HandTruth:
    """The truth that belongs to a rig and a seed; the same two always give the same. WorldError for a seed below 0."""
    if seed < 0:
        raise WorldError(f"seed {seed}; give a whole number from 0 on")
    streams = np.random.SeedSequence([seed, 6]).spawn(6)
    part, zero, disc, axis, place, runout = (np.random.default_rng(s) for s in streams)
    sigma, n = rig.emulation, len(rig.arm.joint)
    drawn = (*rig.arm.joint, rig.arm.flange)
    return HandTruth(
        seed=seed,
        parts=tuple(_made(one, sigma, part) for one in drawn),
        joint_zero_rad=tuple((sigma.joint_zero_max_rad * zero.uniform(-1.0, 1.0, n)).tolist()),
        discs=tuple(draw_disc(sigma.disc_eccentricity_m, sigma.graduation_rad, disc) for _ in range(n)),
        axes=tuple(_axis(sigma, axis) for _ in range(n)),
        runouts=tuple(_runout(sigma, runout) for _ in range(n)),
        tool_point_m=rig.tool.point_m,
        seats=tuple(TruePoint(s.id, _off(s.origin_m, sigma, place)) for s in rig.seat),
        bars=_bars(rig, place),
        spheres=tuple(TruePoint(s.id, _off(s.origin_m, sigma, place)) for s in rig.sphere),
        encoder_noise_rad=sigma.encoder_noise_rad,
    )


def _made(drawn: Part, sigma: HandEmulation, rng: np.random.Generator) -> Part:
    """The drawn part with a small motion behind it: six errors a link."""
    nominal = moved(np.array(drawn.origin_m), np.array(drawn.rotation_rad))
    off = moved(sigma.length_sigma_m * rng.standard_normal(3), sigma.angle_sigma_rad * rng.standard_normal(3))
    true = nominal @ off
    return Part(vector(true[:3, 3]), vector(Rotation.from_matrix(true[:3, :3]).as_rotvec()))


def _axis(sigma: HandEmulation, rng: np.random.Generator) -> TrueAxis:
    lean_rad = abs(sigma.axis_wobble_rad * rng.standard_normal())
    return TrueAxis(float(lean_rad), int(rng.choice(CYCLES)), float(rng.uniform(-np.pi, np.pi)))


def _runout(sigma: HandEmulation, rng: np.random.Generator) -> TrueRunout:
    radial_m, axial_m = (abs(float(x)) for x in rng.standard_normal(2))
    radial_rad, axial_rad = (float(x) for x in rng.uniform(-np.pi, np.pi, 2))
    radial_cycles, axial_cycles = int(rng.choice(CYCLES)), int(rng.choice(AXIAL_CYCLES))
    return TrueRunout(
        sigma.radial_runout_m * radial_m,
        radial_cycles,
        radial_rad,
        sigma.axial_runout_m * axial_m,
        axial_cycles,
        axial_rad,
    )


def _off(nominal_m: Vector, sigma: HandEmulation, rng: np.random.Generator) -> Vector:
    return vector(np.array(nominal_m) + sigma.artefact_sigma_m * rng.standard_normal(3))


def _bars(rig: HandRig, rng: np.random.Generator) -> tuple[TrueBar, ...]:
    """Set up by hand: off by the artefacts' sigma in place, and by as much at the ends in direction."""
    out: list[TrueBar] = []
    for position in rig.bar_position:
        length_m = next(bar.length_m for bar in rig.bar if bar.id == position.bar)
        middle_m = np.array(_off(position.middle_m, rig.emulation, rng))
        along = np.array(position.direction) / np.linalg.norm(position.direction)
        along = along + 2.0 * rig.emulation.artefact_sigma_m / length_m * rng.standard_normal(3)
        half_m = 0.5 * length_m * along / np.linalg.norm(along)
        out.append(TrueBar(position.id, position.bar, vector(middle_m - half_m), vector(middle_m + half_m)))
    return tuple(out)


def vector(values: Floats) -> Vector:
    """Three numbers as a record holds them."""
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def write_hand_truth(truth: HandTruth, path: Path) -> None:
    """Writes the truth as JSON, SI names with their units; folders are made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(msgspec.json.format(msgspec.json.encode(truth), indent=1) + b"\n")
