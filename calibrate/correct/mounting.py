"""How the real flange lies in the last frame of a model, which no reading of a single target shows.

The start is where the flange of the model lies best on the drawn one. The real one is turned and shifted against it as
much as any other link of this arm was off, which the model itself shows: errors of its flange over the joint range are
those of all its links. Targets whose points in the flange are stated show where the real flange is, each as well as all
of them agree. Both together are one linear Gaussian estimate. Source: C. E. Rasmussen, C. K. I. Williams, Gaussian
Processes for Machine Learning, 2006, section 2.1.1 (Bayesian linear model).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibrate.arms.rig_arm import RigArm
from calibrate.physics.predicting import POSTURES, SEED, mean_motion
from calibrate.predict import Predictor
from calibrate.rigid import inverse, transform
from calibrate.sensors.target import point_by_twist

Floats = NDArray[np.float64]

LENGTH_M = 0.2  # shifts count as turns by this: a hand's length
ROUNDS = 20  # in which the variance of the targets' places settles
ENOUGH = 150  # postures for six numbers a link
LEAST_M, LEAST_RAD = 1e-5, 1e-5  # no link is known better than its machining
PLACED_M = 5e-4  # a bracket mounted by hand, against its drawing
AGREED_M = 1e-4  # machined nests: what several targets are taken to agree to before they show how well they do
SEVERAL = 3  # targets: fewer show nothing of how they agree


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
    postures = np.random.default_rng(SEED).uniform(drawn.lower_rad, drawn.upper_rad, (POSTURES, drawn.n_joints))
    frames, real = drawn.frames(postures), geometric.frames(postures)[:, -1]
    best = mean_motion(real, frames[:, -1])
    prior = _like_other_links(frames[:ENOUGH], real[:ENOUGH] @ best)
    stated_m, found_m = _targets(predictor, inverse(best))
    if not len(stated_m):
        return Mounting(best, prior, stated_m)
    J, off_m = point_by_twist(stated_m).reshape(-1, 6), (found_m - stated_m).ravel()
    placed_m, covariance, twist = PLACED_M, prior, np.zeros(6)
    for _ in range(ROUNDS if len(stated_m) >= SEVERAL else 1):
        covariance = np.asarray(np.linalg.inv(np.linalg.inv(prior) + J.T @ J / placed_m**2), dtype=np.float64)
        twist = covariance @ J.T @ off_m / placed_m**2
        spent = float(np.trace(J @ covariance @ J.T)) / placed_m**2
        left = float(np.sum((off_m - J @ twist) ** 2))
        placed_m = float(np.sqrt((left + AGREED_M**2) / (len(off_m) - spent + 1.0)))
    return Mounting(best @ transform(twist[:3], twist[3:]), covariance, stated_m)


def _targets(predictor: Predictor, back: Floats) -> tuple[Floats, Floats]:
    """(target, 3) as stated in the flange, and as found, brought there by `back`."""
    rig = predictor.rig
    stated = {f"target{k}": t.point_m for k, t in rig.targets.items()}
    stated |= {"tool": rig.tool.point_m} if rig.tool.point_m is not None else {}
    held = [(name, point) for name, point in stated.items() if f"{name}.x" in predictor.values]
    start = [np.array(predictor.about.get(name, point)[:3]) for name, point in held]
    shift = [[predictor.values.get(f"{name}.{a}", 0.0) for a in "xyz"] for name, _ in held]
    if not held:
        return np.zeros((0, 3)), np.zeros((0, 3))
    found = np.array(start) + np.array(shift)
    return np.array([point for _, point in held]), found @ back[:3, :3].T + back[:3, 3]


def _like_other_links(frames: Floats, T_real: Floats) -> Floats:
    """(6, 6) variance of the last link's shift and turn: about its joint's axis as the zeros of the other joints are
    off, across as their links are; from frames (pose, joint + 1, 4, 4) of the drawn arm and real flanges (pose, 4, 4).

    Each link is given a small motion behind its joint, the shortest that makes the flange err as it does. What poses
    do not separate is shared out by it, hence each variance is divided by how much of it the poses show.
    """
    off = T_real @ inverse(frames[:, -1])
    turn, shift_m = Rotation.from_matrix(off[:, :3, :3]).as_rotvec(), T_real[:, :3, 3] - frames[:, -1, :3, 3]
    n = frames.shape[1] - 1
    base = np.broadcast_to(np.eye(4), frames[:, 0].shape)  # its motion, and the flange's own, are no links' errors
    bodies = (base, *(frames[:, k] for k in range(1, n)), frames[:, -1])
    A = np.concatenate([_moves(B, frames[:, -1, :3, 3]) for B in bodies], axis=2).reshape(-1, 6 * len(bodies))
    y = np.concatenate([shift_m / LENGTH_M, turn], axis=1).ravel()
    pinv = np.asarray(np.linalg.pinv(A, rcond=1e-9), dtype=np.float64)
    found, shown = pinv @ y, np.einsum("ij,ji->i", pinv, A)
    each, part = found[6:-6].reshape(n - 1, 6) ** 2, shown[6:-6].reshape(n - 1, 6)
    length_m = max(LENGTH_M * float(np.sqrt(each[:, :3].sum() / part[:, :3].sum())), LEAST_M)
    across, about = (
        max(float(np.sqrt(each[:, axes].sum() / part[:, axes].sum())), LEAST_RAD) for axes in ((3, 4), (5,))
    )
    axis = inverse(frames[:1, -1])[0, :3, :3] @ frames[0, n - 1, :3, 2]
    spin = np.outer(axis, axis)
    out = np.zeros((6, 6))
    out[:3, :3] = length_m**2 * np.eye(3)
    out[3:, 3:] = across**2 * (np.eye(3) - spin) + about**2 * spin
    return out


def _moves(B: Floats, point_m: Floats) -> Floats:
    """(pose, 6, 6) how a flange at `point_m` (pose, 3) moves and turns by a shift, in hands, and a turn of a frame B
    (pose, 4, 4), in its axes.
    """
    R, out = B[:, :3, :3], np.zeros((len(B), 6, 6))
    lever = point_m - B[:, :3, 3]
    out[:, :3, :3] = out[:, 3:, 3:] = R
    out[:, :3, 3:] = np.cross(np.swapaxes(R, 1, 2), lever[:, None, :]).swapaxes(1, 2) / LENGTH_M
    return out
