"""Circles of a target while one joint turns: the rows where only one turns, the fit, and the pair that places a flange.

The circle is the least-squares fit of the distances out of its plane and from its radius. The joint's readings give
only the sense of turning, so gear and encoder errors do not bend the axis.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.fit.rank import analyse
from calibrate.fit.solvers import Status, solve
from calibrate.model.parameters import Parameter
from calibrate.model.rigid import cross

Floats = NDArray[np.float64]

NAMES = ("circle.x", "circle.y", "circle.z", "circle.tilt_u", "circle.tilt_v", "circle.radius")


@dataclass(frozen=True)
class Circle:
    """Axis line (centre, normal) and radius."""

    status: Status
    centre_m: Floats  # (3,)
    normal: Floats  # (3,) unit; the motion is right-handed about it
    radius_m: float
    across: Floats  # (2, 3) unit vectors u, v in the plane; tilts turn the normal towards them
    covariance: Floats  # (6, 6) of centre, tilt u, tilt v, radius; nan where these points do not determine them
    scatter_m: float  # of one coordinate, from the residuals
    dof: int

    @property
    def centre_sigma_m(self) -> Floats:
        """(3,) of the centre."""
        return np.sqrt(np.diag(self.covariance)[:3])

    @property
    def normal_sigma_rad(self) -> float:
        """The larger of both tilts."""
        return float(np.sqrt(np.diag(self.covariance)[3:5].max()))

    @property
    def radius_sigma_m(self) -> float:
        return float(np.sqrt(self.covariance[5, 5]))

    def moved(self, change: Floats) -> "Circle":
        """The circle after small changes (6,) of centre, tilts and radius."""
        normal = self.normal + change[3:5] @ self.across
        normal = normal / np.linalg.norm(normal)
        return Circle(
            self.status,
            self.centre_m + change[:3],
            normal,
            self.radius_m + float(change[5]),
            self.across,
            self.covariance,
            self.scatter_m,
            self.dof,
        )


def fit_circle(points_m: Floats, angle_rad: Floats) -> Circle:
    """Circle through points (point, 3) that a joint at readings (point,) swept. DataError for fewer than 5 points.

    Start: plane by the smallest singular vector, centre by Kasa's linear equations |p|^2 = 2 p.c + k (Kasa, IEEE Trans.
    Instrum. Meas. 25(1), 1976); then geometric least squares. Uncertainty from the residuals' own scatter.
    """
    if len(points_m) < 5:
        raise DataError(f"circle: {len(points_m)} points; at least 5 are needed to fit it and to estimate its noise")
    start = _start(points_m, angle_rad)
    parameters = tuple(
        Parameter(n, "rad" if "tilt" in n else "m", 0.1 if "tilt" in n else max(start.radius_m, 1e-3)) for n in NAMES
    )
    points = _Points(parameters, points_m, start, max(start.radius_m, 1e-3) * 1e-6)
    fit = solve(points, max_steps=200)
    dof = fit.dof
    scale = fit.chi2 / dof  # residuals are whitened by a nominal size only: their scatter is the noise
    seen = analyse(points.jacobian(fit.theta) / np.sqrt(max(scale, 1e-30)), parameters)
    status = Status.RANK_DEFICIENT if fit.status is Status.CONVERGED and seen.combinations else fit.status
    covariance = fit.covariance * scale if status is Status.CONVERGED else np.full((6, 6), np.nan)
    end = start.moved(fit.theta)
    scatter_m = points.size_m * float(np.sqrt(scale))
    return Circle(status, end.centre_m, end.normal, end.radius_m, start.across, covariance, scatter_m, dof)


def _start(points_m: Floats, angle_rad: Floats) -> Circle:
    middle = points_m.mean(axis=0)
    flat = points_m - middle
    u, v, normal = np.linalg.svd(flat, full_matrices=True)[2]
    x, y = flat @ u, flat @ v
    rows = np.stack([2.0 * x, 2.0 * y, np.ones_like(x)], axis=1)
    a, b, k = np.linalg.lstsq(rows, x**2 + y**2, rcond=None)[0].tolist()
    centre = middle + a * u + b * v
    spoke = points_m - centre
    order = np.argsort(angle_rad)
    sense = float(np.sum(cross(spoke[order][:-1], spoke[order][1:]) @ normal))
    if sense < 0.0:
        normal, v = -normal, -v
    radius_m = float(np.sqrt(max(k + a * a + b * b, 0.0)))
    unknown = np.full((6, 6), np.nan)
    return Circle(Status.CONVERGED, centre, normal, radius_m, np.stack([u, v]), unknown, float("nan"), 0)


@dataclass(frozen=True)
class _Points:
    """LeastSquares of points about a circle: out of plane, and off the radius."""

    parameters: tuple[Parameter, ...]
    points_m: Floats
    start: Circle
    size_m: float  # whitens; the real noise is shown by the residuals

    def residual(self, theta: Floats) -> Floats:
        circle, spoke, out = self._seen(theta)
        inside = spoke - out[:, None] * circle.normal
        return np.stack([out, np.linalg.norm(inside, axis=1) - circle.radius_m], axis=1).ravel() / self.size_m

    def jacobian(self, theta: Floats) -> Floats:
        circle, spoke, out = self._seen(theta)
        inside = spoke - out[:, None] * circle.normal
        length = np.linalg.norm(inside, axis=1)
        J = np.zeros((len(spoke), 2, 6))
        J[:, 0, :3], J[:, 1, :3] = -circle.normal, -inside / length[:, None]
        J[:, 0, 3:5] = spoke @ self._normal_by_tilt(theta)
        J[:, 1, 3:5] = -(out / length)[:, None] * J[:, 0, 3:5]
        J[:, 1, 5] = -1.0
        return J.reshape(-1, 6) / self.size_m

    def _seen(self, theta: Floats) -> tuple[Circle, Floats, Floats]:
        circle = self.start.moved(theta)
        spoke = self.points_m - circle.centre_m
        return circle, spoke, spoke @ circle.normal

    def _normal_by_tilt(self, theta: Floats) -> Floats:
        """(3, 2) derivative of the unit normal, which `moved` brings back to length 1."""
        raw = self._raw_normal + theta[3:5] @ self.start.across
        length = np.linalg.norm(raw)
        unit = raw / length
        return ((np.eye(3) - np.outer(unit, unit)) @ self.start.across.T) / length

    @cached_property
    def _raw_normal(self) -> Floats:
        return self.start.normal


STILL_RAD = 2e-4  # a standing axis scatters by its repeatability, 1e-5 rad class; a deliberate step is far more
FEWEST = 5  # rows: a circle has 6 unknowns and 2 equations a point, which leaves 4 to show its noise
SHORTEST_RAD = 0.35  # 20 deg of arc: below, centre and radius trade against each other


@dataclass(frozen=True)
class Segment:
    """Consecutive rows over which one joint turns and all others stand."""

    joint: int  # counted from 1
    rows: NDArray[np.intp]

    def held(self, q_rad: Floats) -> Floats:
        """(joint,) mean readings over the segment."""
        return q_rad[self.rows].mean(axis=0)

    def span_rad(self, q_rad: Floats) -> float:
        """How far the joint turns."""
        return float(np.ptp(q_rad[self.rows, self.joint - 1]))


def single_axis_segments(q_rad: Floats) -> tuple[Segment, ...]:
    """The longest runs of rows (row, joint) in which one joint alone moves, in order; neighbours may share a row."""
    return tuple(run for run in _runs(q_rad) if _usable(run, q_rad))


def too_short(q_rad: Floats) -> tuple[Segment, ...]:
    """Runs in which one joint alone moves, but over too few rows or too short an arc for a circle."""
    return tuple(run for run in _runs(q_rad) if not _usable(run, q_rad))


def _usable(run: Segment, q_rad: Floats) -> bool:
    return len(run.rows) >= FEWEST and run.span_rad(q_rad) >= SHORTEST_RAD


def _runs(q_rad: Floats) -> tuple[Segment, ...]:
    """Every run of at least three rows in which one joint moves, the longest at each place."""
    found: list[Segment] = []
    first = 0
    while first < len(q_rad) - 1:
        best = max((_run(q_rad, first, joint) for joint in range(q_rad.shape[1])), key=lambda run: len(run.rows))
        if len(best.rows) > 2 and best.span_rad(q_rad) > STILL_RAD:
            found.append(best)
            first = int(best.rows[-1])
        else:
            first += max(1, len(best.rows) // 8)  # what stands for long is not looked at from every row
    return tuple(found)


def _run(q_rad: Floats, first: int, joint: int) -> Segment:
    end, length = len(q_rad), 64  # rows that are looked at, ever more: a run is far shorter than a recording
    while length == 64 or first + length < 8 * len(q_rad):
        others = np.delete(q_rad[first : first + length] - q_rad[first], joint, axis=1)
        moved = np.any(np.abs(others) > STILL_RAD, axis=1)
        if moved.any():
            end = first + int(np.argmax(moved))
            break
        length *= 8
    return Segment(joint + 1, np.arange(first, end))


@dataclass(frozen=True)
class AxisFound:
    """One joint's axis in the device's frame."""

    segment: Segment
    circle: Circle


def wrist(axes: Sequence[AxisFound], q_rad: Floats, row_of: Callable[[int], int]) -> tuple[AxisFound, AxisFound]:
    """Rotations of the last two joints, taken with the joints before them at the same readings.

    `row_of` states which row of the file, from 1, a row of `q_rad` is. DataError where they are missing or bad.
    """
    n = q_rad.shape[1]
    apart: list[str] = []
    for last in (a for a in axes if a.segment.joint == n):
        for before in (a for a in axes if a.segment.joint == n - 1):
            between = np.abs(last.segment.held(q_rad) - before.segment.held(q_rad))[: n - 2]
            if np.all(between <= STILL_RAD):
                _refuse_bad(before, row_of)
                _refuse_bad(last, row_of)
                return before, last
            joint = int(np.argmax(between)) + 1
            apart.append(
                f"joint {joint} stands {np.degrees(between[joint - 1]):.2g}° apart between "
                f"{rows_said(before.segment, row_of)} and {rows_said(last.segment, row_of)}"
            )
    raise DataError(
        f"tool by single axes: rotations of joint {n - 1} alone and {n} alone are needed, joints 1 to {n - 2} at "
        f"the same readings; {_what_there_is(axes, q_rad, row_of, apart)}"
    )


def rows_said(segment: Segment, row_of: Callable[[int], int]) -> str:
    """'rows 12-26'."""
    return f"rows {row_of(int(segment.rows[0]))}-{row_of(int(segment.rows[-1]))}"


def _what_there_is(axes: Sequence[AxisFound], q_rad: Floats, row_of: Callable[[int], int], apart: Sequence[str]) -> str:
    """What was found instead, and which of it nearly would have done."""
    if apart:
        return "; ".join(apart)
    turned = ", ".join(f"{a.segment.joint} ({rows_said(a.segment, row_of)})" for a in axes) or "none"
    n = q_rad.shape[1]
    short = [
        f"joint {s.joint} alone turns only {np.degrees(s.span_rad(q_rad)):.3g}° in {len(s.rows)} rows "
        f"({rows_said(s, row_of)})"
        for s in too_short(q_rad)
        if s.joint in (n - 1, n)
    ]
    needed = f"; {np.degrees(SHORTEST_RAD):.0f}° and {FEWEST} rows are needed" if short else ""
    return "; ".join([f"found single rotations of joint {turned}", *short]) + needed


def _refuse_bad(axis: AxisFound, row_of: Callable[[int], int]) -> None:
    if axis.circle.status is not Status.CONVERGED:
        raise DataError(
            f"circle of joint {axis.segment.joint}, {rows_said(axis.segment, row_of)}: {axis.circle.status.value}; "
            "turn farther"
        )
