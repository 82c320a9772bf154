"""An exciting motion of all joints: finite Fourier series, drawn, improved step by step, kept within every limit.

Each joint's series begins and ends at rest and without acceleration: its sine amplitudes are drawn in the null space
of k, its cosine amplitudes in that of k^2. What is within the limits is scaled until one of them is reached.
Source: Swevers et al., Optimal robot excitation and identification, IEEE Trans. Robotics and Automation 13(5), 1997.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording.motion_plan import JointSeries, MotionPlan
from acquisition.recording.rig import Rig
from calibrate.errors import DataError
from calibrate.excitation.catalogue_sigmas import LEAST_SHARE, NOISE_SHARE, TorqueInformation, torque_information
from calibrate.model.arms.coupled_readings import by_reading

Floats = NDArray[np.float64]
Clear = Callable[[Floats, float], bool]  # readings (moment, joint) and the time between them (s): all of it allowed

HIGHEST_HZ = 0.5  # of the series: with a tenth of a radian that is 1 rad/s2, and far below the band of the diagnosis
FEWEST_WAVES = 5  # as the five of the source
MARGIN_RAD = 0.1  # to either end of a joint's range
OFF_HOME_RAD = 0.6  # by which a joint's middle is moved from home at most
MOST_RAD = 1.6  # from its middle: a quarter turn to either side
ACCELERATION_SHARE = 0.9
STEP_S, STEPS_A_WAVE = 0.05, 40  # between moments at which limits are checked, at most
BETWEEN = 0.99  # of a limit: between these moments a wave may rise by 0.3 %
DRAWN, STEPS = 30, 150
DIGITS = 7  # of an angle in rad: what they leave of speed and acceleration at rest is far below any drive's
SHRINKS, SHRUNK = 12, 0.85  # of a motion that is not clear, times
STEP_SHARE = 0.3  # of a joint's amplitudes, in the first step of the improvement; the last is a tenth of it


@dataclass(frozen=True)
class ExcitationWish:
    """What is asked for."""

    length_s: float = 20.0
    repeats: int = 3
    speed_share: float = 0.5  # of the rig's speed
    noise_nm: float | None = None
    seed: int = 1


@dataclass(frozen=True, eq=False)
class Excitation:
    """The chosen motion. Shares are of the rig's limits."""

    plan: MotionPlan
    information: TorqueInformation
    drawn: int  # candidates within the limits
    gain: float  # by how much the sigmas shrank on average, against the middle candidate
    room_rad: Floats  # (joint,) to the nearer end of its range
    speed_share: Floats  # (joint,)
    acceleration_share: Floats  # (joint,)

    @property
    def assumed_noise(self) -> str:
        """What is assumed of a torque's noise where none is given."""
        share, least = 100.0 * NOISE_SHARE, 100.0 * LEAST_SHARE
        return f"{share:g} % of a joint's expected torque, at least {least:g} % of the largest joint's"


@dataclass(frozen=True, eq=False)
class _Shape:
    """Amplitudes of the null spaces (joint, wave - 1) and middles (joint,)."""

    middle: Floats
    sine: Floats
    cosine: Floats


