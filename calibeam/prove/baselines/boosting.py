"""Gradient-boosted trees: Friedman, Annals of Statistics 29(5), 2001. scikit-learn, GradientBoostingRegressor."""

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibeam.prove.baselines.method import Learnt

Floats = NDArray[np.float64]

TREES = 150
DEPTH = 3  # interactions of three features, as is usual
RATE = 0.05
ROWS = 0.7  # of the samples, for each tree
TOLD = 3  # features


class GradientBoosting:
    """Says which features it used most."""

    name = "gradient boosting"
    needs = "sklearn"

    def learn(self, X: Floats, y: Floats, unseen: Floats, names: tuple[str, ...]) -> Learnt:
        module: Any = import_module("sklearn.ensemble")
        columns: list[Floats] = []
        weight = np.zeros(X.shape[1])
        for channel in y.T:
            trees = module.GradientBoostingRegressor(
                n_estimators=TREES, max_depth=DEPTH, learning_rate=RATE, subsample=ROWS, random_state=0
            ).fit(X, channel)
            columns.append(trees.predict(unseen))
            weight += trees.feature_importances_
        top = ", ".join(names[i] for i in np.argsort(-weight)[:TOLD])
        return Learnt(np.stack(columns, axis=1), f"most used: {top}; no place")
