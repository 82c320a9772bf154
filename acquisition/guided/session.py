"""A guided session: asks for one posture after the other, takes a reading when the probe is still, rejects slips.

Whether a still probe adds anything new: a cone in another posture, a sphere at another spot, no plane of spots.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.plan import GuidedVisit, readings_of
from acquisition.guided.reading import (
    Cone,
    Contact,
    Coverage,
    Guide,
    GuidedProgress,
    Judge,
    Reading,
    Request,
    SphereSpot,
    Target,
)
from acquisition.guided.stillness import ArmMotion, EncoderWatch, GuidedArm, StillRule, Window

Floats = NDArray[np.float64]
ATTEMPTS = 4  # at one reading; then it is left out, or taken where only its place is uncertain
CANDIDATES = 48  # postures to choose from
NEAR_M = 0.05  # of the place in the rig file: cones stand about there, and the arm is not calibrated
ANEW_RAD = 3e-3  # a standstill is another one when some joint has moved so far since the last reading
LEARN_ALWAYS_UNTIL, LEARN_EVERY = 30, 5  # readings: later ones change little
TELL_S = 0.2  # of the encoders' time
OTHER_RAD = 0.1  # of some joint: nearer postures have the same errors of the arm and show the encoders' scatter only
APART_M = 2e-3  # of two spots of a series: the nearest of 25 that are evenly over half a ball of 31 mm are 4.4 mm apart
FLAT_M = 3e-4  # rms about the plane of all spots: of the first five of those 25 it is 0.85 mm
FLAT_FROM = 5  # spots: with fewer a plane means nothing yet


class GuidedJournal(Protocol):
    """Where readings and events go."""

    def readings(self, readings: Sequence[Reading]) -> None: ...

    def event(self, kind: str, detail: dict[str, Any]) -> None: ...


@dataclass(frozen=True)
class GuidedSummary:
    """What a guided session brought."""

    readings: tuple[Reading, ...]
    slips: int  # readings that were rejected
    doubted: int  # taken though they stayed uncertain: the identification decides
    skipped: int  # visits without a reading


@dataclass
class GuidedSession:
    """Runs a plan; the only owner of what was taken. `patience_s`: of the encoders' time, before it asks again."""

    watch: EncoderWatch
    arm: GuidedArm
    guide: Guide
    judge: Judge
    journal: GuidedJournal
    rng: np.random.Generator
    rule: StillRule = field(default_factory=StillRule)
    patience_s: float = np.inf
    _taken: list[Reading] = field(default_factory=list[Reading], init=False)
    _anchors: dict[tuple[int, int], Floats] = field(default_factory=dict[tuple[int, int], Floats], init=False)
    _start_s: float | None = field(default=None, init=False)
    _last_rad: Floats | None = field(default=None, init=False)
    _planned: int = field(default=0, init=False)
    _counts: dict[str, int] = field(default_factory=lambda: {"slips": 0, "doubted": 0, "skipped": 0}, init=False)

    def __post_init__(self) -> None:
        self.coverage = Coverage(self.arm.lower_rad, self.arm.upper_rad)

    @property
    def taken(self) -> int:
        """Readings so far, also after the session was cut short."""
        return len(self._taken)

    def run(self, plan: Sequence[GuidedVisit]) -> GuidedSummary:
        """Take every visit. DeviceError, RecordingError end it; what was taken is recorded by then."""
        self._planned = readings_of(tuple(plan))
        for visit in plan:
            self._take(visit)
        return GuidedSummary(tuple(self._taken), **self._counts)

    def _take(self, visit: GuidedVisit) -> None:
        """All readings of a visit, again while they are uncertain."""
        for attempt in range(1, ATTEMPTS + 1):
            readings = [
                reading for target in visit.targets if (reading := self._reading(target, visit, attempt)) is not None
            ]
            if len(readings) < len(visit.targets):
                continue
            off = self.judge.off_target(readings)
            if off is not None and attempt < ATTEMPTS:
                self._counts["slips"] += 1
                self.journal.event("slip", {"target": visit.says, "miss_m": off.miss_m, "sigmas": off.sigmas})
                continue
            if off is not None:
                self._counts["doubted"] += 1
                self.journal.event("doubted", {"target": visit.says, "miss_m": off.miss_m, "sigmas": off.sigmas})
            return self._keep(readings)
        self._counts["skipped"] += 1
        self.journal.event("skipped", {"target": visit.says, "why": f"no reading in {ATTEMPTS} attempts"})
        return None

    def _keep(self, readings: list[Reading]) -> None:
        self._taken += readings
        for reading in readings:
            self.coverage.add(reading.q_rad)
            if isinstance(reading.target, SphereSpot):
                self._anchors.setdefault((reading.target.id, reading.target.series), reading.q_rad)
        self.journal.readings(readings)
        if len(self._taken) <= LEARN_ALWAYS_UNTIL or len(self._taken) % LEARN_EVERY < len(readings):
            self.judge.learn(self._taken)

    def _reading(self, target: Target, visit: GuidedVisit, attempt: int) -> Reading | None:
        """One still stretch at the target; None when whoever moves the probe does not get there in time."""
        wanted_rad = self._posture(target) if visit.posture_rad is None else np.array(visit.posture_rad)
        request = Request(target, wanted_rad, attempt)
        if not self.guide.ask(request):
            return None
        asked_s: float | None = None
        told_s = -np.inf
        while True:
            window = self.watch.next(self.rule.dwell_s)
            now_s = float(window.t_s[-1])
            asked_s = now_s if asked_s is None else asked_s
            motion = self.rule.judge(self.arm, window)
            place = self._place(target, visit, window) if motion is ArmMotion.STILL else motion.value
            if place is None:
                return self._accepted(target, window)
            if now_s - told_s >= TELL_S:
                self._tell(request, place, window)
                told_s = now_s
            if now_s - asked_s > self.patience_s:
                return None

    def _place(self, target: Target, visit: GuidedVisit, window: Window) -> str | None:
        """What is wrong with a still probe's place; None: nothing. A plan of postures may ask for one twice."""
        mean_rad = window.last(self.rule.dwell_s).q_rad.mean(axis=0)
        if self._last_rad is not None and np.abs(mean_rad - self._last_rad).max() < ANEW_RAD:
            return "taken; go on to the next posture"
        away_m = float(np.linalg.norm(self.arm.tip_m(mean_rad[np.newaxis])[0] - np.array(target.point_m)))
        if away_m > NEAR_M:
            return f"still, but {1e3 * away_m:.0f} mm from {target.says}"
        return None if visit.posture_rad is not None else nothing_new(self.arm, target, mean_rad, self._taken)

    def _accepted(self, target: Target, window: Window) -> Reading:
        held = window.last(self.rule.dwell_s)
        mean_rad = held.q_rad.mean(axis=0)
        self._last_rad = mean_rad
        t_s = float(held.t_s.mean())
        self._start_s = t_s if self._start_s is None else self._start_s
        return Reading(target, mean_rad, t_s - self._start_s, float(held.host_s[-1]))

    def _posture(self, target: Target) -> Floats:
        """The best of some candidates; a sphere is touched in one posture as long as its series lasts."""
        point_m = np.array(target.point_m)
        if isinstance(target, SphereSpot) and (target.id, target.series) in self._anchors:
            anchor_rad = self._anchors[target.id, target.series][np.newaxis]
            near_rad = self.arm.postures(anchor_rad, point_m)
            return near_rad[0] if len(near_rad) else anchor_rad[0]
        starts_rad = self.rng.uniform(self.arm.lower_rad, self.arm.upper_rad, (CANDIDATES, len(self.arm.lower_rad)))
        candidates_rad = self.arm.postures(starts_rad, point_m)
        if not len(candidates_rad):
            return starts_rad[0]
        return self.coverage.best(candidates_rad, self._earlier(target))

    def _earlier(self, target: Target) -> list[Floats]:
        if isinstance(target, SphereSpot):
            return [q_rad for (sphere, _), q_rad in self._anchors.items() if sphere == target.id]
        return [reading.q_rad for reading in self._taken if reading.target == target]

    def _tell(self, request: Request, says: str, window: Window) -> None:
        self.guide.tell(
            GuidedProgress(
                len(self._taken),
                self._planned,
                says,
                window.q_rad[-1],
                request,
                self.coverage,
                self.judge.repeatability_m,
            )
        )


