"""The point constraint: laser lines of centred poses meet in one point of the fixture; only joint zeros are unknown.

Source: Deng, Ding, Zhang, Food & Machinery 2019(3): poses 1, 2 strike PSD 1 first, poses 3, 4 PSD 2 first; nearest
points of the pairs (1,3) (1,4) (2,3) (2,4), residuals are their distances from their mean; start 0,
2000 iterations, bounds +-0.0785 rad. With all zeros free J2 and J3 ran into the bound there: the question was not
answerable. So rank comes first here, at the start and again at the solution; what cannot be determined is held at
zero and named, and a zero at its bound, or one that only counts together with a held one, is never reported.

The middles of the pairs ignore how far the two lines of a pair pass each other, which costs the paper one of its five
equations once the lines meet (rank 4). `identify_by_point` therefore takes the distances of all lines, four or more,
from the one point nearest to all (rank 5 with four poses).
`point_constraints` gives both beside the fit where a fit plan asks for it (`method = "point-constraint"`).
The laser mount, the links and their tolerance are those of the drawing; sigma carries what they may be off.
"""

from dataclasses import dataclass, replace
from enum import Enum
from itertools import product

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from calibrate.errors import DataError
from calibrate.fit.identify.estimates import JointZero
from calibrate.fit.rank.identifiability import Identifiability, analyse
from calibrate.fit.solvers import Fit, Status, solve
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.chain import KinematicModel
from calibrate.model.default_tolerance import links_of
from calibrate.model.dual_psd_rig import laser_of
from calibrate.model.observations import Observations, observations
from calibrate.model.optics import CENTRED_M, LaserMount, Lines, distances, nearest_point
from calibrate.model.parameters import Parameter, hold, start_values
from calibrate.model.rigid import cross

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

BOUND_RAD = 0.0785
MAX_ITERATIONS = 2000
SAME_POSE_RAD = 0.01  # repeats of one pose are one pose
# The paper stops at 1e-5 of its objective; that is before the steps show that an equation is lost at the solution.
TOLERANCE = 1e-12  # of chi2


class Constraint(Enum):
    """What is made small."""

    PAIR_POINTS = "nearest points of the pairs (1,3) (1,4) (2,3) (2,4) less their mean"
    NEAREST_POINT = "distances of all lines from the point nearest to all"


@dataclass(frozen=True)
class DrawingTolerance:
    """One sigma of what the point constraint takes from the drawing, and of one centred line."""

    line_m: float  # a centred line at the fixture: detector, centring and joint repeatability together
    length_m: float  # links
    angle_rad: float  # links
    laser_shift_m: float = 1e-3  # a bracket fitted by hand
    laser_tilt_rad: float = 5e-3

    def of(self, p: Parameter) -> float:
        """One sigma of a parameter that is not fitted."""
        if p.name.startswith("laser."):
            return self.laser_shift_m if p.unit == "m" else self.laser_tilt_rad
        return self.length_m if p.unit == "m" else self.angle_rad


@dataclass(frozen=True)
class PointConstraintResult:
    """Zeros by the point constraint with their uncertainty."""

    status: Status
    zeros: tuple[JointZero, ...]
    identifiability: Identifiability  # of all zeros, bounds aside
    point_m: Floats  # (3,) where the lines meet, in the base of the arm with the held zeros at 0
    rms_distance_before_m: float  # of the residual vectors
    rms_distance_after_m: float
    steps: int


