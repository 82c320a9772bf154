"""The proof by poses that the fit has not seen."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.fit import Status
from calibrate.parameters import Parameter, start_values
from calibrate.problem import Problem
from calibrate.zeros.ranked_fit import FAR, NEAR, fitted
from calibrate.zeros.result import HeldOut

Floats = NDArray[np.float64]

FEWEST_POSES = 15  # below, a fifth held out is two poses and the proof is luck


def held_out_error(
    problem: Problem, nominal: tuple[Parameter, ...], theta: Floats, share: float, rng: Generator
) -> HeldOut | None:
    """Random split: refit on the rest from `theta` (param,), predict the held-out poses.

    `nominal` are the parameters of the arm as drawn (only places and mount free) for the error before. None with too
    few poses, or where the refit on the rest does not converge.
    """
    n = len(problem.q_rad)
    if n < FEWEST_POSES:
        return None
    order = rng.permutation(n)
    unseen, used = np.sort(order[: max(1, round(share * n))]), np.sort(order[max(1, round(share * n)) :])
    train, test = problem.select(used), problem.select(unseen)
    after = fitted(train, theta, NEAR)
    as_drawn = np.where([p.free for p in nominal], theta, start_values(nominal))
    before = fitted(train.with_parameters(nominal), as_drawn, FAR)
    if after.status is not Status.CONVERGED or before.status is Status.NOT_FINITE:
        return None
    return HeldOut(
        f"random {share:.0%} of the poses",
        len(unseen),
        float(np.sqrt(np.mean(test.misfit(before.theta) ** 2))),
        float(np.sqrt(np.mean(test.misfit(after.theta) ** 2))),
        float(np.sqrt(np.mean(test.residual(after.theta) ** 2))),
    )
