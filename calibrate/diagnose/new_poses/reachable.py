"""Poses that could be taken next: recorded ones, and others like them that the model states can be read.

Between and around recorded poses of one place, then landed: spots go to a random point of both faces, a probe back into
its cone. Nothing leaves the joint limits, or the space in which flange and links have been. Where nothing has to be
landed on, angles are drawn between the smallest and largest that were recorded.
"""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.diagnose import limits
from calibrate.diagnose.new_poses.longer_session import NewPoses
from calibrate.diagnose.state.fitted import Fitted
from calibrate.model.arms.rig_arm import limits_of
from calibrate.model.chain import ObservationModel

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]

STEPS, STEP_RAD = 12, 0.3
SINGULAR = 1e-4  # of the quickest direction
LANDED_M = 1e-6


def reachable(state: Fitted, rng: Generator, count: int = limits.OFFERED_POSES) -> NewPoses:
    """About `count` poses, from both sides of every joint at random."""
    q = state.session.samples.joints()
    recorded = rng.integers(len(q), size=int(limits.RECORDED_SHARE * count))
    like = rng.integers(len(q), size=limits.POSE_TRIES * count)
    near = _between(q, like, _place(state), rng)
    bound, landed = _landed(state, like, near, rng)
    free = rng.uniform(q.min(axis=0), q.max(axis=0), near.shape)
    new = np.where(bound[:, None], landed, free)
    good = np.flatnonzero(_allowed(state, new) & np.isfinite(new).all(axis=1))[: count - len(recorded)]
    q_rad, from_pose = np.concatenate([q[recorded], new[good]]), np.concatenate([recorded, like[good]])
    return NewPoses(q_rad, rng.choice([-1.0, 1.0], q_rad.shape), from_pose)


def _place(state: Fitted) -> Ints:
    """(sample,) poses with one number stood before the same target in the same order."""
    out = np.zeros(len(state.session.samples), dtype=np.intp)
    for m in state.session.measured:
        if (spot := m.problem.chain.sensor.spot()) is not None:
            out[m.sample_rows[:, -1]] = spot
    return out


def _between(q: Floats, like: Ints, place: Ints, rng: Generator) -> Floats:
    """(pose, joint) on the way from one pose to another of its place, and a little aside."""
    other = np.empty(len(like), dtype=np.intp)
    for one in np.unique(place):
        mine = place[like] == one
        other[mine] = rng.choice(np.flatnonzero(place == one), int(mine.sum()))
    share = rng.uniform(*limits.BETWEEN_POSES, (len(like), 1))
    return q[like] + share * (q[other] - q[like]) + rng.normal(0.0, limits.SPREAD_RAD, (len(like), q.shape[1]))


def _landed(state: Fitted, like: Ints, q_rad: Floats, rng: Generator) -> tuple[Bools, Floats]:
    """(pose,) whether something has to be met, and (pose, joint) where it is; NaN where it cannot."""
    bound, out = np.zeros(len(like), dtype=bool), q_rad.copy()
    joint = state.session.weighting.unweighted
    for i, m in enumerate(state.session.measured):
        chain = m.problem.chain
        if chain.sensor.spot() is None:
            continue
        row_of = np.full(len(state.session.samples), -1, dtype=np.intp)
        row_of[m.sample_rows[:, -1]] = np.arange(m.problem.rows)
        here = np.flatnonzero(row_of[like] >= 0)
        bound[here] = True
        own, part = joint.of_block(i, state.geometry), chain.select(row_of[like[here]])
        out[here] = _met(part, own, q_rad[here], rng)
    return bound, out


def _met(chain: ObservationModel, theta: Floats, q_rad: Floats, rng: Generator) -> Floats:
    """Onto the faces or into the cone; NaN where that cannot be."""
    target = chain.sensor.aims(chain.expect(theta, q_rad).shape[1], rng)
    q_rad = chain.readings_for(theta, q_rad, target, SINGULAR, STEPS, STEP_RAD)
    with np.errstate(all="ignore"):
        met = np.max(np.abs(chain.expect(theta, q_rad) - target), axis=1) < LANDED_M
    n_arm = len(chain.model.parameters)
    met &= chain.sensor.met(theta[n_arm:], chain.model.flange(theta[:n_arm], q_rad))
    return np.where(met[:, None], q_rad, np.nan)


def _allowed(state: Fitted, q_rad: Floats) -> Bools:
    """(pose,) inside the joint limits, and where flange and links have been."""
    arm, (lower_rad, upper_rad) = state.session.arm, limits_of(state.session.rig)
    theta = state.geometry[: len(arm.parameters)]
    q = np.nan_to_num(q_rad)
    inside = np.all((q >= lower_rad) & (q <= upper_rad), axis=1)
    been, there = state.drivers.frames, arm.frames(theta, q)
    low, high = been[:, -1, :3, 3].min(axis=0) - limits.ROOM_M, been[:, -1, :3, 3].max(axis=0) + limits.ROOM_M
    inside &= np.all((there[:, -1, :3, 3] >= low) & (there[:, -1, :3, 3] <= high), axis=1)
    return inside & (there[:, 1:, 2, 3].min(axis=1) >= been[:, 1:, 2, 3].min() - 1e-9)