@dataclass(frozen=True)
class PointConstraint:
    """LeastSquares over arm and laser parameters, of which only the zeros are free."""

    model: KinematicModel
    mount: LaserMount
    q_rad: Floats  # (pose, joint)
    first_psd: NDArray[np.int64]  # (pose,)
    line_m: float  # whitens the residuals
    form: Constraint
    parameters: tuple[Parameter, ...]

    def residual(self, theta: Floats) -> Floats:
        return self._residual(theta)[0].ravel() / self.line_m

    def jacobian(self, theta: Floats) -> Floats:
        return self._residual(theta)[1].reshape(-1, len(self.parameters)) / self.line_m

    def lines(self, theta: Floats) -> Lines:
        """Laser lines of all poses."""
        n = len(self.model.parameters)
        T = self.model.flange(theta[:n], self.q_rad)
        twists = self.model.twists(theta[:n], self.q_rad)  # (pose, 6, param)
        beam = self.mount.beam(theta[n:], T)
        length = np.linalg.norm(beam.direction, axis=1, keepdims=True)
        d = beam.direction / length
        mount_axes = T[:, :3, :3] @ np.stack([self.mount.u, self.mount.v], axis=-1)
        none = np.zeros_like(mount_axes)
        w = np.swapaxes(twists[:, 3:], 1, 2)  # (pose, param, 3)
        p_arm = twists[:, :3] + np.swapaxes(cross(w, beam.origin_m[:, None]), 1, 2)
        d_arm = np.swapaxes(cross(w, d[:, None]), 1, 2)
        d_mount = (mount_axes - d[:, :, None] * np.einsum("ni,nij->nj", d, mount_axes)[:, None]) / length[..., None]
        return Lines(
            beam.origin_m,
            d,
            np.concatenate([p_arm, mount_axes, none], axis=2),
            np.concatenate([d_arm, none, d_mount], axis=2),
        )

    def _residual(self, theta: Floats) -> tuple[Floats, Floats]:
        lines = self.lines(theta)
        return self._in_first_flange(
            theta, *(self._pairs(lines) if self.form is Constraint.PAIR_POINTS else distances(lines))
        )

    def _pairs(self, lines: Lines) -> tuple[Floats, Floats]:
        """(4, 3) equations (9..12) of the paper, and their derivative."""
        one, two = (np.flatnonzero(self.first_psd == k).tolist() for k in (1, 2))
        pairs = [nearest_point(lines.select([i, j])) for i, j in product(one, two)]
        points, by = np.stack([p for p, _ in pairs]), np.stack([b for _, b in pairs])
        return points - points.mean(axis=0), by - by.mean(axis=0)

    def _in_first_flange(self, theta: Floats, vectors: Floats, by: Floats) -> tuple[Floats, Floats]:
        """The same vectors seen from the flange of the first pose: lengths, hence the minimum, are the same.

        In the base frame a turn of everything about axis 1 would turn residuals that are not yet zero, and joint 1
        would look as if the data could see it.
        """
        theta_arm = theta[: len(self.model.parameters)]
        R = self.model.flange(theta_arm, self.q_rad[:1])[0, :3, :3]
        w = self.model.twists(theta_arm, self.q_rad[:1])[0, 3:]  # (3, param)
        n = w.shape[1]
        by = by.copy()
        by[:, :, :n] -= np.swapaxes(cross(w.T[None], vectors[:, None]), 1, 2)
        return vectors @ R, R.T @ by


@dataclass(frozen=True)
class PointConstraints:
    """The method beside a fit: as published, and with every centred pose of one placement."""

    placement: int
    poses: int  # centred ones there
    four_poses: PointConstraintResult
    all_poses: PointConstraintResult


def point_constraints(rig: Rig, samples: Samples) -> PointConstraints:
    """Both forms at the placement with most centred poses. DataError where no placement has two of each beam order."""
    data = observations(samples)
    centred = np.all(np.abs(data.spots_m) < CENTRED_M, axis=1)
    found: list[tuple[int, int, Indices, Indices]] = []
    for placement in np.unique(data.placement).tolist():
        here = centred & (data.placement == placement)
        four = four_centred_poses(data, here)
        if four is not None:
            found.append((int(np.sum(here)), -placement, four, np.flatnonzero(here)))
    if not found:
        raise DataError(
            'fit plan: method = "point-constraint" needs two different poses of each beam order, centred within '
            f"{CENTRED_M} m, at one placement; centre such poses, or leave the method out"
        )
    poses, placement, four, every = max(found, key=lambda each: each[:2])
    arm, mount, tolerances = arm_of(rig, links_of(rig)), laser_of(rig), drawing_tolerance(rig)
    return PointConstraints(
        -placement,
        poses,
        identify_by_four_poses(arm, mount, data.select(four), tolerances),
        identify_by_point(arm, mount, data.select(every), tolerances),
    )


def four_centred_poses(data: Observations, usable: NDArray[np.bool_]) -> Indices | None:
    """Rows of two of the usable poses (pose,) of each beam order, the two of an order as different as there are.

    In the order of the source: 1, 2 with PSD 1 first, 3, 4 with PSD 2 first. None where there are no two of each.
    """
    one, two = (_most_different(data, np.flatnonzero(usable & (data.first_psd == first))) for first in (1, 2))
    return None if one is None or two is None else np.array([*one, *two], dtype=np.intp)


def _most_different(data: Observations, rows: Indices) -> tuple[int, int] | None:
    if len(rows) < 2:
        return None
    apart = np.linalg.norm(data.q_rad[rows][:, None] - data.q_rad[rows][None], axis=2)
    i, j = np.unravel_index(int(np.argmax(apart)), apart.shape)
    if apart[i, j] < SAME_POSE_RAD:
        return None
    return int(rows[i]), int(rows[j])


def drawing_tolerance(rig: Rig, line_m: float = 5e-6) -> DrawingTolerance:
    """What the point constraint takes from the drawing; 5 µm is how well the servo centres."""
    links = links_of(rig)
    return DrawingTolerance(line_m, links.length_sigma_m, links.angle_sigma_rad)


def identify_by_four_poses(
    model: KinematicModel, mount: LaserMount, data: Observations, tolerances: DrawingTolerance
) -> PointConstraintResult:
    """The paper's procedure on two and two centred poses at one placement. DataError where the poses are not such."""
    _refuse_unfit(data)
    if len(data) != 4:
        raise DataError(f"four-pose point constraint: {len(data)} poses given; choose two of each order")
    return _identify(model, mount, data, tolerances, Constraint.PAIR_POINTS)


def identify_by_point(
    model: KinematicModel, mount: LaserMount, data: Observations, tolerances: DrawingTolerance
) -> PointConstraintResult:
    """Zeros from four or more centred poses of both orders at one placement. DataError where the poses are not such."""
    _refuse_unfit(data)
    return _identify(model, mount, data, tolerances, Constraint.NEAREST_POINT)


