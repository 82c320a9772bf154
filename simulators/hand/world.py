"""The emulated world of a measuring arm that a person's hand moves: encoders see it, the side channel asks the hand.

    world = HandWorld.from_rig(plain_rig, seed=3)
    world.verbs["hand.put"](what="seat", id=1, posture_rad=[0.1, ...]); world.advance(2.0); world.link_encoders_rad()

What the hand does is worked out only when somebody looks: between two looks nothing depends on what came before.
`arrives_s`, `shaft_at_rad`, `tip_m`, `carry` and `truth` are taps for tests and benchmarks and go over no wire.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simulators.arm.kinematics import reach_point
from simulators.errors import WorldError
from simulators.hand.hand_rig import HandRig, HandTruth, draw_hand_truth, read_hand_rig
from simulators.hand.held_arm import Ball, CannotReachError, Hand, TrueArm
from simulators.world.rig import read_rig
from simulators.world.truth import Truth, arm_of

Floats = NDArray[np.float64]


class HandWorld:
    """Arm, hand and artefacts."""

    def __init__(self, rig: HandRig, truth: HandTruth) -> None:
        hand_seed, noise_seed = np.random.SeedSequence([truth.seed, 7]).spawn(2)
        self.truth = truth
        self.arm = TrueArm(rig, truth)
        self._hand = Hand(self.arm, rig.emulation, np.random.default_rng(hand_seed))
        self._noise = np.random.default_rng(noise_seed)
        self._touching_m = {s.id: 0.5 * (s.diameter_m + rig.tool.probe_diameter_m) for s in rig.sphere}
        self._time_s = 0.0
        self._seen: tuple[float, Floats] | None = None

    @classmethod
    def from_rig(cls, rig: Mapping[str, Any], *, seed: int | None = None) -> "HandWorld":
        """The world of a rig as `tomllib` gives it; `seed` goes before the one in [emulation]. WorldError if bad."""
        checked = read_hand_rig(rig)
        return cls(checked, draw_hand_truth(checked, checked.emulation.seed if seed is None else seed))

    @property
    def time_s(self) -> float:
        """Emulated seconds since power-on."""
        return self._time_s

    def advance(self, until_s: float) -> None:
        """Time goes on."""
        self._time_s = max(self._time_s, until_s)

    def link_encoders_rad(self) -> Floats:
        """(n,) what the heads see of their discs now: not quantised, which is the encoder's own business."""
        if self._seen is None or self._seen[0] != self._time_s:
            self._seen = (self._time_s, self.read_rad(self._hand.shaft_rad(self._time_s)[np.newaxis])[0])
        return self._seen[1]

    def read_rad(self, shaft_rad: Floats) -> Floats:
        """(row, n) readings of shafts at these angles, with the noise of one reading."""
        noise_rad = self.truth.encoder_noise_rad * self._noise.standard_normal(shaft_rad.shape)
        return (
            shaft_rad + self.arm.discs.off_centre_rad(shaft_rad) + self.arm.discs.graduation_rad(shaft_rad) + noise_rad
        )

    @property
    def verbs(self) -> Mapping[str, Callable[..., Any]]:
        """What the side channel may ask the hand for."""
        return {"hand.put": self.put}

    def put(
        self,
        what: str,
        id: int,  # noqa: A002 - the verb's argument is called id
        posture_rad: Sequence[float],
        end: str | None = None,
        direction: Sequence[float] | None = None,
    ) -> None:
        """The hand begins to carry the probe: into a "seat", onto `end` a or b of the "bar" in position `id`, against a
        "sphere" from the side of `direction`. WorldError for what is not there, CannotReachError.
        """
        ball = Ball(self._middle_m(id)) if what == "sphere" else None
        self.carry(self._point_m(what, id, end, direction), posture_rad, ball)

    def carry(self, point_m: Floats, posture_rad: Sequence[float] | Floats, ball: Ball | None = None) -> None:
        """The hand begins to carry the probe to a point (3,) of its own: a tap, for there is nothing to feel there."""
        posture = np.asarray(posture_rad, dtype=np.float64)
        if posture.shape != (self.arm.n_joints,) or not np.isfinite(posture).all():
            raise WorldError(f"posture {list(posture_rad)} rad; the arm has {self.arm.n_joints} joints")
        self._hand.put(point_m, posture, self._time_s, ball)

    @property
    def arrives_s(self) -> float:
        """When the hand has done what it was last asked for."""
        return self._hand.arrives_s

    def shaft_at_rad(self, time_s: float) -> Floats:
        """(n,) at a time since the hand was last asked."""
        return self._hand.shaft_rad(time_s)

    def tip_m(self) -> Floats:
        """(3,) where the probe's ball truly is now."""
        return self.arm.tip_m(self.shaft_at_rad(self._time_s)[np.newaxis])[0]

    def _middle_m(self, sphere: int) -> Floats:
        return np.array(_named("sphere", sphere, {s.id: s.origin_m for s in self.truth.spheres}))

    def _point_m(self, what: str, number: int, end: str | None, direction: Sequence[float] | None) -> Floats:
        if what == "seat":
            return np.array(_named("seat", number, {s.id: s.origin_m for s in self.truth.seats}))
        if what == "bar" and end in ("a", "b"):
            return np.array(
                _named("bar position", number, {b.id: (b.a_m, b.b_m) for b in self.truth.bars})["ab".index(end)]
            )
        if what == "sphere" and direction is not None and any(direction):
            outward = np.asarray(direction, dtype=np.float64)
            return self._middle_m(number) + self._touching_m[number] * outward / np.linalg.norm(outward)
        raise WorldError(
            f"hand: {what!r} with end {end!r} and direction {direction!r}; ask for a seat, for end a or b of a bar, or "
            "for a sphere with a direction"
        )


