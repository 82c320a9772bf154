"""Law (8) with the fixture pose corrected from every reading: the strategy of sessions unless another is chosen.

Two spots fix the whole incoming beam in the fixture's frame: point on the first face, and direction by mirroring. The
same beam is known in the base frame from the joints. One reading therefore leaves only two of the fixture's six
freedoms open, the turn about the beam and the slide along it; any second reading closes those. So a guess that is wrong
by 80 deg is worth a usable Jacobian after one motion. Errors of the arm itself fall out, because only differences
between nearby poses enter. Derived in docs/decisions/0002.

The servo law of the source with a fixed guess of the fixture pose.
    q' = k [Jp Ad(T) Jr]^+ (yd - yp)        Deng, Ding, Zhang, Food & Machinery 2019(3), equation (8)

The sensor Jacobian Jp is taken at the beam that the measured spots imply, so that only the robot's motion is turned
by the guess T, not the place where the sensor is linearised.

How well the joints can still steer the beam's line, and the roll about the beam that brings a lost grip back.

Near a singular posture of the wrist a step towards the centres turns joints far and hardly moves the spots, and leads
deeper into it. Spots fix the line only: the arm may roll about it. Rolled towards the better grip, joint speeds along
the gradient within the null space, it can steer again. Source: A. Liegeois, IEEE Trans. SMC 7 (1977) 868, gradient
projection; T. Yoshikawa, Int. J. Robotics Research 4 (1985) 3, the measure.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from acquisition.centring.aim import AssumedArm, FixtureOptics, beam_by_joints, in_fixture, spots_at
from acquisition.centring.loop import Proposal

Floats = NDArray[np.float64]

# Least singular value, rad a rad: of 700 random postures 1 in 100 has less. Of 700 runs the one that lost the light for
# good had been to 0.05, the next worst (14 motions) to 0.09.
LEAST_GRIP = 0.2
LEVER_M = 0.1  # makes offsets of the line and its tilts comparable: about the distance between the two faces
ROLLED_RAD = 0.2  # largest joint step of one roll: zeros off by 2 deg then shift the spots by up to 3 mm
INNER_RAD = 0.02
DIFFERENCE_RAD = 1e-4


def grip(arm: AssumedArm, q_rad: Floats, stand_off_m: float) -> float:
    """Least singular value of d(line)/dq: offset (by LEVER_M) and tilt of the beam where it meets the first face."""
    return float(np.linalg.svd(_line_jacobian(arm, q_rad, stand_off_m), compute_uv=False)[-1])


def rolled(arm: AssumedArm, q_rad: Floats, stand_off_m: float) -> Floats:
    """A joint step (joint,) that rolls about the assumed beam towards the better grip, until that is twice enough."""
    begin_rad, (origin_m, direction) = q_rad, arm.beam(q_rad)
    while grip(arm, q_rad, stand_off_m) < 2.0 * LEAST_GRIP:
        held = _held(arm, q_rad, stand_off_m)
        back = np.linalg.pinv(held)
        uphill = _gradient(arm, q_rad, stand_off_m)
        uphill = uphill - back @ (held @ uphill)
        largest = float(np.max(np.abs(uphill)))
        if largest < DIFFERENCE_RAD:  # the best there is
            break
        now_m, along = arm.beam(q_rad)
        across = _across(along)
        shift_m = origin_m - now_m
        off = np.concatenate(
            [
                across @ (shift_m + stand_off_m * (direction - along)) / LEVER_M,
                across @ (direction - along),
                [along @ shift_m / LEVER_M],
            ]
        )
        stepped = q_rad + INNER_RAD / largest * uphill + back @ off
        if float(np.max(np.abs(stepped - begin_rad))) > ROLLED_RAD:
            break
        if np.any(stepped < arm.lower_rad) or np.any(stepped > arm.upper_rad):
            break
        if grip(arm, stepped, stand_off_m) <= grip(arm, q_rad, stand_off_m):
            break
        q_rad = stepped
    return q_rad - begin_rad


def _line_jacobian(arm: AssumedArm, q_rad: Floats, stand_off_m: float) -> Floats:
    """(4, joint)."""
    across, J = _across(arm.beam(q_rad)[1]), arm.beam_jacobian(q_rad)
    return np.vstack([across @ (J[:3] + stand_off_m * J[3:]) / LEVER_M, across @ J[3:]])


def _held(arm: AssumedArm, q_rad: Floats, stand_off_m: float) -> Floats:
    """(5, joint): the line, and the laser's place along it; the roll alone is free."""
    along = arm.beam(q_rad)[1] @ arm.beam_jacobian(q_rad)[:3] / LEVER_M
    return np.vstack([_line_jacobian(arm, q_rad, stand_off_m), along])


