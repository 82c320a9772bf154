"""What can be wrong with what a fit is given; failures of the mathematics itself are statuses (fit.Status)."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray


class DataError(ValueError):
    """Too few poses, a missing column, shapes that disagree; the message states what, where, value and remedy."""


class UndeterminedError(DataError, np.linalg.LinAlgError):
    """Data and priors leave parameters open at the end of a fit; `columns` are their places among the free ones."""

    def __init__(self, says: str, columns: Sequence[int] = ()) -> None:
        super().__init__(says)
        self.columns = tuple(columns)


@contextmanager
def naming_undetermined(free_names: Sequence[str], q_rad: NDArray[np.float64]) -> Generator[None]:
    """An UndeterminedError with the names of its parameters, and of joints whose readings (row, joint) never change."""
    try:
        yield
    except UndeterminedError as error:
        names = ", ".join(free_names[column] for column in error.columns[:5])
        still = [f"q{j + 1}_rad = {q_rad[0, j]:g} in every row" for j in np.flatnonzero(np.ptp(q_rad, axis=0) == 0.0)]
        why = f" ({', '.join(still)})" if still else ""
        raise UndeterminedError(
            f"not determined by these samples: {names}{why}; check the joint angles, measure more and more different "
            "poses, or state in the rig what is known",
            error.columns,
        ) from error
