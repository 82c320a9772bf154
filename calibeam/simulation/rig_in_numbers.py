"""The geometry of a model as a rig of the simulators: frames and points cross over, no formula.

The simulators have an arm as fixed parts between turns about z. Those of a modified Denavit-Hartenberg table are cut
where a link starts, at the foot of the offset d, so that a link that bends or grows is the link itself.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import Arm as RigArm
from acquisition.recording.rig import ArmModel, Rig
from acquisition.recording.samples import BAR, SEAT, TARGET
from calibrate.errors import DataError
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.placement import AXES, Device
from calibrate.model.predict import Predictor
from calibrate.model.rigid import transform
from calibrate.model.sensors.bar import bar_pairs
from calibrate.model.sensors.position import seen_at
from calibrate.model.sensors.spots import dual_psd_of
from simulators.arm.drawing import Drawing, Row, turning_com_m
from simulators.arm.kinematics import Arm, shifted
from simulators.conceal.rig import DualPsd
from simulators.replayed import Mounted, Rigged

Floats = NDArray[np.float64]
ZERO = (0.0, 0.0, 0.0)
BAR_END = "bar_end"
NO_LIMIT_RAD = 2.0 * np.pi


def rigged(predictor: Predictor, samples: Samples) -> Rigged:
    """The rig of a model, with the instruments that the model knows and the samples used."""
    return Rigged(
        arm=arm_in_numbers(predictor),
        tool_point_m=_points_m(predictor, samples),
        light=_light(predictor, samples),
        tracker=tracker_of(predictor),
        camera=_camera(predictor),
        seat_m=_seats_m(predictor, samples),
    )


def _points_m(predictor: Predictor, samples: Samples) -> Floats:
    """(3,) target or probe in the flange; (row, 3) where rows name targets, those that name none at the tool's."""
    own_m = predictor.tip_at(np.eye(4)[np.newaxis])[0]
    if not predictor.rig.targets or TARGET not in samples:
        return own_m
    named_m = seen_at(predictor, np.tile(np.eye(4), (len(samples), 1, 1)), samples)
    return np.where(np.isfinite(named_m), named_m, own_m)


def arm_in_numbers(predictor: Predictor) -> Arm:
    """Fixed parts, zeros and masses. Where a rig states no mass, one kilogram at the end of every link.

    DataError for a rig with coupled joints: the simulators turn every joint from the link in front.
    """
    rig = predictor.rig
    _refuse_coupled(rig)
    arm = arm_of(rig)
    theta = predictor.values_of(arm.parameters)
    fixed = _from_their_start(arm.fixed_parts(theta), beyond_m(rig))
    n = arm.n_joints
    mass_kg = np.array([joint.mass_kg or 0.0 for joint in rig.arm.joints])
    com_m = turning_com_m(_drawing(rig.arm))
    if not mass_kg.any():
        mass_kg, com_m = np.ones(n), fixed[1:, :3, 3]
    return Arm(
        fixed=fixed,
        zero_rad=np.asarray(arm.angle_offset_rad(theta), dtype=np.float64),
        lower_rad=np.full(n, -NO_LIMIT_RAD),
        upper_rad=np.full(n, NO_LIMIT_RAD),
        mass_kg=mass_kg,
        com_m=com_m,
        tool_kg=rig.tool.mass_kg or 0.0,
        tool_com_m=np.array(rig.tool.com_m or ZERO),
        gravity_m_s2=np.array(rig.arm.gravity_m_s2),
    )


def _refuse_coupled(rig: Rig) -> None:
    for number, joint in enumerate(rig.arm.joints, start=1):
        if joint.follows is not None:
            raise DataError(
                f"rig {rig.name}: joint {number} follows joint {joint.follows.joint}, and the simulated arm has no "
                "coupled joints; predict and compare --simulated-model take this model"
            )


def beyond_m(rig: Rig) -> Floats:
    """(n + 1,) how far along z the model's frame in front of each joint stands beyond the start of its link."""
    joints = rig.arm.joints
    if rig.arm.model is not ArmModel.MDH:
        return np.zeros(len(joints) + 1)
    return np.array([*(joint.d_m or 0.0 for joint in joints), 0.0])


def _from_their_start(parts: Floats, beyond: Floats) -> Floats:
    """(n + 1, 4, 4) the same chain; a shift along z passes through the turn about it."""
    along = shifted(np.stack([np.zeros_like(beyond), np.zeros_like(beyond), beyond], axis=1))
    before = np.concatenate([np.eye(4)[np.newaxis], along[:-1]])
    return before @ parts @ np.linalg.inv(along)


