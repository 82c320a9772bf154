"""The true arm under a hand: what its encoders show, and where the probe is, mechanism by mechanism.

Shaft angles are the unknowns: encoders look at shafts; a joint's true angle is its shaft's, its zero, and what the
hand's force turns it beyond (the structure between disc and link gives way: compliance times axis . (lever x force)).
Does not imitate: weight (measuring arms are balanced), bending tubes, heat.

Bearings of the emulated arm: while a joint turns, its axis leans, runs out sideways, and goes up and down.

Seen from the housing the axis leans, or stands aside, towards (cos(k q + b), sin(k q + b)): lobes of a race that come
back k times a turn (Bryan, Clouser and Holland, "Spindle accuracy", American Machinist 1967: tilt, radial and axial
error motion). k = 1 would turn with the joint, k = 0 stand still: both are geometry. Axially every k counts, for
nothing of a link goes to and fro with an angle.
Does not imitate: what does not come back with the angle (rolling elements, dirt, play).
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Arm, Frames, forward, jacobian
from simulators.arm.rigid import moved
from simulators.defects.encoder import RADIUS_M
from simulators.hand.hand_rig import HandTruth, TrueAxis, TrueRunout
from simulators.hand.rig import HandRig

Floats = NDArray[np.float64]


class Bearings:
    """Of all joints of one arm."""

    def __init__(self, axes: Sequence[TrueAxis], runouts: Sequence[TrueRunout]) -> None:
        self._lean_rad = np.array([axis.lean_rad for axis in axes])
        self._lean_rate = np.array([axis.cycles - 1 for axis in axes])
        self._lean_bearing_rad = np.array([axis.bearing_rad for axis in axes])
        self._aside_m = np.array([one.radial_m for one in runouts])
        self._aside_rate = np.array([one.radial_cycles - 1 for one in runouts])
        self._aside_bearing_rad = np.array([one.radial_bearing_rad for one in runouts])
        self._along_m = np.array([one.axial_m for one in runouts])
        self._along_rate = np.array([one.axial_cycles for one in runouts])
        self._along_bearing_rad = np.array([one.axial_bearing_rad for one in runouts])

    def motions(self, joint_rad: Floats) -> Mapping[int, Floats]:
        """(row, 4, 4) by link, in the frame that turns with joint i, at the start of the link behind it: number i + 1.

        Rates are those seen from that frame; nothing of perfect bearings.
        """
        if not (self._lean_rad.any() or self._aside_m.any() or self._along_m.any()):
            return {}
        lean_rad = self._lean_rad[:, np.newaxis] * _towards(self._lean_rate * joint_rad + self._lean_bearing_rad)
        shift_m = self._aside_m[:, np.newaxis] * _towards(self._aside_rate * joint_rad + self._aside_bearing_rad)
        shift_m[..., 2] = self._along_m * np.sin(self._along_rate * joint_rad + self._along_bearing_rad)
        motion = moved(shift_m, lean_rad)
        return {index + 1: motion[:, index] for index in range(joint_rad.shape[1])}


def _towards(bearing_rad: Floats) -> Floats:
    """(row, n, 3) unit vectors across z."""
    return np.stack((np.cos(bearing_rad), np.sin(bearing_rad), np.zeros_like(bearing_rad)), axis=2)


BALANCE_STEPS = 3  # a force of 10 N and 1e-5 rad/Nm turn by 1e-4: what is left after three is below 1e-12
STEPS = 60
LARGEST_STEP_RAD = 0.5
DAMPING = 1e-6  # of squared lengths, m
ARRIVED_M = 1e-10


class TrueArm:
    """One arm; rows are moments: `shaft_rad` (row, n)."""

    def __init__(self, rig: HandRig, truth: HandTruth) -> None:
        n = len(truth.joint_zero_rad)
        self.lower_rad = np.array([joint.lower_rad for joint in rig.arm.joint])
        self.upper_rad = np.array([joint.upper_rad for joint in rig.arm.joint])
        self._arm = Arm(
            fixed=np.stack([moved(np.array(p.origin_m), np.array(p.rotation_rad)) for p in truth.parts]),
            zero_rad=np.array(truth.joint_zero_rad),
            lower_rad=self.lower_rad,
            upper_rad=self.upper_rad,
            mass_kg=np.zeros(n),
            com_m=np.zeros((n, 3)),
            tool_kg=0.0,
            tool_com_m=np.zeros(3),
            gravity_m_s2=np.zeros(3),
        )
        self._tool_m = np.array(truth.tool_point_m)
        self._bearings = Bearings(truth.axes, truth.runouts)
        self._eccentric_m = np.array([disc.eccentricity_m for disc in truth.discs])
        self._bearing_rad = np.array([disc.bearing_rad for disc in truth.discs])
        self._lines_rad = np.array([disc.graduation_rad for disc in truth.discs])
        self._yields_rad_n = rig.emulation.joint_compliance_rad_nm * rig.emulation.hand_force_n

    @property
    def n_joints(self) -> int:
        return len(self.lower_rad)

    def off_centre_rad(self, shaft_rad: Floats) -> Floats:
        """(row, n) what discs off their shafts add: exact, two points on a plane (defects/encoder.py)."""
        turn_rad = shaft_rad - self._bearing_rad
        aside_m = self._eccentric_m * np.sin(turn_rad)
        return -np.arctan2(aside_m, RADIUS_M + self._eccentric_m * np.cos(turn_rad))

    def graduation_rad(self, shaft_rad: Floats) -> Floats:
        """(row, n) what unevenly divided discs add, straight between groups of lines."""
        groups = self._lines_rad.shape[1]
        place = np.mod(shaft_rad, 2.0 * np.pi) / (2.0 * np.pi) * groups
        before = np.floor(place).astype(np.intp) % groups
        share, joint = place - np.floor(place), np.arange(self.n_joints)
        lines = self._lines_rad
        return (1.0 - share) * lines[joint, before] + share * lines[joint, (before + 1) % groups]

    def tip_m(self, shaft_rad: Floats) -> Floats:
        """(row, 3) middle of the probe's ball in the base."""
        return self._tip(self._frames(shaft_rad))

    def put(self, start_rad: Floats, wanted_m: Floats) -> Floats | None:
        """Shaft angles (n,) with the ball at `wanted_m` (3,), near `start_rad` (n,); None where it does not get there.

        Damped least squares with a limited step (Wampler, IEEE Trans. SMC 16, 1986).
        """
        shaft_rad = start_rad[np.newaxis].copy()
        for _ in range(STEPS):
            frames = self._frames(shaft_rad)
            here_m = self._tip(frames)
            miss_m = wanted_m - here_m[0]
            if np.abs(miss_m).max() < ARRIVED_M:
                return shaft_rad[0]
            slope = jacobian(frames, here_m)[0, :3]
            move_rad = slope.T @ np.linalg.solve(slope @ slope.T + DAMPING * np.eye(3), miss_m)
            shaft_rad[0] += move_rad * min(1.0, LARGEST_STEP_RAD / max(float(np.abs(move_rad).max()), 1e-300))
        return None

    def _tip(self, frames: Frames) -> Floats:
        return frames.flange[:, :3, :3] @ self._tool_m + frames.flange[:, :3, 3]

    def _frames(self, shaft_rad: Floats) -> Frames:
        joint_rad = shaft_rad + self._arm.zero_rad
        frames = forward(self._arm, joint_rad, links=self._bearings.motions(joint_rad))
        for _ in range(BALANCE_STEPS if self._yields_rad_n > 0.0 else 0):
            extra_rad = self._yielding_rad(frames)
            frames = forward(self._arm, joint_rad + extra_rad, links=self._bearings.motions(joint_rad + extra_rad))
        return frames

    def _yielding_rad(self, frames: Frames) -> Floats:
        """(row, n) under a push along the probe's own z."""
        levers_m = self._tip(frames)[:, np.newaxis] - frames.turning[:, :, :3, 3]
        push = np.broadcast_to(frames.flange[:, np.newaxis, :3, 2], levers_m.shape)
        moment = np.cross(levers_m, push)
        return self._yields_rad_n * np.einsum("rnk,rnk->rn", frames.turning[:, :, :3, 2], moment)
