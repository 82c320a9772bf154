"""Mechanisms of `simulators.defects` at work in the moving world, and the conditions that they are exposed to.

What turns a joint or falsifies its encoder goes into the angle that the servo uses; what moves base, links or tool
bends the beam; what moves the fixture or distorts a reading acts on the light. Everything is computed every few steps
and held in between (a beam that is off by 1e-4 for each metre of motion errs by 1e-6 m meanwhile).

Conditions have rows: the start, the moves that have ended, and last of all this moment. Mechanisms with a memory (play)
use the whole history, the others the last row. A body that is heated evenly and cooled by the air around it follows 1 -
exp(-t/tau) (Newton's law of cooling). Nothing in the emulated geometry depends on temperature: heat that lengthens a
link is a mechanism (`simulators.defects`).

What it does not imitate: the load is that of the arm as it stands, without the bend of links and base (1e-4 of 1e-4).
"""

import math
from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simulators.arm.kinematics import Arm, Frames, inverse, moved
from simulators.arm.statics import Load, weigh
from simulators.conceal.readings import FULL_SUM_V
from simulators.defects import Light, Scene
from simulators.defects.defect import (
    ChangesSums,
    Defect,
    DistortsPosition,
    DistortsSpots,
    MovesBase,
    MovesDevice,
    MovesFixture,
    MovesLink,
    MovesTool,
    ReadsAngle,
    TurnsJoint,
)
from simulators.world.optics import Face, Ray, Spot, Spots, meet, reflect
from simulators.world.rig import Pose

Floats = NDArray[np.float64]
AMBIENT_DEGC = 22.0
JOINT_RISE_K = 12.0  # a UR5e at slow work reports about 30 to 35 degC in its joints after an hour
JOINT_TAU_S = 1800.0
PSD_RISE_K = 4.0  # a closed box with an amplifier; feels right
PSD_TAU_S = 900.0
LINK_SHARE = 0.45  # of what its motor warms to
LASER_RISE_K = 4.5
LASER_TAU_S = 600.0


def joint_temperature_degC(time_s: float) -> float:
    return AMBIENT_DEGC - JOINT_RISE_K * math.expm1(-time_s / JOINT_TAU_S)


def psd_temperature_degC(time_s: float) -> float:
    return AMBIENT_DEGC - PSD_RISE_K * math.expm1(-time_s / PSD_TAU_S)


def link_temperature_degC(time_s: float) -> float:
    return AMBIENT_DEGC + LINK_SHARE * (joint_temperature_degC(time_s) - AMBIENT_DEGC)


def laser_temperature_degC(time_s: float) -> float:
    return AMBIENT_DEGC - LASER_RISE_K * math.expm1(-time_s / LASER_TAU_S)


STOOD_S = 0.050  # an unchanged set-point: what comes then is another move (as in repeatability.SEATING_S)
REMEMBERED = 400  # moves; a play of 0.1 mrad has forgotten all but the last few
NO_LOAD_KG = 0.0


class Exposure:
    """Follows the set-point. Joint vectors (n,) are the controller's own readings."""

    def __init__(self, q_rad: Floats, rest_degC: Mapping[str, float] | None = None) -> None:
        """`rest_degC`: by place, the temperature at which the rig is nominal; none: that at power-on."""
        self._rest_degC = rest_degC or {}
        self._start_rad = q_rad.copy()
        self._via_rad, self._goal_rad = q_rad.copy(), q_rad.copy()
        self._changed_s = -STOOD_S
        self._moves: deque[tuple[Floats, Floats]] = deque(maxlen=REMEMBERED)

    def commanded(self, q_rad: Floats, time_s: float) -> None:
        """Another set-point."""
        if time_s - self._changed_s >= STOOD_S:
            if not np.array_equal(self._via_rad, self._goal_rad):
                self._moves.append((self._via_rad, self._goal_rad))
            self._via_rad = self._goal_rad
        self._goal_rad = q_rad.copy()
        self._changed_s = time_s

    def scene(self, time_s: float, qd_rad_s: Floats, placement: int) -> Scene:
        """The present moment in the last row."""
        moves = [(self._start_rad, self._start_rad), *self._moves, (self._via_rad, self._goal_rad)]
        rows = len(moves)

        def now(value: float | Floats) -> Floats:
            column = np.zeros((rows, *np.shape(value)))
            column[-1] = value
            return column

        return Scene(
            t_s=now(time_s),
            via_rad=np.array([via for via, _ in moves]),
            goal_rad=np.array([goal for _, goal in moves]),
            qd_rad_s=now(qd_rad_s),
            wait_s=now(max(time_s - self._changed_s, 0.0)),
            payload_kg=np.full(rows, NO_LOAD_KG),
            payload_com_m=np.zeros(3),
            placement=np.full(rows, placement, dtype=np.int64),
            first_psd=np.zeros(rows, dtype=np.int64),
            seat=np.zeros(rows, dtype=np.int64),
            temperature_degC=temperatures(np.array([0.0] * (rows - 1) + [time_s]), len(qd_rad_s)),
            laser_power=np.ones(rows),
            extra={},
            rest_degC=self._rest_degC,
        )


