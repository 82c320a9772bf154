"""The proof by rows that the fit has not seen, told for each instrument in its own unit."""

from collections.abc import Callable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.identification.result import Unseen
from calibrate.identification.rounds import Fitted
from calibrate.joint_problem import JointProblem
from calibrate.parameters import Parameter
from calibrate.problem import Problem
from calibrate.uncertainty.held_out import held_out
from calibrate.uncertainty.splits import Split
from calibrate.weighting import Weighting

Floats = NDArray[np.float64]

FEWEST_ROWS = 15  # below, a fifth held out is two poses and the proof is luck


def proof(
    fitted: Fitted, nominal: tuple[Parameter, ...], drawn: Floats, share: float, rng: Generator
) -> tuple[Unseen, ...]:
    """`share` of the rows of the samples, drawn by `rng`, predicted from the others by every instrument.

    `nominal` parameters with `drawn` (param,) values: the arm held as drawn, for the error before. Empty with too few
    rows, or where a refit does not come to an end.
    """
    split = split_by_rows(fitted.weighting, share, rng)
    if split is None:
        return ()
    after = fitted.problem.with_parameters(fitted.fit.parameters)
    before = fitted.problem.with_parameters(nominal)
    out: list[Unseen] = []
    for index, measured in enumerate(fitted.weighting.measured):
        rows = _rows_of(after, index, split)
        old = held_out(before, split, drawn, _measure(index)) if rows else None
        new = held_out(after, split, fitted.fit.theta, _measure(index)) if rows else None
        if old and new and old.rms is not None and new.rms is not None and new.chi is not None:
            out.append(Unseen(measured.name, split.says, rows, old.rms, new.rms, new.chi))
    return tuple(out)


def split_by_rows(weighting: Weighting, share: float, rng: Generator) -> Split | None:
    """Unseen is every observation that an unseen row takes part in: no row is on both sides. None with too few."""
    rows = np.unique(np.concatenate([m.sample_rows.ravel() for m in weighting.measured]))
    if len(rows) < FEWEST_ROWS:
        return None
    drawn = rng.permutation(rows)[: max(1, round(share * len(rows)))]
    unseen = np.concatenate([np.isin(m.sample_rows, drawn).any(axis=1) for m in weighting.measured])
    return Split(f"random {share:.0%} of the rows", (np.flatnonzero(unseen),))


def lengths(problem: JointProblem, index: int, theta: Floats) -> Floats:
    """(row,) length of one instrument's misfit in its own unit, for values (param,) of the whole fit."""
    block, own = problem.blocks[index], problem.of_block(index, theta)
    misfit = block.misfit(own) if isinstance(block, Problem) else block.residual(own).reshape(block.rows, -1)
    return np.linalg.norm(misfit, axis=1)


def _measure(index: int) -> Callable[[JointProblem, Floats], Floats]:
    def measure(problem: JointProblem, theta: Floats) -> Floats:
        return lengths(problem, index, theta)

    return measure


def _rows_of(problem: JointProblem, index: int, split: Split) -> int:
    first = problem.first_rows[index]
    unseen = split.unseen[0]
    return int(np.sum((unseen >= first) & (unseen < first + problem.blocks[index].rows)))