def _gradient(arm: AssumedArm, q_rad: Floats, stand_off_m: float) -> Floats:
    here = grip(arm, q_rad, stand_off_m)
    steps = DIFFERENCE_RAD * np.eye(q_rad.size)
    return np.array([grip(arm, q_rad + step, stand_off_m) - here for step in steps]) / DIFFERENCE_RAD


def _across(direction: Floats) -> Floats:
    """(2, 3): axes square to a direction."""
    return np.asarray(np.linalg.svd(direction[None])[2][1:], dtype=np.float64)


# The first step is taken with a turn about the beam that may be wrong by most of a right angle: shortened so that it
# teaches without leaving the face.
FIRST_GAIN = 0.6
TURN_PRIOR_RAD = 0.7  # how wrong the guess may be about the beam, one sigma
SLIDE_PRIOR_M = 0.05  # and along it
SPOT_SIGMA_M = 3e-5  # floor of the trust in a prediction between poses
ARM_ERROR_SHARE = 0.05  # predicted motion is wrong by this share (2 deg of joint zero: 3.5 %)

# The laser can stand neither inside the fixture nor further away than a small arm reaches.
STAND_OFF_RANGE_M = (0.02, 1.0)


class Registered:
    """Re-estimates T_base_fixture from all readings of the run, then steps by law (8) with gain 1."""

    name = "registered"

    def __init__(
        self,
        arm: AssumedArm,
        optics: FixtureOptics,
        T_base_fixture: Floats,
        first: int,
        first_gain: float = FIRST_GAIN,
    ) -> None:
        """`first_gain` is 1 for a fixture pose that earlier poses have given: then the first step is a whole one."""
        self._arm, self._optics, self._first, self._first_gain = arm, optics, first, first_gain
        self.T_base_fixture = T_base_fixture
        self._q_rad: list[Floats] = []
        self._spots_m: list[Floats] = []

    def learn(self, q_rad: Floats, spots_m: Floats) -> None:
        self._q_rad.append(q_rad)
        self._spots_m.append(spots_m)
        self.T_base_fixture = self._onto_beam(self.T_base_fixture, q_rad, spots_m)
        if len(self._q_rad) > 1:
            self.T_base_fixture = self._turn_and_slide(self.T_base_fixture)

    def propose(self, target_m: Floats) -> Proposal:
        q_rad, spots_m, T = self._q_rad[-1], self._spots_m[-1], self.T_base_fixture
        given = (self._arm, self._optics, T, q_rad, target_m - spots_m, spots_m, self._first)
        gain = 1.0 if len(self._q_rad) > 1 else self._first_gain
        step = gain * correction(*given)
        stand_off_m = stand_off(self._arm, self._optics, T, q_rad, spots_m, self._first)
        shortened = step * min(1.0, ROLLED_RAD / float(np.max(np.abs(step))))
        if grip(self._arm, q_rad + shortened, stand_off_m) < LEAST_GRIP:
            roll = rolled(self._arm, q_rad, stand_off_m)
            if float(np.max(np.abs(roll))) > 0.0:
                return Proposal(roll + gain * correction(*given, rank=3), "roll", promise=0.0)
        return Proposal(step, "correct", promise=gain)

    def _onto_beam(self, T_guess: Floats, q_rad: Floats, spots_m: Floats) -> Floats:
        """The guess, turned and shifted as little as possible so that the measured beam lies on the assumed one."""
        hit_m, direction = self._optics.line(spots_m, self._first)
        origin_base_m, direction_base = self._arm.beam(q_rad)
        turned = Rotation.align_vectors(direction_base[None], (T_guess[:3, :3] @ direction)[None])[0]
        R = turned.as_matrix() @ T_guess[:3, :3]
        guessed_hit_m = T_guess[:3, :3] @ hit_m + T_guess[:3, 3]
        stand_off_m = float(np.clip((guessed_hit_m - origin_base_m) @ direction_base, *STAND_OFF_RANGE_M))
        T = np.eye(4)
        T[:3, :3] = R
        T[:3, 3] = origin_base_m + stand_off_m * direction_base - R @ hit_m
        return T

    def _turn_and_slide(self, T_on_beam: Floats) -> Floats:
        """Turn about the current beam and slide along it until the earlier readings are explained best."""
        hit_m, _ = self._optics.line(self._spots_m[-1], self._first)
        hit_base_m = T_on_beam[:3, :3] @ hit_m + T_on_beam[:3, 3]
        _, axis = self._arm.beam(self._q_rad[-1])

        def moved(x: Floats) -> Floats:
            R = Rotation.from_rotvec(axis * x[0]).as_matrix()
            T = np.eye(4)
            T[:3, :3] = R @ T_on_beam[:3, :3]
            T[:3, 3] = R @ (T_on_beam[:3, 3] - hit_base_m) + hit_base_m + x[1] * axis
            return T

        def residual(x: Floats) -> Floats:
            T = moved(x)
            rows = [np.array([x[0] / TURN_PRIOR_RAD, x[1] / SLIDE_PRIOR_M])]
            for q_rad, spots_m in zip(self._q_rad[:-1], self._spots_m[:-1], strict=True):
                sigma_m = SPOT_SIGMA_M + ARM_ERROR_SHARE * float(np.linalg.norm(spots_m - self._spots_m[-1]))
                rows.append((spots_at(self._arm, self._optics, T, q_rad, self._first) - spots_m) / sigma_m)
            return np.concatenate(rows)

        # The cost has a second valley on the far side of the turn; three starts cover the circle.
        starts = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0]] if len(self._q_rad) == 2 else [[0.0, 0.0]]
        found = [least_squares(residual, start, x_scale=(0.1, 0.01)) for start in starts]
        best = int(np.argmin([solution.cost for solution in found]))
        return moved(found[best].x)


