"""A measuring arm calibrated from cones and bars by an emulated hand, against what its encoders' noise alone allows.

Guided sessions in-process on concealed arms, identified; then the truth is opened. Judged are fresh readings in places
that the fit has not seen. The floor is the same readings worked out with the true arm, the true discs and axes: only
noise, graduation and quantisation of the encoders are left. Rigid motions of the base are nobody's error.

Found over floor of one arm is that of its arm and of the places where it was judged: each ratio has a sigma of its own,
by leaving out one pair of places after the other (Efron, Stein, Annals of Statistics 9, 1981: jackknife).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from acquisition.guided.plan import GuidedOptions, calibration_plan
from acquisition.guided.reading import Reading
from acquisition.guided.session import GuidedSession
from acquisition.guided.stillness import ArmMotion, GuidedArm, StillRule
from acquisition.recording.rig import Rig, load_rig, plain_rig, rig_sha256, rig_text
from benchmarks.direct_hand import COUNTS, DirectHand
from benchmarks.slices import Slices
from calibeam.guided.judge import FittedJudge, samples_of
from calibeam.guided.recorded import AssumedGuidedArm
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.record import record_of
from calibrate.fit.identify.result import Identification
from calibrate.model.alignment import align
from calibrate.model.model_file import RigIdentity
from calibrate.model.predict import Predictor
from simulators.hand.held_arm import CannotReachError
from simulators.hand.world import HandWorld

Floats = NDArray[np.float64]
PATIENCE_S = 30.0
PERIOD_S = 0.05  # of samples: eleven a dwell, where the wires bring a hundred
PLACES = 20  # pairs of fresh places, a length apart: an arm errs by place, so that many places tell more than postures
LENGTH_M = 0.45
POSTURES = 4  # in each
HALF_COUNT_RAD = np.pi / COUNTS  # encoders round down: half a count is in every zero, and is nobody's error
REFUSED = 3  # postures that the hand does not get into, until the place is given up
SHOULDER_M = np.array([0.074, 0.0, 0.25])
LIMIT = 1.2  # of the floor
PERFECT_BEARINGS = {"axis_wobble_rad": 0.0, "radial_runout_m": 0.0, "axial_runout_m": 0.0}
KINDS = ("point error", "point repeatability", "length error")


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
    before_m: float  # point error with the nominal arm
    point_m: float
    point_floor_m: float
    repeat_m: float
    repeat_floor_m: float
    length_m: float
    length_floor_m: float
    sigmas: tuple[float, float, float]  # of the ratios below, from which places they were judged at

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
    hand, arm = DirectHand(HandWorld.from_rig(plain, seed=seed), PERIOD_S), AssumedGuidedArm.of_rig(rig)
    rng = np.random.default_rng([seed, 8])
    session = GuidedSession(hand, arm, hand, FittedJudge(rig), Nobody(), rng, patience_s=PATIENCE_S)
    summary = session.run(calibration_plan(rig, options))
    found = identified(rig, summary.readings)
    predictor = Predictor.of(record_of(found, RigIdentity(rig.name, rig_sha256(text), text), rig.arm.model.value))
    fresh = _fresh(hand, arm, rng)
    before_m = _rms(_squares(arm.tip_m(fresh.reading_rad), fresh)[0])
    pairs = list(zip(_squares(predictor.tip_m(fresh.reading_rad), fresh), _squares(fresh.floor_m, fresh), strict=True))
    names = [f"{kind}{what}_m" for kind in ("point", "repeat", "length") for what in ("", "_floor")]
    errors = dict(zip(names, (_rms(square) for pair in pairs for square in pair), strict=True))
    point, repeat, length = (_ratio_sigma(*pair) for pair in pairs)
    sigmas = (point, repeat, length)
    return Outcome(seed, len(summary.readings), summary.slips, before_m=before_m, **errors, sigmas=sigmas)


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
    while rule.judge(arm, window) is not ArmMotion.STILL:
        window = hand.dwell(rule.dwell_s)
    held = window.last(rule.dwell_s)
    shafts = np.array([world.shaft_at_rad(t_s) for t_s in held.t_s])
    error_rad = (held.q_rad + HALF_COUNT_RAD - shafts - world.arm.discs.off_centre_rad(shafts)).mean(axis=0)
    shaft = shafts.mean(axis=0)
    true_m = world.arm.tip_m(shafts).mean(axis=0)
    floor_m = true_m + world.arm.tip_m((shaft + error_rad)[None])[0] - world.arm.tip_m(shaft[None])[0]
    return held.q_rad.mean(axis=0), true_m, floor_m


def _squares(tips_m: Floats, fresh: Fresh) -> tuple[Floats, Floats, Floats]:
    """Point error, scatter about each place's mean error, and length error, base frames laid on each other.

    Each (pair of places, whatever is in it), m^2; of the scatter such that its mean is the variance.
    """
    T = align(tips_m, fresh.true_m).T_a_b
    error_m = (tips_m - (fresh.true_m @ T[:3, :3].T + T[:3, 3])).reshape(2 * PLACES, POSTURES, 3)
    scatter_m = (error_m - error_m.mean(axis=1, keepdims=True)) * np.sqrt(POSTURES / (POSTURES - 1.0))
    lengths_m = _lengths(tips_m) - _lengths(fresh.true_m)
    point, repeat = (np.sum(vectors**2, axis=2).reshape(PLACES, -1) for vectors in (error_m, scatter_m))
    return point, repeat, lengths_m**2


def _lengths(points_m: Floats) -> Floats:
    """(pair, posture) of points in the order of `_fresh`."""
    ends = points_m.reshape(PLACES, 2, POSTURES, 3)
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=2)


def _rms(squares: Floats) -> float:
    return float(np.sqrt(squares.mean()))


def _ratio_sigma(found: Floats, floor: Floats) -> float:
    """One sigma of the ratio of both rms, by the jackknife over the pairs of places."""
    of_found, of_floor = found.sum(axis=1), floor.sum(axis=1)
    without = np.sqrt((of_found.sum() - of_found) / (of_floor.sum() - of_floor))
    return float(np.sqrt((PLACES - 1) * np.var(without)))


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
        f"(floor {um[3]:.2f}, {repeat:.2f} x); length {um[4]:.2f} (floor {um[5]:.2f}, {length:.2f} x); sigma of "
        f"the ratios {', '.join(f'{sigma:.2f}' for sigma in one.sigmas)}"
    )


def summary_lines(outcomes: Sequence[Outcome]) -> Iterator[str]:
    """All arms together, how they are spread, and how many lie over the limit beside how many would by chance."""
    for kind, name in enumerate(KINDS):
        ratio, sigma = (np.array([values(one)[kind] for one in outcomes]) for values in (_ratios, _sigmas))
        together = float(np.sqrt(np.mean(ratio**2)))
        low, middle, high = np.quantile(ratio, [0.1, 0.5, 0.9])
        chance = float(np.sum(stats.norm.sf((LIMIT - together) / sigma)))
        yield (
            f"{name}: {together:.2f} x floor for all {len(outcomes)} arms together, "
            f"{'within' if together <= LIMIT else 'NOT within'} {LIMIT}; median {middle:.2f}, a tenth below {low:.2f}, "
            f"a tenth above {high:.2f}, worst {ratio.max():.2f} (one sigma of a ratio {np.median(sigma):.2f}); over "
            f"{LIMIT}: {int(np.sum(ratio > LIMIT))}, by the places judged at alone, were all arms alike, {chance:.1f}"
        )


def _ratios(one: Outcome) -> tuple[float, float, float]:
    return one.ratios


def _sigmas(one: Outcome) -> tuple[float, float, float]:
    return one.sigmas


def lines(rig_path: Path, seeds: range, name: str, *, anew: bool = True, **emulation: float) -> Iterator[str]:
    """Arm by arm, then all that are kept by this name; not `anew`: these seeds beside those of earlier slices."""
    kept = Slices(name, Outcome, rig_sha256(rig_text(rig_path)))
    if anew:
        kept.forget()
    for one in run(rig_path, seeds, None, **emulation):
        kept.keep(one.seed, one)
        yield line(one)
    yield from summary_lines(kept.rows())
