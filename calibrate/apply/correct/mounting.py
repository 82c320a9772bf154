"""How the real flange lies in the last frame of a model, which no reading of a single target shows.

What a model knows is where its targets are at every posture. Errors of links, zeros and brackets that are alike to the
targets are not alike to the flange: which of them it is, is open, and each is as likely as the sizes of errors that the
targets do show. One linear Gaussian estimate of all of them, given where the model has its targets, under sizes that
are themselves drawn and weighted by how well they explain it. Sources: C. E. Rasmussen, C. K. I. Williams, Gaussian
Processes for Machine Learning, 2006, section 2.1.1 (Bayesian linear model); A. B. Owen, Monte Carlo theory, methods and
examples, 2013, chapter 9 (importance sampling).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, qmc

from calibrate.apply.predicting import SEED, mean_motion
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.placement import point_by_twist
from calibrate.model.predict import Predictor
from calibrate.model.rigid import inverse, transform

Floats = NDArray[np.float64]

POSTURES = 60
ROUNDS = 3  # of linearising; each draws sizes about those of the one before
DRAWS = 512  # of the sizes, a power of two
# Median of one sigma, before anything is known: links in m and rad, zeros in rad, a bracket mounted by hand in m.
SIZES = (3e-4, 6e-4, 3e-3, 4e-4)
SPREAD = 1.0  # of their logarithms
WIDER = 1.5  # what sizes are drawn from, than what is known of them
EXACT_M = 5e-6  # how well a model is taken to know its targets
CURVED = 0.02  # of errors that are left: what linearising may miss of them
# Of a model without targets, points of its last frame, which lies anyhow on the flange, m.
CORNERS_M = 0.1 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class Mounting:
    """`T` (4, 4) flange in the model's last frame; `covariance` (6, 6) of its shift in m and turn in rad, in its axes.

    `measured_m` (target, 3) are their points in the flange, as stated.
    """

    T: Floats
    covariance: Floats
    measured_m: Floats

    @property
    def sigma_rad(self) -> float:
        """One sigma of the turn, the length of its vector."""
        return float(np.sqrt(np.trace(self.covariance[3:, 3:])))

    def sigma_m(self, point_m: Floats) -> float:
        """One sigma of where a point (3,) of the flange is, the length of its vector."""
        J = point_by_twist(point_m)
        return float(np.sqrt(np.trace(J @ self.covariance @ J.T)))

    def lever_m(self, point_m: Floats) -> float:
        """Distance of a point (3,) of the flange from the nearest measured one; NaN where none is."""
        return float(min((np.linalg.norm(point_m - m) for m in self.measured_m), default=np.nan))


def mounting(predictor: Predictor, drawn: RigArm, geometric: RigArm) -> Mounting:
    """Of a model at its values; `geometric` is its arm."""
    q_rad = np.random.default_rng(SEED).uniform(drawn.lower_rad, drawn.upper_rad, (POSTURES, drawn.n_joints))
    last = geometric.frames(q_rad)[:, -1]
    stated_m, found_m, sigma_m = _targets(predictor)
    if len(stated_m):
        seen_m, errors = _at(last, found_m), _Errors(drawn.frames(q_rad), stated_m, sigma_m)
    else:
        seen_m, errors = _at(last, CORNERS_M), _Errors(drawn.frames(q_rad), CORNERS_M, None)
    x, covariance = np.zeros(errors.count), np.zeros((errors.count, errors.count))
    size, width = np.log(SIZES), np.full(len(SIZES), SPREAD)
    for _ in range(ROUNDS):
        frames, at_m = errors.applied(x)
        A, left_m = errors.columns(frames, at_m), (seen_m - at_m).ravel()
        noise_m = max(EXACT_M, CURVED * float(np.sqrt(np.mean(left_m**2))))
        x, covariance, size, width = _estimate(A, left_m + A @ x, noise_m, errors, (size, width))
    frames, _ = errors.applied(x)
    J = errors.of_flange(frames)
    return Mounting(mean_motion(last, frames[:, -1]), J @ covariance @ J.T, stated_m)


def _targets(predictor: Predictor) -> tuple[Floats, Floats, Floats]:
    """(target, 3) as stated in the flange, and as found in the model's last frame; (target,) sigma, NaN: not stated."""
    rig = predictor.rig
    stated = {f"target{k}": (t.point_m, t.point_sigma_m) for k, t in rig.targets.items()}
    stated |= {"tool": (rig.tool.point_m, None)} if rig.tool.point_m is not None else {}
    held = {name: one for name, one in stated.items() if f"{name}.x" in predictor.values}
    if not held:
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)
    found_m = [predictor.found_m(name, point) for name, (point, _) in held.items()]
    sigma_m = [np.nan if sigma is None else sigma for _, sigma in held.values()]
    return np.array([point for point, _ in held.values()]), np.array(found_m), np.array(sigma_m)