def correction(
    arm: AssumedArm,
    optics: FixtureOptics,
    T_base_fixture: Floats,
    q_rad: Floats,
    error_m: Floats,
    spots_m: Floats,
    first: int,
    rank: int = 4,
) -> Floats:
    """The joint step (joint,) that removes the spot error (4,) m by law (8) with gain 1.

    Of a lower `rank` it leaves out what the arm can do least.
    """
    hit_m, direction = optics.line(spots_m, first)
    stand_off_m = stand_off(arm, optics, T_base_fixture, q_rad, spots_m, first)
    sensor = optics.spots_by_beam(hit_m - stand_off_m * direction, direction, first)
    left, sizes, right = np.linalg.svd(sensor @ beam_by_joints(arm, T_base_fixture, q_rad), full_matrices=False)
    return right[:rank].T @ ((left[:, :rank].T @ error_m) / sizes[:rank])


def stand_off(
    arm: AssumedArm, optics: FixtureOptics, T_base_fixture: Floats, q_rad: Floats, spots_m: Floats, first: int
) -> float:
    """From the laser to the first face along the beam (m), as assumed, within what can be."""
    hit_m, direction = optics.line(spots_m, first)
    origin_m, _ = in_fixture(T_base_fixture, *arm.beam(q_rad))
    return float(np.clip((hit_m - origin_m) @ direction, *STAND_OFF_RANGE_M))


class FixedGuess:
    """Law (8): the guess of the fixture pose stays as it was given."""

    name = "law8"

    def __init__(
        self, arm: AssumedArm, optics: FixtureOptics, T_base_fixture: Floats, first: int, gain: float = 0.5
    ) -> None:
        self._arm, self._optics, self._T, self._first, self._gain = arm, optics, T_base_fixture, first, gain
        self._q_rad = np.empty(0)
        self._spots_m = np.empty(0)

    def learn(self, q_rad: Floats, spots_m: Floats) -> None:
        self._q_rad, self._spots_m = q_rad, spots_m

    def propose(self, target_m: Floats) -> Proposal:
        error_m = target_m - self._spots_m
        full = correction(self._arm, self._optics, self._T, self._q_rad, error_m, self._spots_m, self._first)
        return Proposal(self._gain * full, "correct", promise=self._gain)
