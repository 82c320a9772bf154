"""The information in every candidate pose about the unknowns, and the error over the workspace that it leaves.

Information: whitened rows of the readings, in unknowns divided by their prior sigma, so that what is known before any
data is the unit matrix. The error over the workspace is that of calibrate/fit/accuracy.py: J C J' over the
workspace, rigid motions taken out.

The target is what has to be right over the workspace: the tool's point where a rig names one, else the beam of its
laser, else the flange's origin; by the unknowns, over poses drawn evenly between the joint limits. A beam has no point
of its own: its error is that across it, at points where detectors stand.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.design.candidates import Candidates
from calibrate.fit.identify.session import instruments_for_fit
from calibrate.fit.rank import STRUCTURAL
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.rig_arm import limits_of
from calibrate.model.chain import KinematicModel
from calibrate.model.dual_psd_rig import laser_of
from calibrate.model.parameters import Parameter, index_of, priors
from calibrate.model.rigid import cross_matrix

Floats = NDArray[np.float64]

POSES = 400  # the mean settles to about 2 %
ALONG_M = (0.08, 0.45)  # of a beam: from the nearest to the farthest detector of a session
TOOL = ("tool.x", "tool.y", "tool.z")


@dataclass(frozen=True)
class DesignTarget:
    """Derivatives by all unknowns of a fit, rigid motions taken out."""

    says: str
    by: Floats  # (row, param), over the root of the points: squares add up to the mean square
    by_scale: Floats  # (param,) of the scale of the workspace (no unit)


def target_of(
    rig: Rig, arm: KinematicModel, parameters: tuple[Parameter, ...], start: Floats, rng: Generator
) -> DesignTarget:
    """By the `parameters` of a fit, at their values `start`; those of the arm are among them."""
    q = rng.uniform(*limits_of(rig), (POSES, rig.n_joints))
    column = index_of(parameters)
    own = [column[p.name] for p in arm.parameters]
    theta = start[own]
    T, twists = arm.flange(theta, q), arm.twists(theta, q)
    points, across, extra = _points(rig, T, column, start)
    by = np.zeros((len(points), 3, len(column)))
    reps = len(points) // len(q)
    twists = np.tile(twists, (reps, 1, 1))
    by[:, :, own] = twists[:, :3] - cross_matrix(points) @ twists[:, 3:]
    for index, moves in extra.items():
        by[:, :, index] += moves
    return _shaped(_says(rig), points, across @ by, across)


def _says(rig: Rig) -> str:
    if rig.tool.point_m is not None:
        return "the tool's point"
    if rig.tool.laser_origin_m is not None:
        return f"the beam, {ALONG_M[0]:g} and {ALONG_M[1]:g} m in front of the laser, across it"
    return "the flange's origin"


def _points(rig: Rig, T: Floats, column: dict[str, int], start: Floats) -> tuple[Floats, Floats, dict[int, Floats]]:
    """Points (point, 3), projections (point, 3, 3) of what counts, and their motion by unknowns that are no arm's."""
    R, n = T[:, :3, :3], len(T)
    if rig.tool.point_m is not None or rig.tool.laser_origin_m is None:
        point = np.array(rig.tool.point_m or (0.0, 0.0, 0.0))
        tool = {column[name]: R[:, :, i] for i, name in enumerate(TOOL) if name in column}
        return R @ point + T[:, :3, 3], np.broadcast_to(np.eye(3), (n, 3, 3)), tool
    mount = laser_of(rig)
    beam = mount.beam(start[[column[p.name] for p in mount.parameters]], T)
    direction = beam.direction / np.linalg.norm(beam.direction, axis=1, keepdims=True)
    points = np.concatenate([beam.origin_m + s * beam.direction for s in ALONG_M])
    across = np.eye(3) - direction[:, :, None] * direction[:, None, :]
    moves: dict[int, Floats] = {}
    for name, axis in (("u", mount.u), ("v", mount.v)):
        shift = R @ axis
        moves[column[f"laser.shift_{name}"]] = np.tile(shift, (len(ALONG_M), 1))
        moves[column[f"laser.tilt_{name}"]] = np.concatenate([s * shift for s in ALONG_M])
    return points, np.tile(across, (len(ALONG_M), 1, 1)), moves