def _identify(
    model: KinematicModel, mount: LaserMount, data: Observations, tolerances: DrawingTolerance, form: Constraint
) -> PointConstraintResult:
    parameters = tuple(_bounded(p) for p in model.parameters + mount.parameters)
    problem = PointConstraint(model, mount, data.q_rad, data.first_psd, tolerances.line_m, form, parameters)
    nominal = start_values(parameters)
    seen, reduced, fit = _solve_seen(problem, nominal)
    sigma = _sigma(reduced, fit, tolerances)
    columns = [i for i, p in enumerate(model.parameters) if p.name.endswith(".zero")]
    return PointConstraintResult(
        Status.RANK_DEFICIENT if fit.status is Status.CONVERGED and seen.combinations else fit.status,
        tuple(_zero(i + 1, column, fit, sigma, seen) for i, column in enumerate(columns)),
        seen,
        nearest_point(problem.lines(fit.theta))[0],
        tolerances.line_m * float(np.sqrt(np.mean(problem.residual(nominal) ** 2))),
        tolerances.line_m * float(np.sqrt(np.mean(problem.residual(fit.theta) ** 2))),
        fit.steps,
    )


def _solve_seen(problem: PointConstraint, start: Floats) -> tuple[Identifiability, PointConstraint, Fit]:
    """Hold what the data cannot see at the start, solve, and look again at the solution until nothing more is lost."""
    seen = analyse(problem.jacobian(start), problem.parameters)
    while True:
        held = {c.representative for c in seen.combinations}
        reduced = replace(problem, parameters=hold(problem.parameters, held))
        fit = solve(reduced, start=start, tolerance=TOLERANCE, max_steps=MAX_ITERATIONS)
        again = analyse(problem.jacobian(fit.theta), problem.parameters)
        if len(again.combinations) <= len(seen.combinations) or fit.status is Status.NOT_FINITE:
            return seen, reduced, fit
        seen = again  # one combination more: this ends after as many rounds as there are zeros


def _refuse_unfit(data: Observations) -> None:
    if len(set(data.placement.tolist())) != 1:
        places = ", ".join(map(str, sorted(set(data.placement.tolist()))))
        raise DataError(f"point constraint: poses at placements {places}; lines meet only within one placement")
    one, two = int(np.sum(data.first_psd == 1)), int(np.sum(data.first_psd == 2))
    if one < 2 or two < 2:
        raise DataError(
            f"point constraint: {one} poses strike PSD 1 first and {two} PSD 2; at least 2 of each are needed"
        )
    worst = np.abs(data.spots_m).max(axis=1)
    if worst.max() > CENTRED_M:
        off = int(np.argmax(worst))
        raise DataError(
            f"point constraint: spots of pose {off} are {worst[off]:.2g} m off centre; centre it or leave it out"
        )


def _bounded(p: Parameter) -> Parameter:
    """Zeros between the paper's bounds, everything else nominal."""
    if not p.name.endswith(".zero"):
        return Parameter(p.name, p.unit, p.plausible, start=p.start, free=False)
    return Parameter(p.name, p.unit, p.plausible, lower=-BOUND_RAD, upper=BOUND_RAD)


def _sigma(problem: PointConstraint, fit: Fit, tolerances: DrawingTolerance) -> Floats:
    """(param,) sigma of the free zeros: noise of the lines, plus what link and laser tolerances push into them.

    Source: consider covariance, Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, ch. VIII.
    """
    free = np.flatnonzero([p.free for p in problem.parameters])
    J = problem.jacobian(fit.theta)
    gain = np.linalg.pinv(J[:, free])
    taken = np.array([not (p.free or p.name.endswith(".zero")) for p in problem.parameters])
    tolerance = np.array([tolerances.of(p) for p in problem.parameters])
    pushed = gain @ (J[:, taken] * tolerance[taken])
    out = np.full(len(problem.parameters), np.inf)
    out[free] = np.sqrt(np.sum(gain**2, axis=1) + np.sum(pushed**2, axis=1))
    return out


def _zero(joint: int, column: int, fit: Fit, sigma: Floats, seen: Identifiability) -> JointZero:
    parameter = fit.parameters[column]
    why = seen.reason(parameter.name)
    if why is None and parameter.name in fit.at_bound:
        why = f"at its bound of {BOUND_RAD} rad: no result"
    elif why is None and fit.status not in (Status.CONVERGED, Status.AT_BOUND):
        why = fit.status.value
    elif why is None and fit.at_bound:
        why = f"{', '.join(fit.at_bound)} ran into the bound: these poses do not answer the question"
    elif why is None and 3.0 * sigma[column] > BOUND_RAD:
        why = f"data too weak: 3 sigma of {3.0 * sigma[column]:.2g} rad reach beyond the bounds of +-{BOUND_RAD} rad"
    if why is not None:
        return JointZero(joint, None, None, None, why)
    return JointZero(joint, float(fit.theta[column]), float(sigma[column]), None, None)
