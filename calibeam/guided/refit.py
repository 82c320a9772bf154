"""The arm refitted to what a guided session has so far, without the visits that the others speak against.

Data snooping (Baarda, A testing procedure for use in geodetic networks, 1968): of all visits the one whose misfit is
largest by the uncertainty of a fit without it goes first, then the fit is made again. An early reading on the rim was
taken when it could not be recognised, and the fit has bent towards it; left out, all others agree again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.reading import Cone, Reading
from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import BAR
from calibrate.fit.identify.session import instruments_for_fit
from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.solvers import FAR_START, NEAR_START, solve
from calibrate.fit.weighting import Weighting
from calibrate.model.parameters import Parameter, priors
from calibrate.model.sensors import seat

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


def refit_arm(rig: Rig, visits: Sequence[Visit], values: Mapping[str, float]) -> Refit | None:
    """From `values` by name, where there are any; None where no cone was taken twice and no bar at all.

    Of two visits that only contradict each other the later one goes.
    """
    kept, dropped = list(visits), list[Visit]()
    while told := _telling(kept):
        weighting, parameters, start = _prepared(rig, told, values)
        problem = weighting.problem(start).with_parameters(parameters)
        fit = solve(problem, start=start, damping=NEAR_START if values else FAR_START, max_steps=30)
        if not np.all(np.isfinite(fit.covariance)):
            return None
        values = {
            p.name: float(v) for p, v in zip(parameters, fit.theta, strict=True) if not p.name.startswith(seat.POINTS)
        }
        sigmas = _without_itself(problem, weighting, fit.theta, told)
        worst = len(sigmas) - 1 - int(np.argmax(sigmas[::-1]))
        if sigmas[worst] <= LIMIT_SIGMAS or len(dropped) == MOST_DROPPED:
            names = tuple(p.name for p in parameters)
            return Refit(values, names, fit.covariance, tuple(kept), tuple(dropped))
        kept.remove(told[worst])
        dropped.append(told[worst])
    return None


def _telling(visits: Sequence[Visit]) -> list[Visit]:
    """Without cones that were taken once."""
    often: dict[int, int] = {}
    for visit in visits:
        if isinstance(visit[0].target, Cone):
            often[visit[0].target.id] = often.get(visit[0].target.id, 0) + 1
    return [v for v in visits if not isinstance(v[0].target, Cone) or often[v[0].target.id] > 1]


def _prepared(
    rig: Rig, told: Sequence[Visit], values: Mapping[str, float]
) -> tuple[Weighting, tuple[Parameter, ...], Floats]:
    samples = samples_of([reading for visit in told for reading in visit], rig.n_joints)
    weighting = instruments_for_fit(rig, samples).weighting
    parameters = tuple(assumed_prior(p) for p in weighting.parameters)
    return weighting, parameters, np.array([values.get(p.name, p.start) for p in parameters])


def _without_itself(problem: JointProblem, weighting: Weighting, theta: Floats, told: Sequence[Visit]) -> Floats:
    """(visit,) misfit of each in sigmas of its noise and of a fit without it: r' (I - H)^-1 r, root of."""
    visit_of = np.repeat(np.arange(len(told)), [len(visit) for visit in told])
    free = np.flatnonzero([p.free for p in problem.parameters])
    jacobian, residual = problem.jacobian(theta)[:, free], problem.residual(theta)
    information = jacobian.T @ jacobian + np.diag(1.0 / priors(problem.parameters)[free] ** 2)
    hat = np.linalg.solve(information, jacobian.T)
    out, row = np.zeros(len(told)), 0
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
