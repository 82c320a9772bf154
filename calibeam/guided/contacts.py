"""What contacts determine so far: a fit of all of them, which reading contradicts the others, which posture is next.

The next posture is the one, of random ones with the ball in the same socket, that lowers the uncertainty of the least
certain joint zero most, by the information that `calibrate.design` counts by: whitened Jacobians under the priors of
the fit (D. Sun, J. Hollerbach, Observability index selection for robot calibration, ICRA 2008). A zero that stays
uncertain however often the candidates are taken is not determined by contacts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.guided.reading import Contact, Reading
from acquisition.guided.touch import FEWEST, Advice
from acquisition.recording.rig import Rig, Tolerance
from acquisition.recording.samples import PLANE, SEAT
from calibeam.guided.judge import ZERO_RAD, assumed_prior, prepared, refit_arm, telling
from calibeam.guided.recorded import AssumedGuidedArm
from calibrate.errors import DataError
from calibrate.fit.solvers import NEAR_START, solve
from calibrate.model.default_tolerance import SCALELESS
from calibrate.model.parameters import Parameter, priors

Floats = NDArray[np.float64]
TOOL_M = 0.01  # how well the ball's place at the flange is known: measured by hand
CANDIDATES = 32
LEAN_RAD = 1.0  # from the mean direction of the tool so far: farther, a stem meets the rim of its socket
SPREAD_RAD = 0.7  # of postures about the last one: a person turns a joint by so much in one go
FAR_RAD = np.pi  # a turn beyond is asked for only where there is no smaller one
NOWHERE = 1_000_000  # number of a seat that no block has
ELSEWHERE = ((0.75, 0.15), (1.1, 0.0))  # of the place: nearer and higher (m), farther
OFTEN = 1e3  # times every candidate: what is uncertain then, stays so; more would drown the priors in rounding
OPEN = 0.5  # of the prior sigma: a zero that is no better known is not determined
TURN_RAD = 0.15  # smaller turns are not asked for
SEATED = 5.0  # sigmas of the stated seat: no contradiction to the others
NEARER = 4.0  # a reading belongs to another seat that it is nearer to by this factor


def contact_prior(p: Parameter) -> Parameter:
    """As that of a measuring arm; but the ball's place at the flange is found."""
    return replace(p, free=True, prior=TOOL_M) if p.name.startswith("tool.") else assumed_prior(p)