def _at(T: Floats, points_m: Floats) -> Floats:
    """(pose, point, 3) in the base, of points (point, 3) of frames (pose, 4, 4)."""
    return points_m @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3]


@dataclass(frozen=True, eq=False)
class _Errors:
    """Small errors of a drawn arm: the base's six, a zero and six of its link for each joint, and of the points.

    `drawn` (pose, joint + 1, 4, 4) frames. Points (point, 3) of the flange are off by three numbers each, whose sigma
    (point,) is NaN where nobody has stated it; without sigmas all by one motion. Where the base is, and this motion,
    nothing is known of beforehand: they are flat.
    """

    drawn: Floats
    points_m: Floats
    sigma_m: Floats | None

    @property
    def joints(self) -> int:
        return self.drawn.shape[1] - 1

    @property
    def count(self) -> int:
        return 6 + 7 * self.joints + (6 if self.sigma_m is None else self.points_m.size)

    @property
    def flat(self) -> NDArray[np.bool_]:
        """(error,) whether nothing is known of it beforehand."""
        n = np.arange(self.count)
        return (n < 6) | ((n >= self.count - 6) & (self.sigma_m is None))

    def sizes(self, size: Floats) -> Floats:
        """(draw, error) one sigma of each that is not flat, under sizes (draw, 4)."""
        length, angle, zero, placed = size.T[:, :, None]
        link = np.concatenate([zero, *3 * (length,), *3 * (angle,)], axis=1)
        arm = np.tile(link, self.joints)
        if self.sigma_m is None:
            return arm
        points = np.where(np.isnan(self.sigma_m), placed, self.sigma_m)
        return np.concatenate([arm, np.repeat(points, 3, axis=1)], axis=1)

    def applied(self, x: Floats) -> tuple[Floats, Floats]:
        """(pose, joint + 1, 4, 4) frames with errors (error,), and (pose, point, 3) of the points in the base."""
        out = [transform(x[:3], x[3:6]) @ self.drawn[:, 0]]
        for k, part in enumerate(x[6 : 6 + 7 * self.joints].reshape(-1, 7)):
            turned = transform(np.zeros(3), np.array([0.0, 0.0, part[0]]))
            link = inverse(self.drawn[:, k]) @ self.drawn[:, k + 1] @ transform(part[1:4], part[4:])
            out.append(out[-1] @ turned @ link)
        off = x[6 + 7 * self.joints :]
        if self.sigma_m is not None:
            return np.stack(out, axis=1), _at(out[-1], self.points_m + off.reshape(-1, 3))
        return np.stack(out, axis=1), _at(out[-1] @ transform(off[:3], off[3:]), self.points_m)

    def columns(self, frames: Floats, at_m: Floats) -> Floats:
        """(pose x point x 3, error) how the points move in the base."""
        moves = np.stack([self._moves(frames, at_m[:, k]) for k in range(at_m.shape[1])], axis=1)
        shift = moves[..., :3, :]
        if self.sigma_m is not None:
            own = np.zeros((*shift.shape[:3], self.points_m.size))
            for k in range(len(self.points_m)):
                own[:, k, :, 3 * k : 3 * k + 3] = frames[:, -1, :3, :3]
        else:
            own = shift[..., -6:]
        return np.concatenate([shift, own], axis=-1).reshape(-1, self.count)

    def of_flange(self, frames: Floats) -> Floats:
        """(6, error) shift and turn of the flange in its own axes, the mean over the poses."""
        moves = self._moves(frames, frames[:, -1, :3, 3]).reshape(len(frames), 2, 3, -1)
        own = np.mean(np.einsum("pji,pkje->pkie", frames[:, -1, :3, :3], moves), axis=0).reshape(6, -1)
        return np.pad(own, ((0, 0), (0, self.count - own.shape[1])))

    def _moves(self, frames: Floats, point_m: Floats) -> Floats:
        """(pose, 6, error) shift and turn in the base, by errors of base and arm, of a body at points (pose, 3)."""
        base = _by_twist(np.broadcast_to(np.eye(4), frames[:, 0].shape), point_m)
        out = [base]
        for k in range(self.joints):
            out += [_by_twist(frames[:, k], point_m)[:, :, 5:], _by_twist(frames[:, k + 1], point_m)]
        return np.concatenate(out, axis=2)


