"""The true arm under a hand, mechanism by mechanism, and the hand that carries its probe.

Shaft angles are the unknowns: encoders read shafts; a joint's true angle is its shaft's, its zero, and what the hand's
force turns it beyond (the structure between disc and link gives way: compliance times axis . (lever x force)). While a
joint turns, its axis leans, runs out sideways, and goes up and down. Seen from the housing the axis leans, or stands
aside, towards (cos(k q + b), sin(k q + b)): lobes of a race that come back k times a turn (Bryan, Clouser and Holland,
"Spindle accuracy", American Machinist 1967: tilt, radial and axial error motion). k = 1 would turn with the joint, k =
0 stand still: both are geometry. Axially every k counts, for nothing of a link goes to and fro with an angle.

The hand's motion between two stations is a straight line in the joints with the speed profile of a reaching arm
(minimum jerk: Flash, Hogan, J. Neuroscience 5, 1985). A held hand trembles at 8 to 12 Hz (physiological tremor) and
sways below 1 Hz; held in a cone the ball stays and the joints go round it. Once in a while the ball sits on the rim, or
slips off it while it is being read; on a sphere it slides aside, but stays on the surface.

Does not imitate: weight (measuring arms are balanced), bending tubes, heat, what does not come back with the angle
(rolling elements, dirt, play), a person who takes the wrong cone or forgets the request.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Arm, Frames, forward, jacobian, moved
from simulators.encoders.discs import Discs
from simulators.hand.hand_rig import HandEmulation, HandRig, HandTruth, TrueAxis, TrueRunout

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
        self.discs = Discs(truth.discs)
        self._yields_rad_n = rig.emulation.joint_compliance_rad_nm * rig.emulation.hand_force_n

    @property
    def n_joints(self) -> int:
        return len(self.lower_rad)

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


SPEED_RAD_S = 1.5  # of the joint that goes farthest, at its quickest
SHORTEST_S = 0.4
MINIMUM_JERK_PEAK = 1.875  # quickest over mean speed of the profile 10 s^3 - 15 s^4 + 6 s^5
TREMOR_HZ = (8.0, 12.0)
SWAY_HZ = (0.2, 0.8)
SWAY = 4.0  # times the tremor: a hand sways more slowly and farther than it trembles
IMPRECISE_RAD = 0.08  # how well a person copies a posture that a picture shows
POSTURES = 30  # tries of one near the wanted, until the ball gets there
FARTHER = 0.15  # rad more scatter with each try
RIM_M = (2e-4, 1e-3)  # a ball on the rim is off by so much
SLIPS_AFTER_S = (0.1, 0.8)  # of being put there
WAVES = 3  # of tremor and of sway for each joint


class CannotReachError(ValueError):
    """The arm has no posture with the probe there."""


@dataclass(frozen=True, eq=False)
class Ball:
    """A sphere that the probe is held against from outside."""

    middle_m: Floats  # (3,)

    def touched_m(self, place_m: Floats, point_m: Floats) -> Floats:
        """`place_m` as far from the middle as `point_m` is: what slides stays on the surface."""
        outward = place_m - self.middle_m
        return self.middle_m + outward * np.linalg.norm(point_m - self.middle_m) / np.linalg.norm(outward)


@dataclass(frozen=True, eq=False)
class Held:
    """Where the ball is held, and since when."""

    shaft_rad: Floats  # (n,) of the posture that is held
    point_m: Floats  # (3,) of the ball, when it sits well
    askew_m: Floats  # (3,) off by so much
    slips_at_s: float  # from then on it sits well; never: infinity
    ball: "Ball | None"

    def place_m(self, now_s: float) -> Floats:
        """(3,) of the ball."""
        place_m = self.point_m if now_s >= self.slips_at_s else self.point_m + self.askew_m
        return place_m if self.ball is None else self.ball.touched_m(place_m, self.point_m)


@dataclass(frozen=True, eq=False)
class _Reach:
    """One motion."""

    from_rad: Floats
    start_s: float
    end_s: float


class Hand:
    """Owns where the arm is. All times are those of the world."""

    def __init__(self, arm: TrueArm, emulation: HandEmulation, rng: np.random.Generator) -> None:
        self._arm, self._like, self._rng = arm, emulation, rng
        rest_rad = np.clip(np.zeros(arm.n_joints), arm.lower_rad, arm.upper_rad)
        self._held = Held(rest_rad, arm.tip_m(rest_rad[np.newaxis])[0], np.zeros(3), np.inf, None)
        self._reach = _Reach(rest_rad, 0.0, 0.0)
        n = arm.n_joints
        self._rate_rad_s = (
            2.0 * np.pi * np.concatenate((rng.uniform(*TREMOR_HZ, (WAVES, n)), rng.uniform(*SWAY_HZ, (WAVES, n))))
        )
        self._phase_rad = rng.uniform(-np.pi, np.pi, (2 * WAVES, n))
        sizes = np.repeat([1.0, SWAY], WAVES)[:, np.newaxis]
        self._size_rad = emulation.tremor_rad * np.sqrt(2.0 / WAVES) * sizes * np.ones((1, n))

    def put(self, wanted_m: Floats, posture_rad: Floats, now_s: float, ball: Ball | None = None) -> None:
        """Begins to carry the probe to `wanted_m` (3,), in a posture near `posture_rad` (n,). CannotReachError."""
        from_rad = self.shaft_rad(now_s)
        goal_rad = self._posture(wanted_m, posture_rad)
        way_rad = float(np.abs(goal_rad - from_rad).max())
        end_s = now_s + max(SHORTEST_S, MINIMUM_JERK_PEAK * way_rad / SPEED_RAD_S)
        self._reach = _Reach(from_rad, now_s, end_s)
        contact_m = self._like.contact_m * self._rng.standard_normal(3)
        askew_m, slips_at_s = self._askew(end_s)
        self._held = Held(goal_rad, wanted_m + contact_m, askew_m, slips_at_s, ball)

    @property
    def arrives_s(self) -> float:
        """When the probe is, or was, where it was last asked to."""
        return self._reach.end_s

    def shaft_rad(self, now_s: float) -> Floats:
        """(n,) the shafts."""
        trembling_rad = self._trembling_rad(now_s)
        if now_s < self._reach.end_s:
            share = (now_s - self._reach.start_s) / (self._reach.end_s - self._reach.start_s)
            done = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
            return self._reach.from_rad + done * (self._held.shaft_rad - self._reach.from_rad) + trembling_rad
        seated = self._arm.put(self._held.shaft_rad + trembling_rad, self._held.place_m(now_s))
        return self._held.shaft_rad + trembling_rad if seated is None else seated

    def _posture(self, wanted_m: Floats, posture_rad: Floats) -> Floats:
        for attempt in range(POSTURES):
            scatter_rad = IMPRECISE_RAD + FARTHER * attempt / 2.0
            start_rad = posture_rad + scatter_rad * self._rng.standard_normal(self._arm.n_joints)
            found = self._arm.put(start_rad, wanted_m)
            if found is not None and np.all((found > self._arm.lower_rad) & (found < self._arm.upper_rad)):
                return found
        raise CannotReachError(
            f"the hand cannot put the probe at {np.round(wanted_m, 3).tolist()} m near that posture; ask for another"
        )

    def _askew(self, end_s: float) -> tuple[Floats, float]:
        """How far off the ball sits, and when it slips into place; half of those on the rim stay there."""
        chance, stays = self._rng.random(), self._rng.random() < 0.5
        off_m, after_s = self._rng.uniform(*RIM_M), self._rng.uniform(*SLIPS_AFTER_S)
        way = self._rng.standard_normal(3)
        if chance >= self._like.slip_share:
            return np.zeros(3), np.inf
        return off_m * way / np.linalg.norm(way), np.inf if stays else end_s + after_s

    def _trembling_rad(self, now_s: float) -> Floats:
        """(n,) a function of time alone, so that it does not matter who looks when."""
        return np.sum(self._size_rad * np.sin(self._rate_rad_s * now_s + self._phase_rad), axis=0)
