"""How a reading agrees with the arm as known so far: refitted to all that was accepted, by the models of `calibrate`.

Not the identification that is reported: zeros have a wide prior, the probe is held in link n, noise is as assumed.
Visits that the others contradict are left out by data snooping (Baarda, A testing procedure for use in geodetic
networks, 1968): of all visits the one whose misfit is largest by the uncertainty of a fit without it goes first, then
the fit is made again. An early reading on the rim was taken when it could not be recognised, and the fit has bent
towards it; left out, all others agree again.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.guided.reading import BarEnd, Cone, OffTarget, Reading
from acquisition.recording import Samples
from acquisition.recording.rig import Rig, Tolerance
from acquisition.recording.samples import BAR, PLANE
from calibrate.fit.identify.session import instruments_for_fit
from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.solvers import FAR_START, NEAR_START, solve
from calibrate.fit.weighting import Weighting
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.eccentric import with_discs
from calibrate.model.chain import (
    KinematicModel,
)
from calibrate.model.default_tolerance import SCALELESS
from calibrate.model.dual_psd_rig import assumed_noise
from calibrate.model.parameters import Parameter, priors, values_by_name
from calibrate.model.rigid import cross_matrix
from calibrate.model.sensors import plane, seat
from calibrate.model.sensors.seat import SEAT_ASSUMED_M

Floats = NDArray[np.float64]
Visit = tuple[Reading, ...]  # a reading in a cone, or both ends of a bar
ZERO_RAD = 0.02  # a zero within a degree: an arm that was set up; wide enough for one that was put together again
LIMIT_SIGMAS = 6.0  # of what is not known, noise included: one of 1e8 honest readings is asked for again
MOST_DROPPED = 8  # in one go; more of them are no slips but another trouble


@dataclass(frozen=True, eq=False)
class Refit:
    """A fit and what it was made of."""

    values: Mapping[str, float]
    names: tuple[str, ...]  # of the covariance
    covariance: Floats
    kept: tuple[Visit, ...]
    dropped: tuple[Visit, ...]


def visits_of(readings: Sequence[Reading]) -> tuple[Visit, ...]:
    """Cones one by one, ends of bars two by two; what is neither does not count."""
    cones = [(reading,) for reading in readings if isinstance(reading.target, Cone)]
    ends = [reading for reading in readings if BAR in reading.target.columns]
    return (*cones, *zip(ends[::2], ends[1::2], strict=True))


def refit_arm(
    rig: Rig,
    visits: Sequence[Visit],
    values: Mapping[str, float],
    prior: Callable[[Parameter], Parameter] | None = None,
) -> Refit | None:
    """From `values` by name, where there are any; None where no cone was taken twice and no bar at all.

    Of two visits that only contradict each other the later one goes. `prior`: `assumed_prior` where none is given.
    """
    kept, dropped = list(visits), list[Visit]()
    while used := telling(kept):
        weighting, parameters, start = prepared(rig, used, values, prior or assumed_prior)
        problem = weighting.problem(start).with_parameters(parameters)
        fit = solve(problem, start=start, damping=NEAR_START if values else FAR_START, max_steps=30)
        if not np.all(np.isfinite(fit.covariance)):
            return None
        values = {
            p.name: float(v)
            for p, v in zip(parameters, fit.theta, strict=True)
            if not p.name.startswith((seat.POINTS, plane.PLANES))
        }
        sigmas = _without_itself(problem, weighting, fit.theta, used)
        worst = len(sigmas) - 1 - int(np.argmax(sigmas[::-1]))
        if sigmas[worst] <= LIMIT_SIGMAS or len(dropped) == MOST_DROPPED:
            names = tuple(p.name for p in parameters)
            return Refit(values, names, fit.covariance, tuple(kept), tuple(dropped))
        kept.remove(used[worst])
        dropped.append(used[worst])
    return None


def telling(visits: Sequence[Visit]) -> list[Visit]:
    """Without cones that were taken once, and planes touched less often than determines them."""
    places = [None if isinstance(v[0].target, BarEnd) else tuple(v[0].target.columns.items()) for v in visits]
    often = Counter(places)
    return [
        visit
        for visit, place in zip(visits, places, strict=True)
        if place is None or often[place] >= (plane.FEWEST if PLANE in visit[0].target.columns else 2)
    ]


def prepared(
    rig: Rig, used: Sequence[Visit], values: Mapping[str, float], prior: Callable[[Parameter], Parameter]
) -> tuple[Weighting, tuple[Parameter, ...], Floats]:
    """The fit of these visits before it is made: weights, parameters with their priors, and where they start."""
    samples = samples_of([reading for visit in used for reading in visit], rig.n_joints)
    weighting = instruments_for_fit(rig, samples).weighting
    parameters = tuple(prior(p) for p in weighting.parameters)
    return weighting, parameters, np.array([values.get(p.name, p.start) for p in parameters])


def _without_itself(problem: JointProblem, weighting: Weighting, theta: Floats, used: Sequence[Visit]) -> Floats:
    """(visit,) misfit of each in sigmas of its noise and of a fit without it: r' (I - H)^-1 r, root of."""
    visit_of = np.repeat(np.arange(len(used)), [len(visit) for visit in used])
    free = np.flatnonzero([p.free for p in problem.parameters])
    jacobian, residual = problem.jacobian(theta)[:, free], problem.residual(theta)
    information = jacobian.T @ jacobian + np.diag(1.0 / priors(problem.parameters)[free] ** 2)
    hat = np.linalg.solve(information, jacobian.T)
    out, row = np.zeros(len(used)), 0
    for measured in weighting.measured:
        width = measured.problem.observed.shape[1]
        for samples in measured.sample_rows:
            part = slice(row, row + width)
            left = np.eye(width) - jacobian[part] @ hat[:, part]
            square = residual[part] @ np.linalg.lstsq(left, residual[part], rcond=1e-9)[0]
            out[visit_of[samples[0]]] = np.sqrt(max(float(square), 0.0))
            row += width
    return out