def _shaped(says: str, points: Floats, by: Floats, across: Floats) -> DesignTarget:
    n, _, params = by.shape
    rigid = across @ np.concatenate([np.tile(np.eye(3), (n, 1, 1)), -cross_matrix(points)], axis=2)
    Q = np.linalg.qr(rigid.reshape(3 * n, 6))[0]
    flat = by.reshape(3 * n, params)
    flat = flat - Q @ (Q.T @ flat)
    spread = (across @ (points - points.mean(axis=0))[:, :, None]).ravel()
    spread = spread - Q @ (Q.T @ spread)
    return DesignTarget(says, flat / np.sqrt(n), spread @ flat / (spread @ spread))


NO_OPINION = 3.0  # plausible sizes: assumed of an unknown of which nobody has an opinion; far above any sigma found


@dataclass(frozen=True, eq=False)
class Information:
    """Over the free unknowns."""

    parameters: tuple[Parameter, ...]  # the free ones
    rows: Floats  # (pose, k, param) of the candidates, whitened and scaled
    known: Floats  # (row, param) of known distances of the rig, whitened and scaled
    by_target: Floats  # (row, param) of the target by the scaled unknowns (`target_of`)
    by_scale: Floats  # (param,) of the scale of the workspace, by the scaled unknowns
    target: str  # what the target is
    hidden: Floats  # (param, k) orthonormal directions that no candidate shows, whatever their number

    @property
    def n(self) -> int:
        return len(self.parameters)

    @property
    def before(self) -> Floats:
        """(param, param) what is known before any pose."""
        return np.eye(self.n) + self.known.T @ self.known

    @cached_property
    def target_weight(self) -> Floats:
        """(param, param) W with trace(C W) the mean square of the target's error, m^2; hidden directions aside."""
        shown = self.by_target - (self.by_target @ self.hidden) @ self.hidden.T
        return shown.T @ shown

    @property
    def hidden_m(self) -> float:
        """Rms of the target by what no candidate shows, as far as it is assumed: 0 where it moves no target."""
        return float(np.linalg.norm(self.by_target @ self.hidden))

    def of(self, poses: NDArray[np.intp], known: bool = True) -> Floats:
        """(param, param) what is known with these poses, and with the rig's known distances or without."""
        X = self.rows[poses].reshape(-1, self.n)
        return X.T @ X + (self.before if known else np.eye(self.n))

    def free_space_m(self, information: Floats) -> float:
        """Rms of the target over the workspace that this leaves, three axes together."""
        return float(np.sqrt(np.trace(np.linalg.solve(information, self.target_weight))))

    def scale_sigma(self, information: Floats) -> float:
        """One sigma of the scale of the workspace (no unit), hidden directions aside."""
        shown = self.by_scale - (self.by_scale @ self.hidden) @ self.hidden.T
        return float(np.sqrt(shown @ np.linalg.solve(information, shown)))


def information_of(rig: Rig, candidates: Candidates, rng: Generator) -> Information:
    """At the nominal rig, under its assumed noise, with the unknowns that an identification would have."""
    found = instruments_for_fit(rig, candidates.samples())
    weighting, every = found.weighting, found.weighting.parameters
    free = np.flatnonzero([p.free for p in every])
    parameters = tuple(with_prior(every[i]) for i in free)
    size = priors(parameters)
    J = weighting.problem(found.start).jacobian(found.start)[:, free] * size
    k = candidates.reading.shape[1]
    order = np.concatenate([m.sample_rows[:, -1] for m in weighting.measured])
    rows = np.zeros((len(candidates), k, len(free)))
    rows[order] = J[: len(order) * k].reshape(len(order), k, -1)
    target = target_of(rig, arm_of(rig), every, found.start, rng)
    by_target, by_scale = target.by[:, free] * size, target.by_scale[free] * size
    return Information(parameters, rows, J[len(order) * k :], by_target, by_scale, target.says, _hidden(J))


def with_prior(p: Parameter) -> Parameter:
    """Nobody has an opinion: many plausible sizes, so that every information matrix has an inverse."""
    return p if np.isfinite(p.prior) else replace(p, prior=NO_OPINION * p.plausible)


def _hidden(J: Floats) -> Floats:
    """(param, k) right null space of the rows."""
    _, s, Vt = np.linalg.svd(np.linalg.qr(J, mode="r"))
    return Vt[s < STRUCTURAL * s[0]].T
