"""The emulated world of a measuring arm that a person's hand moves: encoders see it, the side channel asks the hand.

    world = HandWorld.from_rig(plain_rig, seed=3)
    world.verbs["hand.put"](what="seat", id=1, posture_rad=[0.1, ...]); world.advance(2.0); world.link_encoders_rad()

What the hand does is worked out only when somebody looks: between two looks nothing depends on what came before.
`arrives_s`, `shaft_at_rad`, `tip_m`, `carry` and `truth` are taps for tests and benchmarks and go over no wire.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.errors import WorldError
from simulators.hand.hand_rig import HandRig, HandTruth, draw_hand_truth, read_hand_rig
from simulators.hand.held_arm import Ball, Hand, TrueArm

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