class _Maker:
    """Shapes to plans within the limits of a rig."""

    def __init__(self, rig: Rig, wish: ExcitationWish, clear: Clear) -> None:
        waves = max(FEWEST_WAVES, round(HIGHEST_HZ * wish.length_s))
        self.rig, self.wish, self._clear = rig, wish, clear
        self.k = np.arange(1, waves + 1)
        self._sines, self._cosines = _null_space(self.k), _null_space(self.k**2)
        self.step_s = min(STEP_S, wish.length_s / waves / STEPS_A_WAVE)
        self.t_s = np.arange(0.0, wish.length_s + self.step_s, self.step_s)
        joints = rig.arm.joints
        self.lower = np.array([j.lower_rad for j in joints]) + MARGIN_RAD
        self.upper = np.array([j.upper_rad for j in joints]) - MARGIN_RAD
        self.home = np.array(rig.motion.home_rad)

    def drawn(self, rng: Generator) -> _Shape:
        n, low = self.rig.n_joints, 1.0 / self.k[1:]
        sine, cosine = (rng.standard_normal((n, len(low))) * low for _ in range(2))
        return _Shape(self._middle(self.home + rng.uniform(-OFF_HOME_RAD, OFF_HOME_RAD, n)), sine, cosine)

    def changed(self, shape: _Shape, share: float, rng: Generator) -> _Shape:
        """One joint of it."""
        i = rng.integers(self.rig.n_joints)
        middle, sine, cosine = shape.middle.copy(), shape.sine.copy(), shape.cosine.copy()
        middle[i] += share * OFF_HOME_RAD * rng.standard_normal()
        for part in (sine, cosine):
            part[i] += share * np.linalg.norm(part[i]) * rng.standard_normal(part.shape[1]) / np.sqrt(part.shape[1])
        return _Shape(self._middle(middle), sine, cosine)

    def _middle(self, middle: Floats) -> Floats:
        near = np.clip(middle, self.home - OFF_HOME_RAD, self.home + OFF_HOME_RAD)
        return np.clip(near, np.minimum(self.lower, self.home), np.maximum(self.upper, self.home))

    def plan(self, shape: _Shape) -> MotionPlan | None:
        """As large as the limits allow. None where it is not clear even when it is small."""
        scale = self._scale(self._plan(shape, np.ones(self.rig.n_joints)))
        if not np.all(scale > 0.0):
            return None
        for _ in range(SHRINKS):
            made = self._plan(shape, scale)
            if self._clear(made.at(self.t_s), self.step_s):
                return made
            scale = SHRUNK * scale
        return None

    def _plan(self, shape: _Shape, scale: Floats) -> MotionPlan:
        sine, cosine = (scale[:, None] * (part @ null.T) for part, null in self._parts(shape))
        joints = tuple(
            JointSeries(float(m), tuple(map(float, s)), tuple(map(float, c)))
            for m, s, c in zip(*(np.round(each, DIGITS) for each in (shape.middle, sine, cosine)), strict=True)
        )
        wish = self.wish
        purpose = f"exciting motion, no joint above {wish.speed_share:g} of the rig's speed; seed {wish.seed}"
        return MotionPlan(1, self.rig.name, wish.length_s, wish.repeats, joints, (purpose,))

    def _parts(self, shape: _Shape) -> Iterator[tuple[Floats, Floats]]:
        yield shape.sine, self._sines
        yield shape.cosine, self._cosines

    def _scale(self, made: MotionPlan) -> Floats:
        """(joint,) that reaches the first of its limits."""
        motion = self.rig.motion
        middle = np.array([j.middle_rad for j in made.joint])
        room = np.minimum(np.minimum(self.upper - middle, middle - self.lower), MOST_RAD)
        limits = (
            room,
            self.wish.speed_share * motion.speed_rad_s,
            ACCELERATION_SHARE * motion.acceleration_rad_s2,
        )
        q = (made.at(self.t_s) - middle, made.at(self.t_s, 1), made.at(self.t_s, 2))
        shares = [limit / np.max(np.abs(values), axis=0) for limit, values in zip(limits, q, strict=True)]
        return np.asarray(BETWEEN * np.min(shares, axis=0))


def _null_space(row: NDArray[np.int64]) -> Floats:
    """(k, k - 1) orthonormal, of one row (k,)."""
    out: Floats = np.linalg.svd(row[None].astype(float))[2][1:].T
    return out


def _refuse(rig: Rig) -> None:
    """DataError where no motion can be designed, whatever is drawn."""
    if by_reading(rig.arm) is not None:
        raise DataError(f"rig {rig.name}: a joint follows another one; torques of such drives cannot be separated")
    home_rad = rig.motion.home_rad or ()
    for i, (joint, home) in enumerate(zip(rig.arm.joints, home_rad, strict=False), start=1):
        if min(home - joint.lower_rad, joint.upper_rad - home) <= MARGIN_RAD:
            raise DataError(
                f"rig {rig.name}: joint {i} at home_rad ({home:.4g} rad) is within {MARGIN_RAD:g} rad of an end of its "
                "range; move home_rad of [motion] towards the middle"
            )


def excite(
    rig: Rig, wish: ExcitationWish, clear: Clear, progress: Callable[[int, int], None] = lambda done, total: None
) -> Excitation:
    """The best of the drawn motions, improved. DataError where none is clear, or the noise is not known."""
    _refuse(rig)
    maker, rng = _Maker(rig, wish, clear), np.random.default_rng(wish.seed)
    offered: list[tuple[float, int, _Shape, MotionPlan]] = []
    for done in range(DRAWN):
        shape = maker.drawn(rng)
        if (plan := maker.plan(shape)) is not None:
            offered.append((torque_information(rig, plan, wish.noise_nm).score, done, shape, plan))
        progress(done + 1, DRAWN + STEPS)
    if not offered:
        raise DataError(
            f"rig {rig.name}: none of {DRAWN} drawn motions about home_rad is clear of the table, of keep-out boxes "
            "and of the arm itself; check home_rad and the boxes of [motion]"
        )
    offered.sort(key=lambda one: one[:2])
    score, _, shape, plan = offered[0]
    for step in range(STEPS):
        share = STEP_SHARE * 10.0 ** (-step / STEPS)
        other = maker.changed(shape, share, rng)
        made = maker.plan(other)
        if made is not None and (new := torque_information(rig, made, wish.noise_nm).score) < score:
            score, shape, plan = new, other, made
        progress(DRAWN + step + 1, DRAWN + STEPS)
    q, qd, qdd = (plan.at(maker.t_s, k) for k in range(3))
    room = np.minimum(maker.upper - q, q - maker.lower).min(axis=0) + MARGIN_RAD
    return Excitation(
        plan,
        torque_information(rig, plan, wish.noise_nm),
        len(offered),
        float(np.exp(offered[len(offered) // 2][0] - score)),
        room,
        np.max(np.abs(qd), axis=0) / rig.motion.speed_rad_s,
        np.max(np.abs(qdd), axis=0) / rig.motion.acceleration_rad_s2,
    )
