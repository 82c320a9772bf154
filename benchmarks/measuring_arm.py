"""A measuring arm calibrated from cones and bars by an emulated hand, against what its encoders' noise alone allows.

Guided sessions in-process on concealed arms, identified; then the truth is opened. Judged are fresh readings in places
that the fit has not seen. The floor is the same readings worked out with the true arm, the true discs and axes: only
noise, graduation and quantisation of the encoders are left. Rigid motions of the base are nobody's error.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.arm import GuidedArm
from acquisition.guided.plan import GuidedOptions, calibration_plan
from acquisition.guided.reading import Reading
from acquisition.guided.session import GuidedSession
from acquisition.guided.stillness import Motion, StillRule
from acquisition.recording.rig import load_rig, plain_rig, rig_sha256, rig_text
from acquisition.recording.rig_schema import Rig
from calibeam.guided.arm import BelievedGuidedArm
from calibeam.guided.direct import COUNTS, DirectHand
from calibeam.guided.judge import FittedJudge
from calibeam.guided.refit import samples_of
from calibrate.alignment import align
from calibrate.identification.identify import identify
from calibrate.identification.record import record_of
from calibrate.identification.result import Identification
from calibrate.model_file import RigIdentity
from calibrate.predict import Predictor
from simulators.hand.hand import CannotReachError
from simulators.hand.world import HandWorld

Floats = NDArray[np.float64]
PATIENCE_S = 30.0
PERIOD_S = 0.05  # of samples: eleven a dwell, where the wires bring a hundred
PLACES = 8  # pairs of fresh places, a length apart
LENGTH_M = 0.45
POSTURES = 10  # in each
HALF_COUNT_RAD = np.pi / COUNTS  # encoders round down: half a count is in every zero, and is nobody's error
REFUSED = 3  # postures that the hand does not get into, until the place is given up
SHOULDER_M = np.array([0.074, 0.0, 0.25])
LIMIT = 1.2  # of the floor: issue 8


class Nobody:
    """A journal that nobody reads."""

    def readings(self, readings: object) -> None: ...

    def event(self, kind: str, detail: object) -> None: ...


@dataclass(frozen=True)
class Outcome:
    """One arm; rms in m, three axes together for points."""

    seed: int
    readings: int
    slips: int
    before_m: float  # point error with the arm as drawn
    point_m: float
    point_floor_m: float
    repeat_m: float
    repeat_floor_m: float
    length_m: float
    length_floor_m: float

    @property
    def ratios(self) -> tuple[float, float, float]:
        """Point, repeatability, length: found over floor."""
        return (
            self.point_m / self.point_floor_m,
            self.repeat_m / self.repeat_floor_m,
            self.length_m / self.length_floor_m,
        )


def run(rig_path: Path, seeds: range, options: GuidedOptions | None = None, **emulation: float) -> Iterator[Outcome]:
    """One session a seed; `emulation` goes before the rig's own."""
    text = rig_text(rig_path)
    rig, plain = load_rig(rig_path), plain_rig(text, str(rig_path))
    plain = {**plain, "emulation": {**plain["emulation"], **emulation}}
    for seed in seeds:
        yield _one(rig, text, plain, seed, options or GuidedOptions())


def _one(rig: Rig, text: str, plain: Mapping[str, Any], seed: int, options: GuidedOptions) -> Outcome:
    hand, arm = DirectHand(HandWorld.from_rig(plain, seed=seed), PERIOD_S), BelievedGuidedArm(rig)
    rng = np.random.default_rng([seed, 8])
    session = GuidedSession(hand, arm, hand, FittedJudge(rig), Nobody(), rng, patience_s=PATIENCE_S)
    summary = session.run(calibration_plan(rig, options))
    found = identified(rig, summary.readings)
    predictor = Predictor.of(record_of(found, RigIdentity(rig.name, rig_sha256(text), text), rig.arm.model.value))
    fresh = _fresh(hand, arm, rng)
    before_m = _error(arm.tip_m(fresh.reading_rad), fresh)[0]
    errors = _error(predictor.tip_m(fresh.reading_rad), fresh)
    floors = _error(fresh.floor_m, fresh)
    pairs = zip(errors, floors, strict=True)
    return Outcome(seed, len(summary.readings), summary.slips, before_m, *(value for pair in pairs for value in pair))


def identified(rig: Rig, readings: tuple[Reading, ...]) -> Identification:
    """The arm as `calibeam identify` would say it, without its proofs."""
    samples = samples_of(readings, rig.n_joints)
    return identify(rig, samples, rng=np.random.default_rng(1), held_out_share=0.0, bootstrap_rounds=0)


@dataclass(frozen=True)
class Fresh:
    """Readings (row, n) at places (row,) of which two and two are a length; the truth beside them."""

    reading_rad: Floats
    place: NDArray[np.int64]
    true_m: Floats  # (row, 3)
    floor_m: Floats  # (row, 3) where a perfectly known arm would have the probe by these readings


