"""The seam of proofs that leave rows out: a least-squares problem that can be cut and whose unknowns can be held."""

from typing import Protocol, Self

from calibrate.joint_problem import Block
from calibrate.parameters import Parameter


class Cuttable(Block, Protocol):
    """`Problem` and `JointProblem` are such. Unknowns keep their names and order in a cut.

    `select` may name a row several times. Rows of a `JointProblem` are those of all blocks, each with its own number of
    residuals.
    """

    def with_parameters(self, parameters: tuple[Parameter, ...]) -> Self:
        """The same rows with parameters held, bounded or believed otherwise."""
        ...