def _by_twist(T: Floats, point_m: Floats) -> Floats:
    """(pose, 6, 6) shift and turn in the base of a body at points (pose, 3), by a twist of frames (pose, 4, 4)."""
    R, out = T[:, :3, :3], np.zeros((len(T), 6, 6))
    out[:, :3, :3] = out[:, 3:, 3:] = R
    out[:, :3, 3:] = np.cross(np.swapaxes(R, 1, 2), (point_m - T[:, :3, 3])[:, None, :]).swapaxes(1, 2)
    return out


def _estimate(
    A: Floats, y: Floats, noise_m: float, errors: _Errors, sizes: tuple[Floats, Floats]
) -> tuple[Floats, Floats, Floats, Floats]:
    """Errors (error,) and their covariance, logarithms of the sizes (4,) and their spread (4,).

    Of readings y (row,) that errors move by A (row, error). `sizes` are drawn about the first as wide as the second.
    """
    flat, (size, width) = errors.flat, sizes
    normal = norm.ppf(qmc.Sobol(len(size), rng=SEED).random(DRAWS))
    drawn = size + width * normal
    sigma = errors.sizes(np.exp(drawn))  # (draw, error)
    Q, _ = np.linalg.qr(A[:, flat])
    own = A[:, ~flat] - Q @ (Q.T @ A[:, ~flat])
    gram, by_y = own.T @ own / noise_m**2, own.T @ (y - Q @ (Q.T @ y)) / noise_m**2
    # With errors in units of their sigma, priors are 1 whatever the sizes.
    M = sigma[:, :, None] * gram * sigma[:, None, :] + np.eye(len(by_y))
    C = np.linalg.inv(M)
    found = np.einsum("dij,dj->di", C, sigma * by_y)
    likely = 0.5 * (np.einsum("di,di->d", found, sigma * by_y) - np.linalg.slogdet(M)[1])
    likely += 0.5 * np.sum(normal**2 - ((drawn - np.log(SIZES)) / SPREAD) ** 2, axis=1)
    weight = np.exp(likely - likely.max())
    weight /= weight.sum()
    mean, each = weight @ drawn, sigma * found
    best = weight @ each
    covariance = np.einsum("d,di,dij,dj->ij", weight, sigma, C, sigma, optimize=True)
    covariance += np.einsum("d,di,dj->ij", weight, each - best, each - best, optimize=True)
    # What is flat follows from the others.
    follows = np.zeros((len(flat), len(best)))
    follows[~flat], follows[flat] = np.eye(len(best)), -np.linalg.lstsq(A[:, flat], A[:, ~flat])[0]
    x = follows @ best
    x[flat] += np.linalg.lstsq(A[:, flat], y)[0]
    return x, follows @ covariance @ follows.T, mean, WIDER * np.sqrt(weight @ (drawn - mean) ** 2)