def _drawing(arm: RigArm) -> Drawing:
    """What the simulators ask to place a centre of mass."""
    joints = arm.joints
    return Drawing(
        name="",
        model=arm.model.value,
        rows=tuple(Row(j.a_m or 0.0, j.alpha_rad or 0.0, j.d_m or 0.0, j.theta_offset_rad or 0.0) for j in joints),
        fixed=(),
        flange=(arm.flange.origin_m, arm.flange.rotation_rad),
        lower_rad=(0.0,) * len(joints),
        upper_rad=(0.0,) * len(joints),
        mass_kg=tuple(joint.mass_kg or 0.0 for joint in joints),
        com_m=tuple(joint.com_m or ZERO for joint in joints),
        gear_ratio=(),
        reach_m=0.0,
    )


def light_of(predictor: Predictor) -> tuple[DualPsd, Floats] | None:
    """The laser and the fixture at all places, as found, and the four scales of the faces; None without a fixture."""
    rig = predictor.rig
    if rig.fixture is None or not rig.placements or rig.tool.laser_direction is None:
        return None
    none = np.zeros(0, dtype=np.int64)
    sensor = dual_psd_of(rig, none, none)
    phi = predictor.values_of(sensor.parameters)
    origin_m, direction = sensor.mount.in_flange(phi[:4])
    places = np.tile(np.eye(4), (max(sensor.places), 1, 1))
    for place in sensor.places:
        places[place - 1] = sensor.T_base_psd1(phi, place)
    fixture = DualPsd(
        laser_origin_m=origin_m,
        laser_direction=direction / np.linalg.norm(direction),
        half_size_m=rig.fixture.half_size_m,
        psd2_in_psd1=sensor.T_psd1_psd2(phi),
        places=places,
    )
    return fixture, phi[4:8]


def _light(predictor: Predictor, samples: Samples) -> DualPsd | None:
    found = light_of(predictor)
    return None if found is None or "placement" not in samples else found[0]


def tracker_of(predictor: Predictor) -> Mounted | None:
    """The tracker in the base and its target on the flange; None where neither model nor rig knows a place."""
    try:
        device = predictor.T_base_device
    except DataError:
        return None  # the model knows no device: it has seen none
    body = np.eye(4)
    body[:3, :3] = predictor.turn_of_target()
    return Mounted(device, body)


def _camera(predictor: Predictor) -> Mounted | None:
    if not {"camera", "marker"} <= set(predictor.about):
        return None
    return Mounted(_found(predictor, "camera"), _found(predictor, "marker"))


def _found(predictor: Predictor, name: str) -> Floats:
    """(4, 4) a frame from where the model has it, with the corrections along and about its own axes.

    A body on the flange is shifted along the axes of the flange.
    """
    about = predictor.about[name]
    six = np.array([predictor.values.get(f"{name}.{axis}", 0.0) for axis in AXES])
    start = transform(about[:3], about[3:])
    if name == "camera":
        return Device(start, name=name).T_base_device_at(six)
    out = start.copy()
    out[:3, 3] += six[:3]
    out[:3, :3] = start[:3, :3] @ Rotation.from_rotvec(six[3:]).as_matrix()
    return out


def _seats_m(predictor: Predictor, samples: Samples) -> Floats | None:
    """(row, 3) where the probe sits; None where no sample is in a cone or at a bar.

    A cone that the model does not know is where the model has its tips on average. A bar lies where the model has
    both its ends, with its own length.
    """
    if not any(name in samples and np.isfinite(samples.column(name)).any() for name in (SEAT, BAR)):
        return None
    tips = predictor.tip_m(samples.joints())
    out = np.full((len(samples), 3), np.nan)
    if SEAT in samples:
        seat = samples.integers(SEAT, 0)
        for k in sorted(set(seat.tolist()) - {0}):
            known = predictor.seat_m(k)
            out[seat == k] = tips[seat == k].mean(axis=0) if known is None else known
    if BAR in samples and BAR_END in samples:
        _lay_bars(out, tips, samples, {k: bar.length_m for k, bar in predictor.rig.bars.items()})
    return out


def _lay_bars(out: Floats, tips: Floats, samples: Samples, length_m: Mapping[int, float]) -> None:
    rows = np.flatnonzero(np.isfinite(samples.column(BAR)))
    if not len(rows):
        return
    bar = samples.integers(BAR, 0)
    for a, b in bar_pairs(rows, bar[rows], samples.columns[BAR_END][rows]).tolist():
        middle, along = (tips[a] + tips[b]) / 2.0, tips[b] - tips[a]
        half = 0.5 * length_m[int(bar[a])] * along / np.linalg.norm(along)
        out[a], out[b] = middle - half, middle + half
