"""Sparse regression over a library of functions, without ports: Brunton, Proctor, Kutz, PNAS 113(15), 2016.

PySINDy's own sequentially thresholded least squares over features and all their products of two.
"""

import warnings
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibeam.prove.baselines.method import Learnt

Floats = NDArray[np.float64]

THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0)  # sigmas; the best on a fifth of the training samples is taken
RIDGE = 1.0  # more functions than samples
INNER = 5
TOLD = 3


class SparseRegression:
    """Says which functions it kept."""

    name = "sparse regression (PySINDy)"
    needs = "pysindy"

    def learn(self, X: Floats, y: Floats, unseen: Floats, names: tuple[str, ...]) -> Learnt:
        kept = np.arange(len(X)) % INNER != 0
        library, words = _library(X, names)
        misses = [
            float(np.sum((y[~kept] - library[~kept] @ _fitted(library[kept], y[kept], t)) ** 2)) for t in THRESHOLDS
        ]
        found = _fitted(library, y, THRESHOLDS[int(np.argmin(misses))])
        size = np.sum(np.abs(found), axis=1)
        top = ", ".join(words[i] for i in np.argsort(-size)[:TOLD] if size[i] > 0.0)
        terms = int(np.sum(size > 0.0))
        says = "nothing" if terms == 0 else f"{terms} terms, largest: {top}; no place"
        return Learnt(_library(unseen, names)[0] @ found, says)


def _library(X: Floats, names: tuple[str, ...]) -> tuple[Floats, list[str]]:
    """(sample, function): constant, features, products of two."""
    i, j = np.triu_indices(X.shape[1])
    words = ["1", *names, *(f"{names[a]}*{names[b]}" for a, b in zip(i, j, strict=True))]
    return np.concatenate([np.ones((len(X), 1)), X, X[:, i] * X[:, j]], axis=1), words


def _fitted(library: Floats, y: Floats, threshold: float) -> Floats:
    """(function, channel)."""
    module: Any = import_module("pysindy.optimizers")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "sparsity parameter is too big": then nothing is left, which is an answer
        solved = module.STLSQ(threshold=threshold, alpha=RIDGE).fit(library, y)
    return np.atleast_2d(solved.coef_).T
