"""All rivals, one line each, and which of them are installed: none is needed to run, only to compare."""

from importlib.util import find_spec

from calibeam.prove.baselines.boosting import GradientBoosting
from calibeam.prove.baselines.gaussian_process import GaussianProcess
from calibeam.prove.baselines.method import Method
from calibeam.prove.baselines.sparse_regression import SparseRegression

METHODS: tuple[Method, ...] = (GaussianProcess(), GradientBoosting(), SparseRegression())


def installed() -> tuple[Method, ...]:
    """Those whose library is there."""
    return tuple(m for m in METHODS if find_spec(m.needs) is not None)
