"""Keeps the beam on the faces while the arm is still strange: find the light, land on the next pose, centre.

The arm's zeros are unknown by degrees, so a pose far from the last one may miss the faces. The navigator therefore
remembers every lit pose of a block with the fixture pose that is right *there*, jumps from the nearest one, and where a
jump loses the light goes part of the way and learns.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench
from acquisition.centring.aim import BeamTarget, between, flange_for, reach
from acquisition.centring.camera.board import Sight
from acquisition.centring.loop import Centring, Limits, centre
from acquisition.centring.search import OTHER_ROLLS_RAD, Aim, Aimed, Found, Search
from acquisition.centring.strategies import REGISTERED, CentringChoice, fixture_after
from acquisition.errors import NoLightError, SpotLostError, UnreachableError
from acquisition.session.records import Events, Learner

Floats = NDArray[np.float64]

LANDING_TRIES = 12  # on the way to a pose: halvings of the jump and stops to learn, together
GLANCE_S = 0.01  # enough to separate light from dark: 10 samples at 1 kHz
FINDING_STAND_OFF_M = 0.2
NEAR = Limits(tolerance_m=1.5e-3, max_steps=8)  # anywhere near the asked-for spots will do


@dataclass(frozen=True)
class LitPose:
    """A pose with light on both faces."""

    target: BeamTarget
    q_rad: Floats
    T_base_fixture: Floats  # as it must be assumed for the assumed arm to agree with the spots here


class Navigator:
    """Owns where the arm stands (as commanded), which way its joints last moved, and where this block had light."""

    def __init__(
        self,
        bench: Bench,
        learner: Learner,
        journal: Events,
        home_rad: Floats,
        seed: int,
        sight: Sight | None = None,
        centring: CentringChoice = REGISTERED,
    ) -> None:
        """`sight`: a camera that sees the fixture; without one, light is searched around the nominal rig's aim."""
        self._centring = centring
        self._bench, self._learner, self._journal, self._sight = bench, learner, journal, sight
        self._rng = np.random.default_rng(seed)
        self._lit: list[LitPose] = []
        self._placement = 0
        self.q_rad = home_rad
        self.approach = np.zeros(home_rad.size, dtype=np.int64)  # -1, 0, +1 by joint

    def move(self, q_rad: Floats) -> None:
        """Go there, and remember which way every joint moved."""
        self._bench.move(q_rad)
        self._note(q_rad)

    def find(self, placement: int, first: int, roll_rad: float) -> None:
        """Begin a block: aim by what is seen or known, else search, come near the centres.

        NoLightError; UnreachableError where the arm can stand before the faces in no roll.
        """
        self._placement = placement
        T = self._seen(self._learner.T_base_fixture(placement))
        target = BeamTarget(first, (0.0, 0.0, 0.0, 0.0), FINDING_STAND_OFF_M, roll_rad)
        try:
            self._stand_in_light(self._stand_before(target, T), T)
        except UnreachableError as why:
            raise UnreachableError(f"station {placement}, PSD {first} first: {why}") from why

    def find_near(self, placement: int, first: int, spots_m: tuple[float, float, float, float]) -> Floats:
        """Search the light around where the arm stands, bring it near these spots; joint readings (joint,) there.

        NoLightError where there is none.
        """
        self._placement = placement
        target, T = BeamTarget(first, spots_m, FINDING_STAND_OFF_M, 0.0), self._learner.T_base_fixture(placement)
        if self.dark(first):
            self._search(first, T)
        self._stand_in_light(target, T)
        return self.q_rad

    def dark(self, first: int) -> bool:
        """Whether a face, or both, have no light where the arm stands."""
        return not all(self._bench.look(GLANCE_S).lit(first))

    def centre_here(self, placement: int, target: BeamTarget, limits: Limits) -> Centring:
        """From where the arm stands: search the light if it is dark, then bring the spots to the target's.

        NoLightError where there is none; SpotLostError where it was lost and going back did not find it.
        """
        self._placement = placement
        T = self._lit[-1].T_base_fixture if self._lit else self._learner.T_base_fixture(placement)
        if self.dark(target.first):
            self._search(target.first, T)
        return self._centre(target, T, limits)

    def visit(self, target: BeamTarget, limits: Limits | None) -> Centring:
        """Land on the target and bring the spots there: within `limits`, or only near it.

        SpotLostError, UnreachableError: the arm is back at a lit pose. NoLightError: even that is dark now, and the
        search found nothing.
        """
        back = self._nearest(target)
        try:
            return self._centre(target, self._land(target), limits or NEAR)
        except (SpotLostError, UnreachableError):
            self.move(back.q_rad)
            if self.dark(target.first):  # the fixture was moved, or the laser is off
                self._stand_in_light(back.target, back.T_base_fixture)
            raise

    def _stand_before(self, target: BeamTarget, T: Floats) -> BeamTarget:
        """The target with the first roll, from its own on, in which the arm can stand so and come there."""
        refused: UnreachableError | None = None
        for other_rad in OTHER_ROLLS_RAD:
            rolled = replace(target, roll_rad=target.roll_rad + other_rad)
            try:
                self.move(self._reach(T, rolled, self.q_rad))
            except UnreachableError as why:  # no such posture, or the way there is not free
                refused = refused or why
                continue
            return rolled
        raise UnreachableError(f"none of {len(OTHER_ROLLS_RAD)} rolls will do, of which the first: {refused}")

    def _stand_in_light(self, target: BeamTarget, T: Floats) -> None:
        """Aim by camera or search if it is dark there, come near the centres, and forget older lit poses.

        NoLightError when nothing is found, or when it is lost at once: then no lit pose is left to go back to.
        """
        aimed, fixture = target, T
        if self.dark(target.first) and self._sight is not None:
            aimed, fixture = self._aim(self._sight, target, T)
        if self.dark(target.first):
            self._search(target.first, fixture)
        self._lit = []
        try:
            self._centre(aimed, fixture, NEAR)
        except SpotLostError as lost:
            raise NoLightError(
                f"station {self._placement}, PSD {target.first} first: light was found, but {lost}; "
                "check that the fixture stands still and that nothing crosses the beam"
            ) from lost

    def relearned(self) -> None:
        """The assumed rig was refitted: what was right at single poses before is now worse than the fit."""
        self._lit = [replace(pose, T_base_fixture=self._learner.T_base_fixture(self._placement)) for pose in self._lit]

    def _land(self, target: BeamTarget) -> Floats:
        """Reach light near the target; returns the fixture pose assumed there."""
        share = 1.0
        for _ in range(LANDING_TRIES):
            near = self._nearest(target)
            way = between(near.target, target, share)
            self.move(self._reach(near.T_base_fixture, way, near.q_rad))
            if not all(self._bench.look(GLANCE_S).lit(way.first)):
                share /= 2.0
                continue
            if share == 1.0:
                return near.T_base_fixture
            self._centre(way, near.T_base_fixture, NEAR)
            share = 1.0
        raise SpotLostError(f"no light on the way to roll {target.roll_rad:.2f} rad in {LANDING_TRIES} tries")

    def _centre(self, target: BeamTarget, T: Floats, limits: Limits) -> Centring:
        arm, optics = self._learner.arm, self._learner.optics
        strategy = self._centring.strategy(arm, optics, T, target.first, known=bool(self._lit))
        run = centre(self._bench, arm, strategy, self.q_rad, np.array(target.spots_m), limits)
        for step in run.trace[1:]:
            self._note(step.q_rad)
        self._journal.event("centring", _centring_record(run, self._placement, target, limits))
        if not all(run.look.lit(target.first)):
            raise SpotLostError(f"the light was lost while centring: {run.status.value}")
        here = fixture_after(run, strategy, arm, optics, T, target.first)
        self._lit.append(LitPose(target, self.q_rad, here))
        return run

    def _seen(self, T: Floats) -> Floats:
        """The fixture as the camera sees it from here; as assumed where it does not, or where there is none."""
        seen = None if self._sight is None else self._sight.fixture(self._learner.arm, self.q_rad, T)
        return T if seen is None else seen

    def _aim(self, sight: Sight, target: BeamTarget, T: Floats) -> tuple[BeamTarget, Floats]:
        """By camera, from where the arm stands; the target with the roll it could have, and the fixture as seen."""
        aim = Aim(self._bench, sight, self._learner.arm, self._learner.optics).run(target, self.q_rad, T, self._rng)
        self._note(aim.q_rad)
        self._journal.event("aim", {"aimed": aim.aimed.name, "motions": aim.motions})
        return (target, T) if aim.aimed is Aimed.UNSEEN else (aim.target, aim.T_base_fixture)

    def _search(self, first: int, T: Floats) -> None:
        result = Search(self._bench, self._learner.arm, self._learner.optics, T, first).run(self.q_rad)
        self._note(result.q_rad)
        self._journal.event("search", {"found": result.found.name, "motions": result.motions})
        if result.found is not Found.BOTH:
            raise NoLightError(
                f"station {self._placement}, PSD {first} first: {result.found.value} ({result.motions} positions "
                "tried); "
                "check that the laser is on and that the fixture stands as in the rig file, to a few centimetres "
                "and degrees"
            )

    def _nearest(self, target: BeamTarget) -> LitPose:
        return min(self._lit, key=lambda pose: abs(pose.target.roll_rad - target.roll_rad))

    def _reach(self, T: Floats, target: BeamTarget, near_rad: Floats) -> Floats:
        arm = self._learner.arm
        return reach(arm, flange_for(arm, self._learner.optics, T, target), near_rad, self._rng)

    def _note(self, q_rad: Floats) -> None:
        moved = q_rad - self.q_rad
        self.approach = np.where(np.abs(moved) > 1e-7, np.sign(moved).astype(np.int64), self.approach)
        self.q_rad = q_rad


def _centring_record(run: Centring, placement: int, target: BeamTarget, limits: Limits) -> dict[str, object]:
    return {
        "placement": placement,
        "first_psd": target.first,
        "strategy": run.strategy,
        "status": run.status.name,
        "tolerance_m": limits.tolerance_m,
        "target_m": list(target.spots_m),
        "spots_m": [step.spots_m.tolist() for step in run.trace],
        "purpose": [step.purpose for step in run.trace],
    }