def temperatures(time_s: Floats, n_joints: int) -> Mapping[str, Floats]:
    """By place, (row,) degC: of an arm that works since power-on in a room that stays as it is."""
    laws = {"joint": joint_temperature_degC, "link": link_temperature_degC, "laser": laser_temperature_degC}
    warm = {where: np.array([law(t) for t in time_s.tolist()]) for where, law in laws.items()}
    found = {"room": np.full(len(time_s), AMBIENT_DEGC), "laser": warm["laser"]}
    for number in range(1, n_joints + 1):
        found |= {f"joint{number}": warm["joint"], f"link{number}": warm["link"]}
    return found


GROUND = np.eye(4)[np.newaxis]


class MovingMechanisms:
    """What the mechanisms do at the last moment that they were asked about."""

    def __init__(self, defects: Sequence[Defect], arm: Arm) -> None:
        """`arm`: the true one, with its masses."""
        self._turners = [d for d in defects if isinstance(d, TurnsJoint)]
        self._readers = [d for d in defects if isinstance(d, ReadsAngle)]
        self._bases = [d for d in defects if isinstance(d, MovesBase)]
        self._links = [d for d in defects if isinstance(d, MovesLink)]
        self._tools = [d for d in defects if isinstance(d, MovesTool)]
        self._fixtures = [d for d in defects if isinstance(d, MovesFixture)]
        self.at_the_light = [d for d in defects if isinstance(d, (DistortsSpots, ChangesSums))]
        self._devices = [d for d in defects if isinstance(d, MovesDevice)]
        self._at_the_target = [d for d in defects if isinstance(d, DistortsPosition)]
        self._arm = arm
        self.turn_rad: Floats = np.zeros(arm.n_joints)  # true angle less reading, beside zero and repeatability
        self.fixture: Floats | None = None  # motion of the fixture in its own frame; None: it stands still
        self.scene: Scene | None = None
        self._extra_rad: Floats = np.zeros(arm.n_joints)
        self._bend: Floats = np.eye(4)

    def felt(self, scene: Scene, joint_rad: Floats, offset_rad: Floats, turning: Floats, flange: Floats) -> None:
        """Works it out for an arm at `joint_rad` (n,), of which `offset_rad` (n,) is zero and repeatability.

        `turning` (n, 4, 4) and `flange` (4, 4): where its frames are, in the base.
        """
        self.scene = scene
        shaft_rad = np.tile(joint_rad - offset_rad - self._extra_rad, (len(scene), 1))
        if self._turners or self._bases or self._links or self._tools:
            load = self._load(turning, flange, len(scene))
            turns = (turner.extra_turn_rad(shaft_rad, scene, load)[-1] for turner in self._turners)
            self._extra_rad = sum(turns, np.zeros_like(joint_rad))
            self._bend = self._bent(scene, load, joint_rad, turning, flange)
        errors = (reader.reading_error_rad(shaft_rad, scene)[-1] for reader in self._readers)
        self.turn_rad = self._extra_rad - sum(errors, np.zeros_like(joint_rad))
        if self._fixtures:
            motion = np.eye(4)
            for mover in self._fixtures:
                motion = motion @ mover.fixture_motion(scene)[-1]
            self.fixture = motion

    def bent(self, beam: Ray) -> Ray:
        """The beam where base, links and mount have carried it."""
        x, y, z = (self._bend[:3, :3] @ beam[:3] + self._bend[:3, 3]).tolist()
        dx, dy, dz = (self._bend[:3, :3] @ beam[3:]).tolist()
        return Ray(x, y, z, dx, dy, dz)

    def carried(self, pose: Floats) -> Floats:
        """The same of the flange (4, 4); the mount's own motion counts as the flange's."""
        return self._bend @ pose

    def seen_position_m(self, target_m: Floats, device: Floats) -> Floats:
        """(3,) as a tracker at `device` (4, 4) gives a target (3,) in the base: it may move, and err."""
        if self.scene is None:
            return device[:3, :3].T @ (target_m - device[:3, 3])
        for defect in self._devices:
            device = device @ defect.device_motion(self.scene)[-1]
        seen_m = np.tile(device[:3, :3].T @ (target_m - device[:3, 3]), (len(self.scene), 1))
        for defect in self._at_the_target:
            seen_m = defect.seen_position_m(seen_m, self.scene)
        return seen_m[-1]

    def _load(self, turning: Floats, flange: Floats, rows: int) -> Load:
        """The load of the moment in every row."""
        now = weigh(self._arm, Frames(turning[np.newaxis], flange[np.newaxis]), GROUND, np.zeros(1), np.zeros(3))

        def every(values: Floats) -> Floats:
            return np.repeat(values, rows, axis=0)

        return Load(
            every(now.torque_nm),
            every(now.payload_torque_nm),
            every(now.moment_nm),
            every(now.force_n),
            every(now.beyond_nm),
            every(now.beyond_n),
            every(now.down_flange),
            Frames(every(now.frames.turning), every(now.frames.flange)),
            now.gravity_m_s2,
        )

    def _bent(self, scene: Scene, load: Load, joint_rad: Floats, turning: Floats, flange: Floats) -> Floats:
        """(4, 4) in the base frame: motions of base, links and tool, each about where it takes place."""
        bend = np.eye(4)
        for base in self._bases:
            bend = base.base_motion(scene, load)[-1] @ bend
        angle_rad = np.tile(joint_rad, (len(scene), 1))
        for link in range(len(turning) + 1):
            here = np.eye(4) if link == 0 else turning[link - 1]
            end_m = self._arm.fixed[link, :3, 3]
            for mover in self._links:
                if link in mover.links:
                    bend = bend @ _about(here, mover.link_motion(link, end_m, angle_rad, scene, load)[-1])
        for mount in self._tools:
            bend = bend @ _about(flange, mount.tool_motion(scene, load)[-1])
        return bend


