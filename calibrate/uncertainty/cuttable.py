"""The seam of proofs that leave rows out: a least-squares problem that can be cut and whose unknowns can be held."""

from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from calibrate.parameters import Parameter

Floats = NDArray[np.float64]


class Cuttable(Protocol):
    """`Problem` and `JointProblem` are such. Unknowns keep their names and order in a cut."""

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    @property
    def rows(self) -> int:
        """Observation rows (poses, pairs, ...), what `select` chooses from."""
        ...

    def residual(self, theta: Floats) -> Floats:
        """(rows * k,) whitened, expected minus observed."""
        ...

    def jacobian(self, theta: Floats) -> Floats:
        """(rows * k, param) derivative of `residual`."""
        ...

    def select(self, rows: NDArray[np.intp]) -> Self:
        """The same problem over some rows; one may be there several times."""
        ...

    def with_parameters(self, parameters: tuple[Parameter, ...]) -> Self:
        """The same rows with parameters held, bounded or believed otherwise."""
        ...
