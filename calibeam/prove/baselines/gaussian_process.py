"""Gaussian process over all features, one length for all, noise found with it: Rasmussen, Williams, 2006, ch. 2, 5.

scikit-learn, GaussianProcessRegressor.
"""

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibeam.prove.baselines.method import Learnt

Floats = NDArray[np.float64]


class GaussianProcess:
    """Smooth in everything at once."""

    name = "Gaussian process"
    needs = "sklearn"

    def learn(self, X: Floats, y: Floats, unseen: Floats, names: tuple[str, ...]) -> Learnt:
        module: Any = import_module("sklearn.gaussian_process")
        kernels: Any = import_module("sklearn.gaussian_process.kernels")
        wide = float(np.sqrt(X.shape[1]))
        # Bounds so wide that they decide nothing: a length that runs off says "no structure".
        kernel = kernels.ConstantKernel(1.0, (1e-6, 1e4)) * kernels.RBF(wide, (1e-2 * wide, 1e3 * wide))
        kernel += kernels.WhiteKernel(1.0, (1e-3, 1e4))
        columns: list[Floats] = []
        for channel in y.T:
            process = module.GaussianProcessRegressor(kernel, random_state=0).fit(X, channel)
            columns.append(process.predict(unseen))
        return Learnt(np.stack(columns, axis=1), "no place and no cause")
