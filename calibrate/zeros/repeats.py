"""Scatter of repeated poses after the model, and the lack-of-fit test that it allows.

Source: Draper, Smith, Applied Regression Analysis, 3rd ed. 1998, ch. 2.1 (pure error and lack of fit).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from calibrate.zeros.result import Repeats

Floats = NDArray[np.float64]


def repeat_scatter(
    whitener: Floats, misfit: Floats, repeat: NDArray[np.int64] | None, chi2: float, dof: int
) -> Repeats | None:
    """Repeats of groups with at least two poses; None without any.

    `misfit` (pose, 4) is taken after the model, so that joints that read a little differently do not count as scatter.
    """
    if repeat is None:
        return None
    scatter, free, groups = 0.0, 0, 0
    for group in np.unique(repeat[repeat >= 0]):
        rows = np.flatnonzero(repeat == group)
        if len(rows) < 2:
            continue
        deviation = misfit[rows] - misfit[rows].mean(axis=0)
        scatter += float(np.sum(np.einsum("nij,nj->ni", whitener[rows], deviation) ** 2))
        free += misfit.shape[1] * (len(rows) - 1)
        groups += 1
    if groups == 0:
        return None
    rest = max(dof - free, 1)
    ratio = max(chi2 - scatter, 0.0) / rest / (scatter / free) if scatter > 0.0 else float("inf")
    return Repeats(groups, free, scatter / free, ratio, float(fdtrc(rest, free, ratio)))
