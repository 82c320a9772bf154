"""Tool calibration by turning one axis at a time: circles, axis lines, flange, and the targets from the wrist's rows.

Source: patent CN114523474B, step 3. The circles of the last two joints place the flange, hence a start for the targets
in it; these are then fitted to the rows in which the joints before the last two stand still (wrist_fit.py).

The frame on the two axis lines: origin at the foot, on the last axis, of the common normal of both; z along the last
axis; x across it in the direction of the axis before. The arm's table gives the flange in that frame; lines alone do
not determine the flange's face. It is the start of the fit, which gives the flange with its uncertainty.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.fit.rank import analyse
from calibrate.fit.solvers import Status
from calibrate.model.chain import KinematicModel
from calibrate.model.parameters import hold
from calibrate.model.rigid import cross, inverse
from calibrate.tool_axes.arm_prior import ArmPrior
from calibrate.tool_axes.circle import (
    SHORTEST_RAD,
    STILL_RAD,
    AxisFound,
    Circle,
    fit_circle,
    single_axis_segments,
    wrist,
)
from calibrate.tool_axes.orientation import (
    FlangeSeen,
    Orientation,
    flange_seen,
    orientation_of,
)
from calibrate.tool_axes.wrist_fit import (
    AxisNoise,
    SeenOverPrior,
    TargetRows,
    WristFit,
    WristProblem,
    other_rows_witness,
    target_names,
    wrist_witness,
)

Floats = NDArray[np.float64]

PARALLEL = 0.17  # sine of 10 deg: nearer to parallel, the foot of the common normal runs away along the axis


def flange_frame(arm: KinematicModel, theta: Floats, before: Circle, last: Circle, q_rad: Floats) -> Floats:
    """(4, 4) T_device_flange at `q_rad` (joint,) from the circles of the last two joints, for an arm `theta` (param,).

    Both circles were taken at these readings of the joints before them. DataError for near-parallel axes.
    """
    lines = _frame(before.centre_m, before.normal, last.centre_m, last.normal)
    return lines @ _in_lines(arm, theta, q_rad)


def _in_lines(arm: KinematicModel, theta: Floats, q_rad: Floats) -> Floats:
    """(4, 4) T_line_flange of the arm."""
    q = q_rad[None]
    twists = arm.joint_twists(theta, q)[0]  # (6, joint): [v; w] of each axis, whose nearest point to the base is w x v
    lines = [(cross(w, v), w) for v, w in ((t[:3], t[3:]) for t in twists.T[-2:])]
    return inverse(_frame(*lines[0], *lines[1])) @ arm.flange(theta, q)[0]


def _frame(point_before: Floats, before: Floats, point_last: Floats, last: Floats) -> Floats:
    normal = cross(before, last)
    sine = float(np.linalg.norm(normal))
    if sine < PARALLEL:
        raise DataError(f"flange frame: the last two axes are {np.degrees(np.arcsin(sine)):.1f}° from parallel")
    # foot on the last axis: point_last + t last, with (foot - point_before) square to (before x last) x before
    across = cross(normal, before)
    t = float((point_before - point_last) @ across / (last @ across))
    y = normal / -sine  # z x x with x the direction of `before` across z
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2] = cross(y, last), y, last
    T[:3, 3] = point_last + t * last
    return T


Indices = NDArray[np.intp]

# Beyond this multiple of the prior the recording does not belong to this arm, or the prior does not: wrong joint signs,
# another table. A scale that a few combinations of parameters show would then carry all of the uncertainty.
REFUSED = 5.0
# The last two axes look the same from a wrist that counts the other way: its target is the mirrored one, and fits.
UNCHECKED = (
    "only the last two joints turn, so a wrong sign of one of them would not be noticed; turn a joint before them, too"
)
OTHER_ARM = "check the arm's table and the joint signs, or state larger errors of the arm"


@dataclass(frozen=True)
class TargetFound:
    """One target: where it was measured, and its point in the flange with one sigma; None where not determined."""

    rows: TargetRows
    axes: tuple[AxisFound, ...]
    used: Indices  # of `rows`: in which only the wrist turns
    by_axes_m: Floats  # (3,) from the axis lines of the nominal arm alone
    point_m: Floats | None  # (3,) in the flange
    sigma_m: Floats | None  # (3,) of all sources
    instrument_sigma_m: Floats | None  # (3,) the measuring device's part of it
    arm_sigma_m: Floats | None  # (3,) the arm's part of it


@dataclass(frozen=True)
class ToolCalibration:
    """The targets in the flange, and what they were found from."""

    status: Status
    why: str | None  # why nothing is determined
    cautions: tuple[str, ...]  # what speaks for care
    targets: tuple[TargetFound, ...]
    orientation: Orientation | None
    orientation_why: str | None
    flange: FlangeSeen | None
    prior: ArmPrior  # as used
    widened: float  # factor of the prior's sigmas
    noise: AxisNoise
    other_rows: int
    other_rms_m: float | None  # of a coordinate, in the rows that took no part; None: there are none

    @property
    def trust(self) -> str:
        """On the scale of trust of all reports."""
        if self.why is not None:
            return "no"
        return "with care" if self.cautions else "yes"


@dataclass(frozen=True)
class _Begun:
    """A target with its circles and its rows of the wrist."""

    rows: TargetRows
    axes: tuple[AxisFound, ...]
    last: AxisFound
    T_device_flange: Floats  # (4, 4) at the readings of `last`, from the axis lines
    used: Indices


def calibrate_tool(arm: KinematicModel, targets: Sequence[TargetRows], prior: ArmPrior) -> ToolCalibration:
    """From the readings of one or more targets of one tool, seen by one device in a frame of its own.

    DataError for a target without the rotations it needs.
    """
    begun = tuple(_begin(arm, prior, target) for target in targets)
    T_base_device = _base_device(arm, prior, begun[0])
    start_m = np.array([_in_flange(arm, prior, b, T_base_device) for b in begun])
    used = tuple(b.rows.select(b.used) for b in begun)
    others = tuple(b.rows.select(np.setdiff1d(np.arange(len(b.rows.q_rad)), b.used)) for b in begun)
    scatter_m = float(np.median([a.circle.scatter_m for b in begun for a in b.axes]))
    problem = WristProblem.of(arm, prior.mean, used, start_m, T_base_device)
    found = problem.fit(prior, problem.noise(prior, scatter_m))
    witnesses, other_rms_m = _witnesses(found, others, T_base_device)
    widened = max((w.ratio for w, _ in witnesses if w.contradicts), default=1.0)
    why = _undetermined(found, witnesses)
    if why is None and widened > 1.0:
        found = problem.fit(prior.scaled(widened), found.noise)
        why = _undetermined(found, ())
    factor = f"the assumed uncertainties of the arm are multiplied by {widened:.1f}"
    cautions = (
        *(f"{says}; {factor}" for w, says in witnesses if w.contradicts),
        *(() if any(map(_moved_farther, begun)) else (UNCHECKED,)),
    )
    points = tuple(_found(found, k, b, start_m[k], why is None) for k, b in enumerate(begun))
    turn = "its point is not determined" if why else orientation_of(found, used, _points(found, begun, start_m))
    return ToolCalibration(
        Status.RANK_DEFICIENT if why and found.fit.status is Status.CONVERGED else found.fit.status,
        why,
        cautions if why is None else (),
        points,
        None if isinstance(turn, str) else turn,
        turn if isinstance(turn, str) else None,
        None if why else flange_seen(found, T_base_device, begun[0].last.segment.held(begun[0].rows.q_rad)),
        found.prior,
        widened if why is None else 1.0,
        found.noise,
        sum(len(o.q_rad) for o in others),
        other_rms_m,
    )


def _begin(arm: KinematicModel, prior: ArmPrior, target: TargetRows) -> _Begun:
    q_rad = target.q_rad
    axes = tuple(
        AxisFound(s, fit_circle(target.position_m[s.rows], q_rad[s.rows, s.joint - 1]))
        for s in single_axis_segments(q_rad)
    )
    before, last = wrist(axes, q_rad, lambda row: int(target.in_file[row]) + 1)
    held = last.segment.held(q_rad)
    away = np.abs(q_rad - held)[:, : q_rad.shape[1] - 2]
    used = np.flatnonzero(np.all(away <= STILL_RAD, axis=1))
    return _Begun(target, axes, last, flange_frame(arm, prior.mean, before.circle, last.circle, held), used)


def _moved_farther(begun: _Begun) -> bool:
    """Whether a joint before the wrist turned far enough to check the signs."""
    q_rad = begun.rows.q_rad
    away = np.abs(q_rad - begun.last.segment.held(q_rad))[:, : q_rad.shape[1] - 2]
    return bool(np.any(away >= SHORTEST_RAD))


def _base_device(arm: KinematicModel, prior: ArmPrior, begun: _Begun) -> Floats:
    held = begun.last.segment.held(begun.rows.q_rad)
    return arm.flange(prior.mean, held[None])[0] @ inverse(begun.T_device_flange)


def _in_flange(arm: KinematicModel, prior: ArmPrior, begun: _Begun, T_base_device: Floats) -> Floats:
    """(3,) mean of the target in the flange over the last joint's rotation."""
    rows = begun.last.segment.rows
    T = inverse(arm.flange(prior.mean, begun.rows.q_rad[rows])) @ T_base_device
    return (np.einsum("nij,nj->ni", T[:, :3, :3], begun.rows.position_m[rows]) + T[:, :3, 3]).mean(axis=0)