class ContactJudge:
    """Implements acquisition.guided.touch.TouchJudge. `enough_rad`: one sigma of a joint zero that is good enough."""

    def __init__(self, rig: Rig, enough_rad: float, rng: np.random.Generator) -> None:
        stated = rig.tolerance or Tolerance(length_m=SCALELESS.length_sigma_m, angle_rad=SCALELESS.angle_sigma_rad)
        self._rig = msgspec.structs.replace(rig, tolerance=stated)
        self._enough_rad, self._rng = enough_rad, rng
        self._values: Mapping[str, float] = {}
        self._kept: list[Reading] = []
        self._fitted = True  # False: the readings so far can not be fitted
        self._reported: list[Reading] = []

    def learn(self, readings: Sequence[Reading]) -> tuple[str, ...]:
        try:
            fit, trouble = refit_arm(self._rig, [(one,) for one in readings], self._values, contact_prior), ()
        except DataError as error:  # touches of a plane on one line, so far
            fit, trouble = None, (str(error),)
        if fit is None:
            self._kept, self._fitted = list(readings), not trouble
            return trouble
        self._fitted = True
        self._values = fit.values
        dropped = [visit[0] for visit in fit.dropped]
        self._kept = [one for one in readings if not _within(one, dropped)]
        new = [one for one in dropped if not _within(one, self._reported)]
        self._reported = dropped
        return tuple(filter(None, (self._contradiction(one, readings) for one in new)))

    def advice(self, contact: Contact, readings: Sequence[Reading]) -> Advice:
        here = [one for one in self._kept if one.target == contact]
        if not here:
            return Advice("bring the ball there in any posture")
        if not self._fitted or (contact.kind == PLANE and len(here) < FEWEST[PLANE]):
            return Advice("touch it elsewhere, with the tool leaning another way")
        candidates = self._candidates(contact, here)
        elsewhere = self._elsewhere(here) if contact.kind == SEAT else []
        used = telling([(one,) for one in (*self._kept, *candidates, *elsewhere)])
        if not candidates or not any(visit[0] is candidates[0] for visit in used):
            return Advice("touch it elsewhere, with the tool leaning another way")
        imagined = [visit[0] for visit in used if not _within(visit[0], self._kept)]
        joints, sigmas, by_candidate = self._uncertainty(used, imagined, len(candidates))
        shown = [k for k, found in enumerate(by_candidate.hidden) if not found]
        unseen = tuple(sorted({*range(1, self._rig.n_joints + 1)} - {joints[k] for k in shown}))
        if not shown:
            return Advice("turn any joint", open_joints=unseen)
        worst = max(shown, key=lambda k: float(sigmas[k]))
        best = candidates[int(np.argmin(by_candidate.sigmas[:, worst]))]
        says = f"joint {joints[worst]} is the least certain ({1e3 * sigmas[worst]:.2g} mrad): "
        says += turns(best.q_rad - readings[-1].q_rad)
        enough = bool(max(sigmas[k] for k in shown) <= self._enough_rad)
        return Advice(says, tuple(best.q_rad.tolist()), enough, unseen)

    def _candidates(self, contact: Contact, here: Sequence[Reading]) -> list[Reading]:
        """Random postures with the ball where it was, the tool leaning not much farther than so far."""
        arm, q_rad = self._arm(), np.array([one.q_rad for one in here])
        found_rad = self._postures(arm, arm.tip_m(q_rad).mean(axis=0), q_rad[-1])
        mean = _directions(arm, q_rad).mean(axis=0)
        leans = _directions(arm, found_rad) @ (mean / np.linalg.norm(mean)) >= np.cos(LEAN_RAD)
        near = leans & (np.abs(found_rad - q_rad[-1]).max(axis=1) <= FAR_RAD)
        return [Reading(contact, one, 0.0, 0.0) for one in found_rad[near if near.any() else leans]]

    def _elsewhere(self, here: Sequence[Reading]) -> list[Reading]:
        """Postures in sockets that stand elsewhere: what one place does not show, others may."""
        arm, q_rad = self._arm(), np.array([one.q_rad for one in here])
        point_m = arm.tip_m(q_rad).mean(axis=0)
        return [
            Reading(Contact(SEAT, NOWHERE + k, "elsewhere"), one, 0.0, 0.0)
            for k, (scale, up_m) in enumerate(ELSEWHERE)
            for one in self._postures(arm, scale * point_m + np.array([0.0, 0.0, up_m]), q_rad[-1])
        ]

    def _postures(self, arm: AssumedGuidedArm, point_m: Floats, last_rad: Floats) -> Floats:
        """(some, n) with the ball at the point (3,), half of them about the last one; no whole turns from it."""
        starts_rad = self._rng.uniform(arm.lower_rad, arm.upper_rad, (CANDIDATES, arm.n_joints))
        starts_rad[::2] = last_rad + self._rng.normal(0.0, SPREAD_RAD, (len(starts_rad[::2]), arm.n_joints))
        found_rad = arm.postures(starts_rad, point_m)
        turn = 2.0 * np.pi
        near_rad = found_rad - turn * np.round((found_rad - last_rad) / turn)
        inside = (near_rad >= arm.lower_rad) & (near_rad <= arm.upper_rad)
        return np.where(inside, near_rad, found_rad)

    def _uncertainty(
        self, used: Sequence[tuple[Reading, ...]], imagined: Sequence[Reading], count: int
    ) -> tuple[list[int], Floats, "_ByCandidate"]:
        """Joint numbers, sigma (joint,) of their zeros now, and what each of the first `count` imagined readings, or
        all of them taken often, would make of them.
        """
        weighting, parameters, start = prepared(self._rig, used, self._values, contact_prior)
        problem = weighting.problem(start).with_parameters(parameters)
        free = np.flatnonzero([p.free for p in parameters])
        # The sockets start at the mean of nominal tips: off by millimetres, a turn of the whole would seem to be seen.
        jacobian = problem.jacobian(solve(problem, start=start, damping=NEAR_START, max_steps=5).theta)[:, free]
        prior = np.diag(1.0 / priors(parameters)[free] ** 2)
        zeros = [k for k, at in enumerate(free) if parameters[at].name.endswith(".zero")]
        joints = [int(parameters[free[k]].name.removeprefix("joint").removesuffix(".zero")) for k in zeros]
        rows: dict[int, slice] = {}
        row = 0
        for measured in weighting.measured:
            width = measured.problem.observed.shape[1]
            for samples in measured.sample_rows:
                rows[int(samples[0])], row = slice(row, row + width), row + width
        of = {id(one): rows[k] for k, (one, *_) in enumerate(used)}
        slopes = [jacobian[of[id(one)]] for one in imagined]
        shown = sum(slope.T @ slope for slope in slopes)
        covariance = np.linalg.inv(prior + jacobian.T @ jacobian - shown)
        at_last = np.linalg.inv(prior + jacobian.T @ jacobian + OFTEN * shown)
        then = []
        for slope in slopes[:count]:
            gain = covariance[zeros] @ slope.T
            square = slope @ covariance @ slope.T + np.eye(len(slope))
            then.append(np.diag(covariance)[zeros] - np.sum(gain * np.linalg.solve(square, gain.T).T, axis=1))
        hidden = np.sqrt(np.diag(at_last)[zeros]) > OPEN * ZERO_RAD
        return joints, np.sqrt(np.diag(covariance)[zeros]), _ByCandidate(np.array(then), hidden)

    def _arm(self) -> AssumedGuidedArm:
        """As fitted so far."""
        arm = AssumedGuidedArm.of_rig(self._rig, self._values)
        return replace(arm, point_m=arm.point_m + np.array([self._values.get(f"tool.{axis}", 0.0) for axis in "xyz"]))

    def _contradiction(self, one: Reading, readings: Sequence[Reading]) -> str:
        tips_m = self._arm().tip_m(np.array([other.q_rad for other in readings]))
        own_m = tips_m[next(k for k, other in enumerate(readings) if other is one)]
        apart_m: dict[Contact, float] = {}
        for contact in {other.target for other in self._kept if isinstance(other.target, Contact)}:
            if contact.kind == SEAT:
                rows = [k for k, other in enumerate(readings) if other.target == contact and _within(other, self._kept)]
                apart_m[contact] = float(np.linalg.norm(own_m - tips_m[rows].mean(axis=0)))
        number = 1 + next(k for k, other in enumerate(readings) if other is one)
        text = f"reading {number} contradicts the others of {one.target.says}"
        if isinstance(one.target, Contact) and one.target in apart_m:
            miss_m = apart_m.pop(one.target)
            if miss_m < SEATED * (self._rig.noise.seat_m or 0.0):
                return ""  # a fit of few readings leaves out what is as well seated as stated
            text += f", by {1e3 * miss_m:.1f} mm"
            nearest = min(apart_m, key=lambda contact: apart_m[contact], default=None)
            if nearest is not None and NEARER * apart_m[nearest] < miss_m:
                return f"{text}; it fits {nearest.says}: was the ball in that socket? u takes it back"
        return f"{text}: was the ball seated? u takes it back"


class _ByCandidate:
    """`sigmas` (candidate, joint): variances of the zeros with it; `hidden` (joint,)."""

    def __init__(self, sigmas: Floats, hidden: NDArray[np.bool_]) -> None:
        self.sigmas, self.hidden = sigmas, hidden


def turns(way_rad: Floats) -> str:
    """The two largest turns, in words for a person."""
    order = np.argsort(-np.abs(way_rad))[:2]
    parts = [f"joint {k + 1} by about {np.degrees(way_rad[k]):+.0f}°" for k in order if abs(way_rad[k]) >= TURN_RAD]
    return "turn " + " and ".join(parts) if parts else "lean the tool another way"


def _directions(arm: AssumedGuidedArm, q_rad: Floats) -> Floats:
    """(row, 3) the flange's axis in the base."""
    return arm.frames(q_rad)[:, -1, :3, 2]


def _within(one: Reading, many: Sequence[Reading]) -> bool:
    return any(one is other for other in many)
