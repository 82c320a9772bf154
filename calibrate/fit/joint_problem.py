"""Several instruments in one fit: blocks of whitened rows side by side, parameters of one name are one unknown.

Rows of one sample whose noise is shared with second encoders are made independent (fit/noise/scatter.py).
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.fit.noise.scatter import SharedScatter
from calibrate.model.parameters import Parameter
from calibrate.model.problem import Block, Problem
from calibrate.model.unknowns import Unknowns

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Witnessed:
    """What blocks share with the rows of one of them, all of which are kept, whatever is selected."""

    scatter: SharedScatter  # over the rows of the blocks
    problem: Problem  # all rows of the witness

    def added(self, block: Problem, index: int, seen: Floats) -> Floats:
        """(row * k, ...) whitened, what the witness' rows (row, channel, ...) add to those of a block."""
        lever = self.scatter.levers[index]
        if lever is None:
            return np.zeros((block.rows * block.observed.shape[1], *seen.shape[2:]))
        nothing = np.zeros((block.rows, block.observed.shape[1], *seen.shape[2:]))
        alone = self.scatter.alone(index, nothing, seen).reshape(*nothing.shape[:2], -1)
        return (block.whitener @ alone).reshape(-1, *seen.shape[2:])


@dataclass(frozen=True)
class JointProblem:
    """LeastSquares over the union of the blocks' parameters, in the order of their first appearance.

    DataError where two blocks disagree on what a shared parameter is: unit, start, prior, bounds or plausible size. A
    parameter is free when any block that has it leaves it free (a placement may be idle in one block and not in
    another). `chosen`, from `with_parameters`, overrides the union: the same names in the same order.
    """

    blocks: tuple[Block, ...]
    chosen: tuple[Parameter, ...] | None = None
    witnessed: Witnessed | None = None

    def __post_init__(self) -> None:
        if not self.blocks:
            raise DataError("joint problem: no blocks at all; give at least one instrument's observations")
        merged = tuple(p.name for p in self.unknowns.parameters)
        if self.chosen is not None and tuple(p.name for p in self.chosen) != merged:
            raise DataError(f"joint problem: chosen parameters are not those of the blocks in order: {merged}")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.unknowns.parameters if self.chosen is None else self.chosen

    @property
    def rows(self) -> int:
        """Observation rows of all blocks, counted through in the order of the blocks."""
        return sum(block.rows for block in self.blocks)

    @property
    def row_widths(self) -> Indices:
        """(row,) residual values of each; of a block that does not state it, one: a known length."""
        one = [getattr(block, "row_widths", np.ones(block.rows, dtype=np.intp)) for block in self.blocks]
        return np.concatenate(one)

    @property
    def log_det_noise(self) -> float:
        """Logarithm of the determinant of the covariance of all residual values, which are independent as whitened."""
        return sum(block.log_det_noise for block in self.blocks)

    def residual(self, theta: Floats) -> Floats:
        return np.concatenate(self._residuals(theta))

    def _residuals(self, theta: Floats) -> list[Floats]:
        """Of each block (residual value,)."""
        return [self.residual_of(i, theta) for i in range(len(self.blocks))]

    def residual_of(self, index: int, theta: Floats) -> Floats:
        """(residual value,) of one block, whitened, from the values (param,) of the whole fit."""
        block = self.blocks[index]
        own = block.residual(self.of_block(index, theta))
        if self.witnessed is None or not isinstance(block, Problem) or self.witnessed.scatter.levers[index] is None:
            return own
        of_witness = self.of_block(self.witnessed.scatter.witness, theta)
        return own + self.witnessed.added(block, index, self.witnessed.problem.misfit(of_witness))

    def jacobian(self, theta: Floats) -> Floats:
        parts = [block.jacobian(self.of_block(i, theta)) for i, block in enumerate(self.blocks)]
        out = np.zeros((sum(len(part) for part in parts), len(self.parameters)))
        first = 0
        for i, (part, columns) in enumerate(zip(parts, self.unknowns.columns, strict=True)):
            out[first : first + len(part), columns] = part
            self._share_slope(i, theta, out[first : first + len(part)])
            first += len(part)
        return out

    def jacobian_of(self, index: int, theta: Floats) -> Floats:
        """(residual value, param) of one block by all parameters."""
        out = self.spread(index, self.blocks[index].jacobian(self.of_block(index, theta)))
        self._share_slope(index, theta, out)
        return out

    def _share_slope(self, index: int, theta: Floats, out: Floats) -> None:
        """Adds what a block shares with the witness to its rows (residual value, param)."""
        block = self.blocks[index]
        if self.witnessed is None or not isinstance(block, Problem) or self.witnessed.scatter.levers[index] is None:
            return
        witness, seen = self.witnessed.scatter.witness, self.witnessed.problem
        slope = seen.chain.jacobian(self.of_block(witness, theta), seen.q_rad)
        out[:, self.unknowns.columns[witness]] += self.witnessed.added(block, index, slope)

    def with_parameters(self, parameters: tuple[Parameter, ...]) -> "JointProblem":
        """The same blocks with these held, bounded or assumed otherwise."""
        return replace(self, chosen=parameters)

    def with_blocks(self, blocks: tuple[Block, ...]) -> "JointProblem":
        """Other weights, the same unknowns."""
        return JointProblem(blocks, self.parameters, self.witnessed)

    def select(self, rows: Indices) -> "JointProblem":
        """Some of the rows, counted through all blocks; unknowns stay, also those that no row left speaks of."""
        each = zip(self.blocks, self.first_rows, strict=True)
        own = [rows[(rows >= first) & (rows < first + block.rows)] - first for block, first in each]
        cut = self.with_blocks(tuple(block.select(r) for block, r in zip(self.blocks, own, strict=True)))
        if self.witnessed is None:
            return cut
        return replace(cut, witnessed=replace(self.witnessed, scatter=self.witnessed.scatter.select(own)))

    def fulfilled(self, theta: Floats) -> "JointProblem":
        """Where rank is to be judged: conditions at joint readings that fulfil them (Problem.fulfilled)."""
        values = (theta[columns] for columns in self.unknowns.columns)
        each = zip(self.blocks, values, strict=True)
        return self.with_blocks(tuple(b.fulfilled(own) if isinstance(b, Problem) else b for b, own in each))

    def of_block(self, block: int, theta: Floats) -> Floats:
        """The values of one block's own parameters."""
        return self.unknowns.of_block(block, theta)

    def spread(self, block: int, columns: Floats) -> Floats:
        """(..., param) derivatives (..., own) by one block's own parameters, put where those stand among all."""
        return self.unknowns.spread(block, columns)

    def by_row(self, theta: Floats) -> Floats:
        """(rows,) sum of the squared whitened residuals of each row: chi-square of k where nothing is wrong."""
        parts = [
            np.sum(residual.reshape(block.rows, -1) ** 2, axis=1) if block.rows else np.zeros(0)
            for block, residual in zip(self.blocks, self._residuals(theta), strict=True)
        ]
        return np.concatenate(parts)

    @cached_property
    def first_rows(self) -> tuple[int, ...]:
        """Of each block, its first row among those of all."""
        return tuple(np.concatenate([[0], np.cumsum([block.rows for block in self.blocks])[:-1]]).astype(int).tolist())

    @cached_property
    def unknowns(self) -> Unknowns:
        return Unknowns([block.parameters for block in self.blocks])