def _fresh(hand: DirectHand, arm: GuidedArm, rng: np.random.Generator) -> Fresh:
    rows: list[tuple[Floats, int, Floats, Floats]] = []
    place = 0
    while place < 2 * PLACES:
        pair_m = _pair(rng)
        taken = [_held(hand, arm, point_m, rng) for point_m in pair_m]
        if all(len(held) == POSTURES for held in taken):
            for held in taken:
                rows += [(q, place, true, floor) for q, true, floor in held]
                place += 1
    q, places, true, floor = zip(*rows, strict=True)
    return Fresh(np.array(q), np.array(places), np.array(true), np.array(floor))


def _pair(rng: np.random.Generator) -> Floats:
    """(2, 3) ends of a length somewhere within comfortable reach: 0.35 to 0.75 m about the shoulder."""
    out, way = rng.standard_normal(3), rng.standard_normal(3)
    middle = SHOULDER_M + rng.uniform(0.35, 0.75) * out / np.linalg.norm(out)
    return middle + np.array([[-0.5], [0.5]]) * LENGTH_M * way / np.linalg.norm(way)


def _held(
    hand: DirectHand, arm: GuidedArm, point_m: Floats, rng: np.random.Generator
) -> list[tuple[Floats, Floats, Floats]]:
    """Mean reading, true place and floor of some postures with the probe there; fewer where it hardly gets there."""
    out: list[tuple[Floats, Floats, Floats]] = []
    refused = 0
    while len(out) < POSTURES and refused < REFUSED:
        starts = rng.uniform(arm.lower_rad, arm.upper_rad, (16, len(arm.lower_rad)))
        postures = arm.postures(starts, point_m)
        if not len(postures):
            break
        try:
            hand.world.carry(point_m, postures[0])
        except CannotReachError:
            refused += 1
            continue
        out.append(_dwelt(hand, arm))
    return out


def _dwelt(hand: DirectHand, arm: GuidedArm) -> tuple[Floats, Floats, Floats]:
    rule, world = StillRule(), hand.world
    world.advance(world.arrives_s)
    window = hand.dwell(rule.dwell_s)  # whole: what was seen on the way there, or before, does not count
    while rule.judge(arm, window) is not Motion.STILL:
        window = hand.dwell(rule.dwell_s)
    held = window.last(rule.dwell_s)
    shafts = np.array([world.shaft_at_rad(t_s) for t_s in held.t_s])
    error_rad = (held.q_rad + HALF_COUNT_RAD - shafts - world.arm.off_centre_rad(shafts)).mean(axis=0)
    shaft = shafts.mean(axis=0)
    true_m = world.arm.tip_m(shafts).mean(axis=0)
    floor_m = true_m + world.arm.tip_m((shaft + error_rad)[None])[0] - world.arm.tip_m(shaft[None])[0]
    return held.q_rad.mean(axis=0), true_m, floor_m


def _error(tips_m: Floats, fresh: Fresh) -> tuple[float, float, float]:
    """Rms of point error, scatter about each place's mean error, and length error; base frames laid on each other."""
    T = align(tips_m, fresh.true_m).T_a_b
    error_m = tips_m - (fresh.true_m @ T[:3, :3].T + T[:3, 3])
    places = range(int(fresh.place.max()) + 1)
    scatter_m = np.concatenate([error_m[fresh.place == k] - error_m[fresh.place == k].mean(axis=0) for k in places])
    freedom = POSTURES / (POSTURES - 1.0)
    a, b = fresh.place % 2 == 0, fresh.place % 2 == 1
    lengths_m = np.linalg.norm(tips_m[b] - tips_m[a], axis=1) - np.linalg.norm(
        fresh.true_m[b] - fresh.true_m[a], axis=1
    )
    return _rms(error_m), _rms(scatter_m) * float(np.sqrt(freedom)), float(np.sqrt(np.mean(lengths_m**2)))


def _rms(vectors: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1))))


def line(one: Outcome) -> str:
    """One arm."""
    um = [
        1e6 * v
        for v in (one.point_m, one.point_floor_m, one.repeat_m, one.repeat_floor_m, one.length_m, one.length_floor_m)
    ]
    point, repeat, length = one.ratios
    return (
        f"  seed {one.seed:2d}: {one.readings} readings, {one.slips} slips rejected; point {1e6 * one.before_m:.0f} um "
        f"as drawn, {um[0]:.2f} after (floor {um[1]:.2f}, {point:.2f} x); repeatability {um[2]:.2f} "
        f"(floor {um[3]:.2f}, {repeat:.2f} x); length {um[4]:.2f} (floor {um[5]:.2f}, {length:.2f} x)"
    )


def summary_line(outcomes: list[Outcome]) -> str:
    """Pooled over the seeds, and whether it keeps the limit."""
    pooled = [float(np.sqrt(np.mean([one.ratios[k] ** 2 for one in outcomes]))) for k in range(3)]
    worst = [max(one.ratios[k] for one in outcomes) for k in range(3)]
    kept = all(ratio <= LIMIT for ratio in worst)
    names = ("point error", "point repeatability", "length error")
    told = "; ".join(f"{n} {p:.2f} x floor (worst {w:.2f})" for n, p, w in zip(names, pooled, worst, strict=True))
    return f"{told}; {'within' if kept else 'NOT within'} {LIMIT} x for every arm"