def _about(frame: Floats, motion: Floats) -> Floats:
    """A motion given in a frame, in the base."""
    return frame @ motion @ inverse(frame[np.newaxis])[0]


def fixture_at(pose: Pose, motion: Floats) -> Pose:
    """A place of the fixture with its own motion (4, 4)."""
    there = moved(pose.origin_m, pose.rotation_rad) @ motion
    x, y, z = there[:3, 3].tolist()
    rx, ry, rz = Rotation.from_matrix(there[:3, :3]).as_rotvec().tolist()
    return Pose((x, y, z), (rx, ry, rz))


def seen(spots: Spots, beam: Ray, faces: tuple[Face, Face], hidden: MovingMechanisms) -> Spots:
    """The spots as the detectors read them; a face without light stays dark."""
    acting = hidden.at_the_light
    if not acting or hidden.scene is None or spots.psd1 is None or spots.psd2 is None:
        return spots
    scene = hidden.scene
    light = _light(spots.psd1, spots.psd2, _directions(spots.first, beam, faces), scene)
    seen_m, sum_v = light.spot_m, light.sum_v
    for defect in acting:
        if isinstance(defect, DistortsSpots):
            seen_m = defect.seen_spots_m(seen_m, light, scene)
        if isinstance(defect, ChangesSums):
            sum_v = defect.seen_sum_v(sum_v, scene)
    (x1_m, y1_m), (x2_m, y2_m) = seen_m[-1].tolist()
    share1, share2 = (sum_v[-1] / FULL_SUM_V).tolist()
    return Spots(Spot(x1_m, y1_m, share1), Spot(x2_m, y2_m, share2), spots.first)


def _light(one: Spot, two: Spot, direction: Floats, scene: Scene) -> Light:
    """The same light in every row: of mechanisms that look back, the last one counts."""
    rows = len(scene)
    spot_m = np.array([one[:2], two[:2]])
    sum_v = FULL_SUM_V * np.array([one.share, two.share])
    return Light(*(np.repeat(values[np.newaxis], rows, axis=0) for values in (spot_m, direction, sum_v)))


def _directions(first: int, beam: Ray, faces: tuple[Face, Face]) -> Floats:
    """(2, 3) of the arriving beam in the frame of PSD 1 and 2: direct at the first one, mirrored at the other."""
    near = faces[first - 1]
    struck = meet(beam, near)
    onward = beam if struck is None else reflect(beam, near, struck.distance_m)
    arriving = (beam, onward) if first == 1 else (onward, beam)
    axes = np.array([[face.axis_x, face.axis_y, face.normal] for face in faces])
    return np.einsum("fij,fj->fi", axes, np.array([ray[3:] for ray in arriving]))
