"""How good a fit is: chi-square against stated noise and repeats, and the error of the tool over the workspace."""

from calibrate.fit.accuracy.fit_statistics import Alarm, against_stated, checks_nothing, spare_readings
from calibrate.fit.accuracy.free_space import (
    FELT_M,
    FreeSpaceStatus,
    Scatter,
    Workspace,
    free_space_error,
    target_by_parameter,
    variance_of_scatter,
)

__all__ = [
    "FELT_M",
    "Alarm",
    "FreeSpaceStatus",
    "Scatter",
    "Workspace",
    "against_stated",
    "checks_nothing",
    "free_space_error",
    "spare_readings",
    "target_by_parameter",
    "variance_of_scatter",
]
