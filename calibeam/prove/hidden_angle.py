"""A joint column hidden: the model of all other poses has to say, from what the instrument saw, where the joint stood.

The column is known to us, so here truth is real and not simulated.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording
from calibrate.chain import Chain
from calibrate.diagnose.fitted import Fitted, fit_geometry
from calibrate.diagnose.folds import splits_of
from calibrate.diagnose.session import session_of
from calibrate.errors import DataError

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

STARTS = 48  # over the range of the joint: arms may reach a point with an angle far off
STEPS = 12
SETTLED_RAD = 1e-9
FAINT_RAD = 0.01  # by which an angle has to be known: the target of a joint beside it says nothing
SEED = 5


@dataclass(frozen=True)
class HiddenAngle:
    """What was inferred of one joint at the poses that had its column hidden."""

    joint: int  # from 1
    poses: int
    rms_rad: float | None  # inferred less recorded; None where no pose feels the joint
    expected_rad: float | None  # from what the model misses at other unseen poses, and how the joint is felt
    unfelt: int  # poses at which the target stands next to the joint's axis: left out
    misses: tuple[float, ...] = ()  # inferred less recorded over the doubt stated of that pose, in order of poses


def hidden_angles(recording: Recording) -> tuple[HiddenAngle, ...]:
    """Of every joint. DataError where the session has no instrument that sees single poses."""
    state = fit_geometry(session_of(recording.rig, recording.samples))
    samples = np.unique(state.rows.sample[state.rows.data])
    test = splits_of(state.drivers, samples, np.random.default_rng(SEED))[0].unseen[0]
    told = np.setdiff1d(samples, test)
    tried = splits_of(state.drivers, told, np.random.default_rng(SEED))[0].unseen[0]
    misfit = _misfit(state.select(np.setdiff1d(told, tried)).refitted(()), tried)
    known = state.select(told).refitted(())
    return tuple(_hidden(known, test, joint, misfit) for joint in range(known.session.arm.n_joints))


def _at(state: Fitted, samples: Ints) -> tuple[Chain, Floats, Floats, Floats]:
    """The first instrument at these samples: chain, values of its parameters, what it saw, joint readings."""
    measured = state.session.measured[0]
    chain = measured.problem.chain
    if not isinstance(chain, Chain):
        raise DataError("the first instrument of this session sees pairs of poses; hide an angle from another one")
    rows = np.flatnonzero(np.isin(measured.sample_rows[:, -1], samples))
    values = state.session.weighting.unweighted.of_block(0, state.geometry)
    return chain.select(rows), values, measured.problem.observed[rows], measured.problem.q_rad[rows]


def _misfit(state: Fitted, unseen: Ints) -> float:
    """Rms of what a model misses at poses that it was not fitted to, all their columns known."""
    chain, values, observed, q_rad = _at(state, unseen)
    return float(np.sqrt(np.mean((observed - chain.expect(values, q_rad)) ** 2)))


def _hidden(state: Fitted, test: Ints, joint: int, misfit: float) -> HiddenAngle:
    """`misfit`: known from other poses, for the doubt of an angle may not hang on the angle that is hidden."""
    chain, values, observed, q_rad = _at(state, test)
    limits = state.session.rig.arm.joints[joint]
    found = _inferred(chain, values, observed, q_rad, joint, (limits.lower_rad, limits.upper_rad))
    away = np.angle(np.exp(1j * (found - q_rad[:, joint])))
    inferred_rad = q_rad.copy()
    inferred_rad[:, joint] = found
    felt = np.linalg.norm(chain.by_joint(values, inferred_rad)[:, :, joint], axis=1)
    sure = FAINT_RAD * felt > misfit
    return HiddenAngle(
        joint + 1,
        int(sure.sum()),
        float(np.sqrt(np.mean(away[sure] ** 2))) if sure.any() else None,
        misfit * float(np.sqrt(np.mean(felt[sure] ** -2.0))) if sure.any() else None,
        int(np.sum(~sure)),
        tuple((away[sure] * felt[sure] / misfit).tolist()),
    )


def _inferred(
    chain: Chain, values: Floats, observed: Floats, q_rad: Floats, joint: int, limits: tuple[float, float]
) -> Floats:
    """(pose,) the angle that fits best: the best of a grid, then Gauss-Newton."""
    grid = np.linspace(*limits, STARTS)
    q = q_rad.copy()
    errors: list[Floats] = []
    for value in grid:
        q[:, joint] = value
        errors.append(np.sum((observed - chain.expect(values, q)) ** 2, axis=1))
    q[:, joint] = grid[np.argmin(np.stack(errors), axis=0)]
    for _ in range(STEPS):
        slope = chain.by_joint(values, q)[:, :, joint]
        left = observed - chain.expect(values, q)
        step = np.sum(slope * left, axis=1) / np.maximum(np.sum(slope**2, axis=1), 1e-300)
        q[:, joint] += np.clip(step, grid[0] - grid[1], grid[1] - grid[0])
        if float(np.max(np.abs(step))) < SETTLED_RAD:
            break
    return q[:, joint]