def nothing_new(arm: GuidedArm, target: Target, q_rad: Floats, taken: Sequence[Reading]) -> str | None:
    """What to do instead, for a person; None where a reading (n,) at the target adds something new."""
    if isinstance(target, Cone):
        return old_posture(q_rad, [one.q_rad for one in taken if one.target == target])
    if isinstance(target, SphereSpot):
        return _old_spot(arm, q_rad, [one.q_rad for one in taken if _of_series(one.target, target)])
    return None


def _of_series(other: Target | Contact, target: SphereSpot) -> bool:
    return isinstance(other, SphereSpot) and (other.id, other.series) == (target.id, target.series)


def old_posture(q_rad: Floats, earlier: Sequence[Floats]) -> str | None:
    """What to do instead where a reading (n,) repeats one of the earlier postures."""
    if any(np.abs(q_rad - other).max() < OTHER_RAD for other in earlier):
        return f"was read here in this posture; turn some joint by {np.degrees(OTHER_RAD):.0f}° or more"
    return None


def _old_spot(arm: GuidedArm, q_rad: Floats, earlier: Sequence[Floats]) -> str | None:
    """In one posture the assumed arm is off by the same at every spot, so that their distances are good."""
    if not earlier:
        return None
    tips_m = arm.tip_m(np.array([*earlier, q_rad]))
    if np.linalg.norm(tips_m[:-1] - tips_m[-1], axis=1).min() < APART_M:
        return f"was touched here; touch it {1e3 * APART_M:.0f} mm or more beside every earlier spot"
    thick_m = np.linalg.svd(tips_m - tips_m.mean(axis=0), compute_uv=False)[-1] / np.sqrt(len(tips_m))
    if len(tips_m) >= FLAT_FROM and thick_m < FLAT_M:
        return "all spots so far and this one lie in one plane, which shows no sphere; touch it out of that plane"
    return None
