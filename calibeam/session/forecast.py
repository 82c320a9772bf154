"""What a session's samples tell so far, and how many more of its poses make it accurate enough.

The error is that of the beam in free space, as the covariance of the fit so far predicts it: the same fit, noise and
target as identification and pose design have (calibrate/identification, calibrate/pose_design), at the values and
under the noise found so far. What these samples cannot tell is said instead of a number.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import SPOTS, per_joint
from acquisition.sample import Sample
from calibrate.arms.catalogue import arm_of
from calibrate.fit import Status
from calibrate.identifiability import Identifiability, analyse
from calibrate.identification.rounds import Fitted, coarse_start, settled_fit
from calibrate.identification.session import instruments_for_fit
from calibrate.parameters import Parameter, index_of, priors, start_values
from calibrate.pose_design.candidates import Candidates
from calibrate.pose_design.information import NO_OPINION, Information
from calibrate.pose_design.target import target_of
from calibrate.read_samples import SIGMA_COLUMNS
from calibrate.uncertainty.free_space import FELT_M
from calibrate.variance import VarianceFactors

Floats = NDArray[np.float64]

SEED = 1  # of the poses over which free space is looked at: always the same, so that only the samples change the number
LARGEST_M = 1e-2  # a prediction beyond this is no number that a straight-line covariance can give


@dataclass(frozen=True)
class Forecast:
    """Lengths are rms, one sigma of the identified geometry, as in `calibeam design`."""

    samples: int
    goal_m: float
    now_m: float | None = None  # None: not determined, see `why`
    more: int | None = None  # poses of the plan until the goal, 0: reached; None: not by this plan
    end_m: float | None = None  # when all of the plan is taken
    why: str = ""  # nothing can be said yet
    corrections: dict[str, float] | None = None  # fitted values by parameter name

    @property
    def says(self) -> str:
        """One sentence for a person."""
        if self.now_m is None:
            return f"not determined yet: {self.why}"
        now, goal = _microns(self.now_m), _microns(self.goal_m)
        if self.more == 0:
            return f"{now}: under {goal}"
        if self.more is not None:
            return f"{now}; {self.more} more poses bring it under {goal}"
        end = "" if self.end_m is None else f"; the whole plan brings it to {_microns(self.end_m)}, not under {goal}"
        return f"{now}{end}"


def forecast(rig: Rig, taken: list[Sample], ahead: Candidates, goal_m: float) -> Forecast:
    """Of samples taken, and poses still to be taken in this order. A fit that fails is told, never raised."""
    nothing = Forecast(len(taken), goal_m)
    if not taken:
        return replace(nothing, why="no pose yet")
    rows = _table(taken, ahead)
    try:
        fitted = _fitted(rig, rows.take(np.arange(len(taken))))
        if fitted.fit.status is Status.NOT_FINITE or not np.all(np.isfinite(fitted.fit.theta)):
            return replace(nothing, why="the fit of these poses comes to no end")
        return _told(rig, rows, fitted, nothing)
    except np.linalg.LinAlgError:
        return replace(nothing, why="these poses are too few, or too alike")


def _told(rig: Rig, rows: Samples, fitted: Fitted, nothing: Forecast) -> Forecast:
    """The numbers, or why there is none."""
    names = {p.name: float(v) for p, v in zip(fitted.fit.parameters, fitted.fit.theta, strict=True)}
    found, seen, felt_m = _information(rig, rows, names, fitted.factors, nothing.samples)
    open_ = [c.plain for c, m in zip(reversed(seen.combinations), felt_m[::-1], strict=False) if m > FELT_M]
    if np.any(felt_m > FELT_M):
        return replace(nothing, why=_short(open_, int(np.sum(felt_m > FELT_M))), corrections=names)
    error_m = _falling(found, nothing.samples)
    if not error_m[0] <= LARGEST_M:
        return replace(nothing, why="these poses tell too little", corrections=names)
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
    parameters = tuple(_believed(every[i]) for i in free)
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
        np.zeros((len(free), 0)),  # what nothing shows and moves the target forbids a number: `seen` tells
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


def _fitted(rig: Rig, samples: Samples) -> Fitted:
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


def _believed(p: Parameter) -> Parameter:
    """As in a design: nobody's opinion is many plausible sizes."""
    return p if np.isfinite(p.prior) else replace(p, prior=NO_OPINION * p.plausible)


def _short(combinations: list[str], count: int) -> str:
    first = combinations[0] if combinations else "too few poses"
    return first if count <= 1 else f"{first}, and {count - 1} more"


def _microns(length_m: float) -> str:
    return f"{1e6 * length_m:.3g} um" if length_m < 1e-3 else f"{1e3 * length_m:.2g} mm"
