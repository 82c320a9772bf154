"""How a reading agrees with the arm as known so far: refitted to all that was accepted, by the models of `calibrate`.

Not the identification that is reported: zeros have a wide prior, the probe is held in link n, noise is as assumed.
"""

from collections.abc import Mapping, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.guided.reading import BarEnd, Cone, Doubt, Reading
from acquisition.recording.rig import Rig, Tolerance
from calibeam.guided.refit import LIMIT_SIGMAS, Refit, assumed_prior, refit_arm, visits_of
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.eccentric import with_discs
from calibrate.model.chain import KinematicModel
from calibrate.model.default_tolerance import SCALELESS
from calibrate.model.dual_psd_rig import assumed_noise
from calibrate.model.parameters import values_by_name
from calibrate.model.rigid import cross_matrix
from calibrate.model.sensors.seat import SEAT_BELIEVED_M

Floats = NDArray[np.float64]


class FittedJudge:
    """Implements acquisition.guided.reading.Judge."""

    def __init__(self, rig: Rig) -> None:
        stated = rig.tolerance or Tolerance(length_m=SCALELESS.length_sigma_m, angle_rad=SCALELESS.angle_sigma_rad)
        self._rig = msgspec.structs.replace(rig, tolerance=stated)
        self._arm: KinematicModel = with_discs(arm_of(self._rig), self._rig)
        self._point_m = np.array(rig.tool.point_m or (0.0, 0.0, 0.0))
        self._noise = assumed_noise(rig).joint_rad, rig.noise.seat_m or SEAT_BELIEVED_M
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

    def doubt(self, visit: Sequence[Reading]) -> Doubt | None:
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
        return Doubt(float(np.linalg.norm(miss)), sigmas)

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
