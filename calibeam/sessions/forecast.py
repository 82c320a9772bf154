"""What a session's samples determine so far, and how many more of its poses make it accurate enough.

The error is that of the beam over the workspace, as the covariance of the fit so far predicts it: the same fit, noise
and target as identification and pose design have (calibrate/fit/identify, calibrate/design), at the values and
under the noise found so far. For what these samples do not determine the reason is given instead of a number.

Postures still to come are those of the nominal rig; a pose out of reach is left out here and reported by the drawing
of the plan. Forecasts are made beside the session, while the arm is on its way: the newest samples count, and the
session never waits.
"""

import threading
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.centring.aim import flange_for, reach
from acquisition.errors import UnreachableError
from acquisition.recording import Samples
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Rig
from acquisition.recording.samples import SPOTS, per_joint
from acquisition.session.plan import Block, PoseKey
from acquisition.session.records import Sample
from calibeam.sessions.status import Forecast
from calibrate.design import Candidates, Information, target_of, with_prior
from calibrate.fit.accuracy import FELT_M
from calibrate.fit.identify.rounds import SettledFit, coarse_start, settled_fit
from calibrate.fit.identify.session import instruments_for_fit
from calibrate.fit.noise import VarianceFactors
from calibrate.fit.rank import Identifiability, analyse
from calibrate.fit.solvers import Status
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.assumed_rig import AssumedRig
from calibrate.model.observations import SIGMA_COLUMNS
from calibrate.model.parameters import index_of, priors, start_values

Floats = NDArray[np.float64]

SEED = 1  # of the starts of the inverse kinematics


@dataclass(frozen=True, eq=False)
class Ahead:
    """Poses in the order in which they are taken."""

    poses: Candidates
    keys: tuple[PoseKey, ...]

    def after(self, taken: int) -> Candidates:
        """All but the first so many."""
        return self.poses.take(np.arange(min(taken, len(self.keys)), len(self.keys)))


def ahead_of_blocks(rig: Rig, blocks: Sequence[Block]) -> Ahead:
    """Of a session that aims; repeats stand where their first pose stands."""
    assumed, rng = AssumedRig(rig), np.random.default_rng(SEED)
    near_rad = np.array(rig.motion.home_rad)
    found: dict[PoseKey, tuple[Floats, Floats]] = {}
    for block in blocks:
        T = assumed.T_base_psd1(block.placement)
        for visit in block.visits:
            flange = flange_for(assumed.arm, assumed.fixture, T, visit.target)
            try:
                near_rad = reach(assumed.arm, flange, near_rad, rng)
            except UnreachableError:
                continue
            for again in range(1 if visit.repeat is None else 3):
                found[visit.key(again)] = near_rad, np.array(visit.target.spots_m)
    keys = tuple(key for block in blocks for key in block.pose_keys() if key in found)
    return Ahead(_poses([found[key] for key in keys], keys, rig.n_joints), keys)


def ahead_of_plan(rig: Rig, plan: PosePlan) -> Ahead:
    """Of a plan of joint poses."""
    assumed = AssumedRig(rig)
    each = [(block, pose) for block in plan.block for pose in block.pose]
    keys = tuple(PoseKey(block.placement or 0, block.first_psd or 1, k) for k, (block, _) in enumerate(each))
    found: list[tuple[Floats, Floats]] = []
    for key, (_, pose) in zip(keys, each, strict=True):
        q_rad = np.array(pose.q_rad)
        spots = assumed.expect(q_rad, key.placement, key.first).spots_m if pose.spots_m is None else pose.spots_m
        found.append((q_rad, np.array(spots)))
    return Ahead(_poses(found, keys, rig.n_joints), keys)


def _poses(found: list[tuple[Floats, Floats]], keys: Sequence[PoseKey], n_joints: int) -> Candidates:
    return Candidates(
        np.array([q for q, _ in found]).reshape(-1, n_joints),
        np.array([spots for _, spots in found]).reshape(-1, 4),
        np.array([key.placement for key in keys], dtype=np.int64),
        np.array([key.first for key in keys], dtype=np.int64),
    )


LARGEST_M = 1e-2  # a prediction beyond this is no number that a straight-line covariance can give


def forecast(rig: Rig, taken: list[Sample], ahead: Candidates, goal_m: float) -> Forecast:
    """Of samples taken, and poses still to be taken in this order. A fit that fails is reported, never raised."""
    nothing = Forecast(len(taken), goal_m)
    if not taken:
        return replace(nothing, why="no pose yet")
    rows = _table(taken, ahead)
    try:
        fitted = _fitted(rig, rows.take(np.arange(len(taken))))
        if fitted.fit.status is Status.NOT_FINITE or not np.all(np.isfinite(fitted.fit.theta)):
            return replace(nothing, why="the fit of these poses does not converge")
        return _forecast(rig, rows, fitted, nothing)
    except np.linalg.LinAlgError:
        return replace(nothing, why="these poses are too few, or too alike")