def assumed_prior(p: Parameter) -> Parameter:
    """Wide priors where the identification has none; the probe is held, for link n has the same three shifts."""
    if p.name.startswith("tool."):
        return replace(p, free=False)
    return replace(p, prior=ZERO_RAD) if p.name.endswith(".zero") else p


def samples_of(readings: Sequence[Reading], n_joints: int) -> Samples:
    """The readings as a table of samples."""
    rows = [reading.row() for reading in readings]
    names = dict.fromkeys(name for row in rows for name in row)
    columns = {
        name: np.array([row.get(name, "") for row in rows])
        if name == "bar_end"
        else np.array([row.get(name, np.nan) for row in rows], dtype=np.float64)
        for name in names
    }
    return Samples(columns, n_joints)


class FittedJudge:
    """Implements acquisition.guided.reading.Judge."""

    def __init__(self, rig: Rig) -> None:
        stated = rig.tolerance or Tolerance(length_m=SCALELESS.length_sigma_m, angle_rad=SCALELESS.angle_sigma_rad)
        self._rig = msgspec.structs.replace(rig, tolerance=stated)
        self._arm: KinematicModel = with_discs(arm_of(self._rig), self._rig)
        self._point_m = np.array(rig.tool.point_m or (0.0, 0.0, 0.0))
        self._noise = assumed_noise(rig).joint_rad, rig.noise.seat_m or SEAT_ASSUMED_M
        sigmas = np.array([assumed_prior(p).prior if p.free else 0.0 for p in self._arm.parameters])
        self._values: Mapping[str, float] = {}
        self._theta, self._covariance = np.zeros(len(sigmas)), np.diag(sigmas**2)
        self._learned: list[Reading] = []
        self._cones: dict[int, list[Reading]] = {}
        self.repeatability_m: float | None = None

    def learn(self, readings: Sequence[Reading]) -> None:
        self._learned = list(readings)
        visits = visits_of(readings)
        fit = refit_arm(self._rig, visits, self._values)
        self._cones = {}
        for visit in visits if fit is None else fit.kept:
            if isinstance(visit[0].target, Cone):
                self._cones.setdefault(visit[0].target.id, []).append(visit[0])
        if fit is not None:
            self._take(fit)
            self.repeatability_m = self._scatter_m()

    def off_target(self, visit: Sequence[Reading]) -> OffTarget | None:
        """What the fit has bent towards an earlier slip would reject a good reading: so the one that all others
        speak against is looked for among the earlier ones, too.
        """
        miss, slope, noise = self._miss(visit)
        if not miss.size:
            return None
        covariance = slope @ self._covariance @ slope.T + noise
        sigmas = float(np.sqrt(miss @ np.linalg.solve(covariance, miss)))
        if sigmas <= LIMIT_SIGMAS:
            return None
        fit = refit_arm(self._rig, visits_of([*self._learned, *visit]), self._values)
        if fit is not None and not any(dropped[0] is visit[0] for dropped in fit.dropped):
            return None
        return OffTarget(float(np.linalg.norm(miss)), sigmas)

    def _take(self, fit: Refit) -> None:
        own = [fit.names.index(p.name) for p in self._arm.parameters]
        names = {p.name for p in self._arm.parameters}
        self._theta = values_by_name(self._arm.parameters, {n: v for n, v in fit.values.items() if n in names})
        self._covariance = fit.covariance[np.ix_(own, own)]
        self._values = fit.values

    def _miss(self, visit: Sequence[Reading]) -> tuple[Floats, Floats, Floats]:
        """What should be zero (k,), its derivative (k, param), covariance of its noise (k, k); k = 0: nothing known."""
        target = visit[0].target
        if isinstance(target, BarEnd):
            tips_m, slopes, noises = self._tip(visit)
            span_m = tips_m[1] - tips_m[0]
            along: Floats = span_m / max(float(np.linalg.norm(span_m)), 1e-12)
            apart = np.array([float(np.linalg.norm(span_m)) - self._rig.bars[target.bar].length_m])
            slope = (along @ (slopes[1] - slopes[0]))[np.newaxis]
            return apart, slope, (along @ noises.sum(axis=0) @ along).reshape(1, 1)
        earlier = self._cones.get(target.id, []) if isinstance(target, Cone) else []
        if not earlier:
            return np.zeros(0), np.zeros((0, len(self._theta))), np.zeros((0, 0))
        tips_m, slopes, noises = self._tip([*visit, *earlier])
        noise = noises[0] + noises[1:].mean(axis=0) / len(earlier)
        return tips_m[0] - tips_m[1:].mean(axis=0), slopes[0] - slopes[1:].mean(axis=0), noise

    def _tip(self, readings: Sequence[Reading]) -> tuple[Floats, Floats, Floats]:
        """Places (row, 3), derivative by the arm (row, 3, param), covariance of the noise (row, 3, 3)."""
        q_rad = np.array([reading.q_rad for reading in readings])
        T_base_flange = self._arm.flange(self._theta, q_rad)
        tips_m = T_base_flange[:, :3, :3] @ self._point_m + T_base_flange[:, :3, 3]
        lever = -cross_matrix(tips_m)
        by_arm, by_joint = self._arm.twists(self._theta, q_rad), self._arm.joint_twists(self._theta, q_rad)
        slopes = by_arm[:, :3] + lever @ by_arm[:, 3:]
        turns = by_joint[:, :3] + lever @ by_joint[:, 3:]
        joint_rad, seat_m = self._noise
        return tips_m, slopes, joint_rad**2 * turns @ np.swapaxes(turns, 1, 2) + seat_m**2 * np.eye(3)

    def _scatter_m(self) -> float | None:
        squares = [
            float(np.sum((tips_m - tips_m.mean(axis=0)) ** 2)) / (len(readings) - 1)
            for readings in self._cones.values()
            if len(readings) > 1
            for tips_m in [self._tip(readings)[0]]
        ]
        return float(np.sqrt(np.mean(squares))) if squares else None