def _witnesses(
    found: WristFit, others: tuple[TargetRows, ...], T_base_device: Floats
) -> tuple[tuple[tuple[SeenOverPrior, str], ...], float | None]:
    """What speaks about the size of the arm's errors, each in a sentence, and the rms of the rows without part."""
    if not np.all(np.isfinite(found.fit.covariance)):
        return (), None
    out: list[tuple[SeenOverPrior, str]] = []
    axes = wrist_witness(found)
    if axes is not None:
        says = f"the last two axes differ from the arm's table by {axes.ratio:.1f} times the assumed uncertainty"
        out.append((axes, says))
    rest = other_rows_witness(found, others, T_base_device)
    if rest is not None:
        says = (
            f"the rows in which other joints moved differ from the arm by {1e3 * rest[1]:.2g} mm rms, "
            f"{rest[0].ratio:.1f} times the assumed uncertainty"
        )
        out.append((rest[0], says))
    return tuple(out), None if rest is None else rest[1]


def _undetermined(found: WristFit, witnesses: tuple[tuple[SeenOverPrior, str], ...]) -> str | None:
    fit = found.fit
    if fit.status is not Status.CONVERGED or not np.all(np.isfinite(fit.covariance)):
        return fit.status.value
    arm = [p.name for p in found.arm.parameters]  # known to its prior; what the rows determine beside it is asked here
    seen = analyse(found.problem.jacobian(fit.theta)[: found.data_rows], hold(found.problem.parameters, arm))
    if seen.combinations:
        return "; ".join(c.says for c in seen.combinations)
    refused = [says for w, says in witnesses if w.contradicts and w.ratio > REFUSED]
    return f"{'; '.join(refused)}: {OTHER_ARM}" if refused else None


def _points(found: WristFit, begun: tuple[_Begun, ...], start_m: Floats) -> Floats:
    """(target, 3) in the flange."""
    names = (target_names(b.rows.number)[:3] for b in begun)
    return np.array([start_m[k] + found.fit.theta[found.columns(n)] for k, n in enumerate(names)])


def _found(found: WristFit, k: int, begun: _Begun, start_m: Floats, determined: bool) -> TargetFound:
    if not determined:
        return TargetFound(begun.rows, begun.axes, begun.used, start_m, None, None, None, None)
    columns = found.columns(target_names(begun.rows.number)[:3])
    variance = np.diag(found.fit.covariance)[columns]
    instrument = np.diag(found.covariance_of_exact_arm())[columns]
    return TargetFound(
        begun.rows,
        begun.axes,
        begun.used,
        start_m,
        start_m + found.fit.theta[columns],
        np.sqrt(variance),
        np.sqrt(instrument),
        np.sqrt(np.maximum(variance - instrument, 0.0)),
    )