def _forecast(rig: Rig, rows: Samples, fitted: SettledFit, nothing: Forecast) -> Forecast:
    """The numbers, or why there is none."""
    names = {p.name: float(v) for p, v in zip(fitted.fit.parameters, fitted.fit.theta, strict=True)}
    found, seen, felt_m = _information(rig, rows, names, fitted.factors, nothing.samples)
    open_ = [c.plain for c, m in zip(reversed(seen.combinations), felt_m[::-1], strict=False) if m > FELT_M]
    if np.any(felt_m > FELT_M):
        return replace(nothing, why=_short(open_, int(np.sum(felt_m > FELT_M))), corrections=names)
    error_m = _falling(found, nothing.samples)
    if not error_m[0] <= LARGEST_M:
        return replace(nothing, why="these poses determine too little", corrections=names)
    under = np.flatnonzero(error_m <= nothing.goal_m)
    more = int(under[0]) if under.size else None
    return replace(nothing, now_m=float(error_m[0]), more=more, end_m=float(error_m[-1]), corrections=names)


def _information(
    rig: Rig, rows: Samples, names: dict[str, float], factors: VarianceFactors, taken: int
) -> tuple[Information, Identifiability, Floats]:
    """Of every row; what the taken ones see; and what each direction that they do not see may move the target by."""
    weighting = instruments_for_fit(rig, rows).weighting
    every = weighting.parameters
    theta = start_values(every)
    column = index_of(every)
    for name, value in names.items():
        theta[column[name]] = value
    free = np.flatnonzero([p.free for p in every])
    parameters = tuple(with_prior(every[i]) for i in free)
    size = priors(parameters)
    J = weighting.problem(theta, factors).jacobian(theta)
    k = len(SPOTS)
    seen = analyse(J[: k * taken], every)
    target = target_of(rig, arm_of(rig), every, theta, np.random.default_rng(SEED))
    scaled = J[:, free] * size
    found = Information(
        parameters,
        scaled[: k * len(rows)].reshape(len(rows), k, -1),
        scaled[k * len(rows) :],
        target.by[:, free] * size,
        target.by_scale[free] * size,
        target.says,
        np.zeros((len(free), 0)),  # what nothing shows and moves the target forbids a number: see `seen`
    )
    return found, seen, np.linalg.norm(target.by[:, free] @ seen.unseen, axis=0)


def _falling(found: Information, taken: int) -> Floats:
    """(1 + ahead,) the error now, and with one pose of the plan after the other."""
    known = found.of(np.arange(taken))
    out = [found.free_space_m(known)]
    for rows in found.rows[taken:]:
        known = known + rows.T @ rows
        out.append(found.free_space_m(known))
    return np.array(out)


def _fitted(rig: Rig, samples: Samples) -> SettledFit:
    instruments = instruments_for_fit(rig, samples)
    return settled_fit(instruments.weighting, coarse_start(instruments.weighting, instruments.start))


def _table(taken: list[Sample], ahead: Candidates) -> Samples:
    """Taken, then ahead; of spots that nobody has seen the noise is the usual one of those seen."""
    seen = [sample.row() for sample in taken]
    n_joints = len(taken[0].look.q_rad)
    names = ("t_s", *per_joint("q", "_rad", n_joints), "placement", "first_psd", *SPOTS)
    columns = {name: np.array([row[name] for row in seen], dtype=np.float64) for name in (*names, *SIGMA_COLUMNS)}
    if len(ahead) == 0:
        return Samples(columns, n_joints)
    later = ahead.samples().columns
    joined = {name: np.concatenate([columns[name], later[name]]) for name in names}
    for name in SIGMA_COLUMNS:
        joined[name] = np.concatenate([columns[name], np.full(len(ahead), np.median(columns[name]))])
    return Samples(joined, n_joints)


def _short(combinations: list[str], count: int) -> str:
    first = combinations[0] if combinations else "too few poses"
    return first if count <= 1 else f"{first}, and {count - 1} more"


END_S = 5.0  # longer than any forecast takes: a tenth of a second at ninety poses


@dataclass(frozen=True)
class Asked:
    """What a forecast is made of."""

    samples: list[Sample]
    taken_of_plan: int  # how many of the plan's poses are behind


class Forecaster:
    """One thread; `make` computes and reports. What it raises goes to `failed`, once, and no more is made."""

    def __init__(self, make: Callable[[Asked], None], failed: Callable[[Exception], None]) -> None:
        self._make, self._failed = make, failed
        self._news = threading.Condition()
        self._asked: Asked | None = None
        self._over = True

    def ask(self, asked: Asked) -> None:
        """Takes the place of what was asked before and is not begun yet."""
        with self._news:
            self._asked = asked
            self._news.notify()

    @contextmanager
    def running(self) -> Generator[None]:
        """Inside, what is asked is made."""
        self._over = False
        thread = threading.Thread(target=self._run, name="forecast", daemon=True)
        thread.start()
        try:
            yield
        finally:
            with self._news:
                self._over = True
                self._news.notify()
            thread.join(END_S)

    def _run(self) -> None:
        while True:
            with self._news:
                self._news.wait_for(lambda: self._over or self._asked is not None)
                asked, self._asked = self._asked, None
                if self._over or asked is None:
                    return
            try:
                self._make(asked)
            except Exception as error:  # a session goes on without forecasts
                self._failed(error)
                return
