"""Parameters of several instruments side by side: those of one name are one unknown."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.model.parameters import Parameter, index_of

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Unknowns:
    """In the order of their first appearance. DataError where two blocks disagree on what a parameter is.

    A parameter is free when any block that has it leaves it free (a placement may be idle in one block and not in
    another).
    """

    of_blocks: Sequence[tuple[Parameter, ...]]

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        found: dict[str, Parameter] = {}
        for parameters in self.of_blocks:
            for p in parameters:
                found[p.name] = _agreed(found[p.name], p) if p.name in found else p
        return tuple(found.values())

    @cached_property
    def columns(self) -> tuple[Indices, ...]:
        """Of each block (own,): where its parameters stand among all."""
        index = index_of(self.parameters)
        return tuple(np.array([index[p.name] for p in own], dtype=np.intp) for own in self.of_blocks)

    def of_block(self, block: int, theta: Floats) -> Floats:
        """The values of one block's own parameters."""
        return theta[self.columns[block]]

    def spread(self, block: int, columns: Floats) -> Floats:
        """(..., param) derivatives (..., own) by one block's own parameters, put where those stand among all."""
        out = np.zeros((*columns.shape[:-1], len(self.parameters)))
        out[..., self.columns[block]] = columns
        return out


def _agreed(one: Parameter, other: Parameter) -> Parameter:
    for what in ("unit", "start", "prior", "lower", "upper", "plausible"):
        a, b = getattr(one, what), getattr(other, what)
        if a != b:
            raise DataError(
                f"joint problem: parameter {one.name} has {what} {a} in one block and {b} in another; "
                "build all blocks from the same rig"
            )
    return one if one.free else replace(one, free=other.free)