def _named(what: str, number: int, known: Mapping[int, Any]) -> Any:
    if number not in known:
        raise WorldError(f"hand: no {what} {number!r}; there are {', '.join(map(str, known)) or 'none'}")
    return known[number]


GUIDED_RAD_S, GUIDED_RAD_S2 = 1.5, 3.0  # of an arm that is led by hand


class Guidable(Protocol):
    """The controller's part of it."""

    def within_limits(self, q_rad: ArrayLike) -> bool: ...
    def move_joints(self, q_rad: ArrayLike, speed_rad_s: float, acceleration_rad_s2: float) -> None: ...


class GuidedRobot:
    """A person who guides a robot until the ball at its flange rests at a point of the base: verb "robot.guide".

    The person feels the socket: the true arm closes on it, whatever its controller takes for its angles. Does not
    imitate: forces at the socket, an arm that gives way (the true geometry closes, hidden mechanisms do not), obstacles
    on the way, a controller that refuses because freedrive is off: the person may jog as well.
    """

    def __init__(self, rig: Mapping[str, Any], truth: Truth, controller: Guidable) -> None:
        """`rig` as `tomllib` gives it; what scatters does so by the seed of the truth."""
        self._controller, self._target_m = controller, np.array(truth.target_m)
        self._arm = arm_of(read_rig(rig), truth)
        self._rng = np.random.default_rng(np.random.SeedSequence([truth.seed, 11]))

    def guide(self, point_m: Sequence[float], posture_rad: Sequence[float], contact_m: float = 0.0) -> None:
        """Begins to bring the ball to `point_m` (3,) in a posture near `posture_rad` (n,), both finite.

        `contact_m`: one sigma of each coordinate by which the ball rests beside it. WorldError for other numbers,
        CannotReachError where no posture near it reaches, MoveRefused where the controller holds the arm.
        """
        wanted_m, start_rad = np.asarray(point_m, dtype=np.float64), np.asarray(posture_rad, dtype=np.float64)
        if wanted_m.shape != (3,) or start_rad.shape != (self._arm.n_joints,):
            raise WorldError(f"guide to {point_m!r} m, posture {posture_rad!r} rad: 3 and {self._arm.n_joints} numbers")
        wanted_m = wanted_m + contact_m * self._rng.standard_normal(3)
        joint_rad, arrived = reach_point(
            self._arm, self._target_m, wanted_m[np.newaxis], (start_rad + self._arm.zero_rad)[np.newaxis]
        )
        reading_rad = joint_rad[0] - self._arm.zero_rad
        if not (arrived[0] and self._controller.within_limits(reading_rad)):
            raise CannotReachError(
                f"the hand cannot put the probe at {np.round(wanted_m, 3).tolist()} m near that posture; "
                "ask for another"
            )
        self._controller.move_joints(reading_rad, GUIDED_RAD_S, GUIDED_RAD_S2)
