"""Other methods that a diagnosis is compared with: they learn what geometry alone leaves, and are asked where and why.

They get every number of a sample that the diagnosis has. None of them is needed to run, only to compare.
"""

import warnings
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.state.fitted import Fitted

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Learnt:
    """What a method predicts of unseen samples, and what it would report to a person."""

    predicted: Floats  # (sample, channel) in sigmas
    says: str


class Method(Protocol):
    """A method: one class, one line in METHODS."""

    @property
    def name(self) -> str: ...

    @property
    def needs(self) -> str:
        """The module that has to be installed."""
        ...

    def learn(self, X: Floats, y: Floats, unseen: Floats, names: tuple[str, ...]) -> Learnt:
        """From features (sample, feature) and misfit (sample, channel) in sigmas, for unseen features."""
        ...


def features(state: Fitted) -> tuple[Floats, tuple[str, ...]]:
    """(sample, feature) of mean zero and spread one, and their names. Columns that never change are left out."""
    d = state.drivers
    joints = range(1, d.n_joints + 1)
    blocks: list[tuple[list[str], Floats]] = [
        ([f"sin(q{j})" for j in joints], np.sin(d.q_rad)),
        ([f"cos(q{j})" for j in joints], np.cos(d.q_rad)),
        ([f"last_move{j}" for j in joints], d.last_move_rad),
        (["t"], d.t_s[:, None]),
    ]
    for name, values in (("approach", d.approach), ("qd", d.qd_rad_s), ("cmd_minus_q", d.cmd_minus_q_rad)):
        if values is not None:
            blocks.append(([f"{name}{j}" for j in joints], values))
    if d.payload_kg is not None:
        blocks.append((["payload"], d.payload_kg[:, None]))
    if d.psd_sum_v is not None:
        blocks.append((["psd1_sum", "psd2_sum"], d.psd_sum_v))
    blocks += [([f"temp_{where}"], values[:, None]) for where, values in d.temperatures_degC.items()]
    blocks += [([name], values[:, None]) for name, values in d.extra.items()]
    for name, readout in d.readouts.items():
        k = readout.predicted.shape[1]
        blocks.append(([f"{name} reading {i + 1}" for i in range(k)], np.nan_to_num(readout.predicted)))
        if readout.place is not None:
            blocks.append(([f"{name} place"], readout.place[:, None].astype(float)))
    names = [word for words, _ in blocks for word in words]
    table = np.concatenate([values for _, values in blocks], axis=1)
    spread = table.std(axis=0)
    kept = spread > 0.0
    scaled = (table[:, kept] - table[:, kept].mean(axis=0)) / spread[kept]
    return scaled, tuple(name for name, keep in zip(names, kept, strict=True) if keep)


TREES = 150
DEPTH = 3  # interactions of three features, as is usual
RATE = 0.05
ROWS = 0.7  # of the samples, for each tree
SHOWN = 3  # features


class GradientBoosting:
    """Reports which features it used most.

    Friedman, Annals of Statistics 29(5), 2001. scikit-learn, GradientBoostingRegressor.
    """

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
        top = ", ".join(names[i] for i in np.argsort(-weight)[:SHOWN])
        return Learnt(np.stack(columns, axis=1), f"most used: {top}; no place")


class GaussianProcess:
    """Smooth in everything at once: all features, one length for all, noise found with it.

    Rasmussen, Williams, 2006, ch. 2, 5. scikit-learn, GaussianProcessRegressor.
    """

    name = "Gaussian process"
    needs = "sklearn"

    def learn(self, X: Floats, y: Floats, unseen: Floats, names: tuple[str, ...]) -> Learnt:
        module: Any = import_module("sklearn.gaussian_process")
        kernels: Any = import_module("sklearn.gaussian_process.kernels")
        wide = float(np.sqrt(X.shape[1]))
        # Bounds so wide that they decide nothing: a length that runs off means "no structure".
        kernel = kernels.ConstantKernel(1.0, (1e-6, 1e4)) * kernels.RBF(wide, (1e-2 * wide, 1e3 * wide))
        kernel += kernels.WhiteKernel(1.0, (1e-3, 1e4))
        columns: list[Floats] = []
        for channel in y.T:
            process = module.GaussianProcessRegressor(kernel, random_state=0).fit(X, channel)
            columns.append(process.predict(unseen))
        return Learnt(np.stack(columns, axis=1), "no place and no cause")


THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0)  # sigmas; the best on a fifth of the training samples is taken
RIDGE = 1.0  # more functions than samples
INNER = 5


class SparseRegression:
    """A library of functions, without ports; reports which functions it kept.

    Brunton, Proctor, Kutz, PNAS 113(15), 2016. PySINDy's own sequentially thresholded least squares over features and
    all their products of two.
    """

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
        top = ", ".join(words[i] for i in np.argsort(-size)[:SHOWN] if size[i] > 0.0)
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


METHODS: tuple[Method, ...] = (GaussianProcess(), GradientBoosting(), SparseRegression())


def installed() -> tuple[Method, ...]:
    """Those whose library is there."""
    return tuple(m for m in METHODS if find_spec(m.needs) is not None)
