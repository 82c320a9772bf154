"""A rig that goes through a motion once more: what every instrument reads at each sample, without noise.

    read = replayed(rig, scene, mechanisms, reading_rad)

The arm stands where its mechanisms and its weight let it (`conceal.chain`); each instrument that the rig has observes
it there. A probe in a cone is another matter: its point is fixed, so it is the encoders that read something else.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simulators.arm.kinematics import Arm, inverse
from simulators.arm.statics import weigh
from simulators.conceal.observe import on_their_plate, readings_at
from simulators.conceal.readings import Stance, length_m, position_m, spots, stand, tip_m, true_shaft_rad
from simulators.conceal.rig import Device, DualPsd, TrueRig
from simulators.defects import Defect, Scene
from simulators.defects.defect import MovesDevice, ReadsAngle, TurnsJoint

Floats = NDArray[np.float64]
Where = Literal["", "second", "motor", "past", "camera"]


@dataclass(frozen=True)
class Sited:
    """A mechanism, and where it sits if that is not where its kind usually does.

    Of joints with two encoders: in the second one ("second"), between a second encoder at the motor and a controller
    that reads the link ("motor"), behind both ("past"). Of instruments: in the camera.
    """

    defect: Defect
    where: Where = ""


@dataclass(frozen=True, eq=False)
class Mounted:
    """A body on the flange and the device that sees it, each a frame (4, 4): in the base, and in the flange."""

    device: Floats
    body: Floats


@dataclass(frozen=True, eq=False)
class Rigged:
    """The arm and what stands around it; None: the rig has no such instrument."""

    arm: Arm
    tool_point_m: Floats  # (3,) target or probe in the flange frame; (row, 3) where several are read in turn
    light: DualPsd | None = None
    tracker: Mounted | None = None  # a tracker or a wire drum; of its body only the turn counts
    camera: Mounted | None = None
    seat_m: Floats | None = None  # (row, 3) the cone of each sample in the base; NaN: the probe is in none


@dataclass(frozen=True, eq=False)
class Readings:
    """One row a sample. None: the rig has no such instrument."""

    reading_rad: Floats  # (row, n) the controller's
    spots_m: Floats | None  # (row, 4)
    sums_v: Floats | None  # (row, 2)
    position_m: Floats | None  # (row, 3) of the target in the device's frame
    turn_rad: Floats | None  # (row, 3) rotation vector of the target's axes in the device's frame
    length_m: Floats | None  # (row,)
    camera_m: Floats | None  # (row, 3)
    camera_rad: Floats | None  # (row, 3)
    between_rad: Floats  # (row, n) second encoder less controller, both at zero where the arm is


def replayed(rig: Rigged, scene: Scene, mechanisms: Sequence[Sited], reading_rad: Floats) -> Readings:
    """`reading_rad` (row, n): what the controller read; of a probe in a cone, about what it read."""
    at_flange = [one.defect for one in mechanisms if one.where in ("", "past")]
    if rig.seat_m is not None:
        reading_rad = _seated(rig, rig.seat_m, scene, at_flange, reading_rad)
    own = TrueRig(rig.arm, rig.tool_point_m, Device(np.eye(4)))
    stance = stand(own, scene, at_flange, reading_rad)
    light = None if rig.light is None else spots(own, rig.light, scene, at_flange, stance)
    seen = None if rig.tracker is None else _seen(own, rig.tracker, scene, at_flange, stance)
    drum = None if rig.tracker is None else length_m(own, Device(rig.tracker.device), scene, at_flange, stance)[:, 0]
    of_camera = [one.defect for one in mechanisms if one.where in ("", "past", "camera")]
    camera = None if rig.camera is None else _of_camera(rig.arm, rig.camera, scene, of_camera, stance)
    return Readings(
        reading_rad,
        None if light is None else light.seen_m,
        None if light is None else light.sum_v,
        None if seen is None else seen[0],
        None if seen is None else seen[1],
        drum,
        None if camera is None else camera[0],
        None if camera is None else camera[1],
        _between_rad(rig.arm, scene, mechanisms, reading_rad),
    )


def _seated(rig: Rigged, seat_m: Floats, scene: Scene, defects: Sequence[Defect], reading_rad: Floats) -> Floats:
    """Rows that are in no cone stay as they are."""
    own = TrueRig(rig.arm, rig.tool_point_m, Device(np.eye(4)))
    seat_m = on_their_plate(seat_m, scene, defects)
    free = ~np.isfinite(seat_m).all(axis=1, keepdims=True)
    anywhere = np.where(free, tip_m(own, stand(own, scene, defects, reading_rad)), seat_m)
    posture_rad = true_shaft_rad(defects, scene, reading_rad)
    return np.where(free, reading_rad, readings_at(own, anywhere, scene, defects, posture_rad))


def _seen(
    rig: TrueRig, mounted: Mounted, scene: Scene, defects: Sequence[Defect], stance: Stance
) -> tuple[Floats, Floats]:
    """Position and orientation of the body in the device's frame."""
    device = np.broadcast_to(mounted.device, (len(scene), 4, 4))
    for defect in defects:
        if isinstance(defect, MovesDevice):
            device = device @ defect.device_motion(scene)
    seen = inverse(device) @ stance.T_base_tool @ mounted.body
    turn = Rotation.from_matrix(seen[:, :3, :3]).as_rotvec()
    return position_m(rig, Device(mounted.device), scene, defects, stance), turn


def _of_camera(
    arm: Arm, mounted: Mounted, scene: Scene, defects: Sequence[Defect], stance: Stance
) -> tuple[Floats, Floats]:
    return _seen(TrueRig(arm, mounted.body[:3, 3], Device(mounted.device)), mounted, scene, defects, stance)


def _between_rad(arm: Arm, scene: Scene, mechanisms: Sequence[Sited], reading_rad: Floats) -> Floats:
    """Second encoders less the controller's, (row, n).

    The controller's own encoder errs on one side of the difference, what turns between the two on the other.
    """
    usual = [one.defect for one in mechanisms if one.where in ("", "past")]
    stance = stand(TrueRig(arm, np.zeros(3), Device(np.eye(4))), scene, usual, reading_rad)
    shaft_rad = true_shaft_rad(usual, scene, reading_rad)
    foot = np.broadcast_to(np.eye(4), (len(scene), 4, 4))
    load = stance.load or weigh(arm, stance.frames, foot, scene.payload_kg, scene.payload_com_m)
    between_rad = shaft_rad - reading_rad
    for one in mechanisms:
        sign = {"": 1.0, "second": 1.0, "motor": -1.0, "past": 0.0, "camera": 0.0}[one.where]
        defect = one.defect
        if isinstance(defect, TurnsJoint):
            between_rad = between_rad + sign * defect.extra_turn_rad(shaft_rad, scene, load)
        elif isinstance(defect, ReadsAngle) and one.where == "second":
            between_rad = between_rad - defect.reading_error_rad(shaft_rad, scene)
    return between_rad
