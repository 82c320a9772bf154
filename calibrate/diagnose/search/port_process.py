"""A Gaussian process at each port in turn, over each driver or pair of drivers: where does structure without name sit?

Geometry is projected out and the marginal likelihood decides, noise and amplitude estimated, a length scale for every
driver (irrelevant ones win nothing). Sources: "put randomness on each state, see which one wants it", Kristensen,
Madsen, Jorgensen, Automatica 40(2), 2004; Rasmussen, Williams, Gaussian Processes for Machine Learning, 2006, sections
2.7 and 5.4.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.score import Removed
from calibrate.model.effects.curve import (
    SmoothCurve,
    acts_at,
    causes_of,
    curve,
    features,
    frequencies,
    unit,
)
from calibrate.model.effects.ports import JOINT, Place, Port

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.intp]

WAVES = {1: 10, 2: 5}  # of each driver, by their number
SCALES = (0.15, 0.3, 0.6, 1.2)  # length over half the range of a driver
LOUDNESS = (0.003, 0.03, 0.3, 3.0, 30.0, 300.0)  # variance of the process over that of the noise
UNFELT = 1e-18  # of the largest spectral density: below, no feature changes a digit of a gain
TIME = "time"  # port where all joints are off at once, each by its speed
CHUNK = 12  # curves that are asked at once
RIDGE = 1e-9  # of a Gram matrix's mean diagonal: far below what any process amplifies


@dataclass(frozen=True)
class Processes:
    """All ports with all drivers of one number, ready to be asked about any residual."""

    curves: tuple[SmoothCurve, ...]
    gram: Floats  # (curve, k, k) on the complement of what is fitted
    absorbed: Floats  # (curve, k, rank) coordinates in the basis of what is fitted
    products: Callable[[Floats], Floats]  # (curve, k, m) of the features with columns (row, m)
    basis: Floats  # (row, rank) of what is fitted
    rows: int  # data rows

    def gains(self, residual: Floats) -> Floats:
        """(curve, draw) of residuals (row, draw) on the complement."""
        return self._gains(self.gram, self.products(residual), np.sum(residual**2, axis=0))

    def best(
        self, residual: Floats, allowed: Bools, without: Removed | None = None, least: float = 0.0
    ) -> tuple[int, float] | None:
        """The curve that gains most of a residual (row,), and its gain; terms taken out first, if any.

        None where none gains more than `least`.

        No process explains more than plain least squares on its features, so curves are asked in the order of that
        bound until it falls below what is found.
        """
        count = len(self.curves)
        gram, along, rss = self.gram, self.products(residual[:, None]), float(residual @ residual)
        if without is not None:
            back = self.absorbed @ (self.basis.T @ without.span)
            gram, along = gram + back @ np.swapaxes(back, 1, 2), along + (back @ without.part)[:, :, None]
            rss += without.squares
        bound = np.where(allowed, self._bound(gram, along[..., 0], rss), -np.inf)
        order, found, most = np.argsort(-bound), -1, least
        for first in range(0, count, CHUNK):
            some = order[first : first + CHUNK]
            if bound[some[0]] <= most:
                break
            gain = np.where(allowed[some], self._gains(gram[some], along[some], np.array([rss]))[:, 0], -np.inf)
            best = int(np.argmax(gain))
            if gain[best] > most:
                found, most = int(some[best]), float(gain[best])
        return None if found < 0 else (found, most)

    def _bound(self, gram: Floats, along: Floats, rss: float) -> Floats:
        """(curve,) gain with everything that the features can follow, and nothing paid but for scales."""
        k = gram.shape[1]
        ridge = RIDGE * np.maximum(np.abs(np.trace(gram, axis1=1, axis2=2)) / max(k, 1), 1e-200)
        solved = np.linalg.solve(gram + ridge[:, None, None] * np.eye(k), along[..., None])[..., 0]
        left = np.maximum(rss - np.einsum("ck,ck->c", along, solved), 1e-12 * rss)
        return np.asarray(self.rows * np.log(rss / left) - (self._drivers + 1) * np.log(self.rows))

    @property
    def _drivers(self) -> int:
        return len(self.curves[0].depends_on) if self.curves else 1

    def _gains(self, gram: Floats, along: Floats, rss: Floats) -> Floats:
        best = np.full((len(along), along.shape[2]), -np.inf)
        omega = frequencies(self._drivers, WAVES[self._drivers])
        for scales in product(SCALES, repeat=self._drivers):
            density = np.exp(-0.5 * np.sum((omega * np.array(scales)[:, None]) ** 2, axis=0))
            best = np.maximum(best, self._of_density(density, gram, along, rss))
        return best - (self._drivers + 1) * np.log(self.rows)

    def _of_density(self, density: Floats, gram: Floats, along: Floats, rss: Floats) -> Floats:
        felt = density > UNFELT * density.max()
        root = np.sqrt(density[felt] / density.sum())
        w, V = np.linalg.eigh(gram[:, felt][:, :, felt] * root[:, None] * root)
        w = np.maximum(w, 0.0)
        squares = (np.swapaxes(V, 1, 2) @ (root[:, None] * along[:, felt])) ** 2
        level = np.maximum(np.sum(w, axis=1), 1e-300) / self.rows
        best = np.full(along.shape[::2], -np.inf)
        for loud in LOUDNESS:
            ratio = (loud / level)[:, None]
            shrunk = ratio / (1.0 + ratio * w)
            left = np.maximum(rss - (shrunk[:, None] @ squares)[:, 0], 1e-12 * rss)
            gain = self.rows * np.log(rss / left) - np.sum(np.log1p(ratio * w), axis=1)[:, None]
            best = np.maximum(best, gain)
        return best


def processes(bench: Bench, places: Sequence[tuple[Port, int]], drivers: int) -> Processes:
    """Curves of every single driver (1) or pair (2) at each port and component."""
    causes, waves = causes_of(bench.state.drivers), WAVES[drivers]
    names = [c for c in combinations(causes, drivers) if drivers == 1 or _may_pair(c)]
    wanted = [(place, c) for place in places for c in names if all(acts_at(name, place[0].where) for name in c)]
    curves = tuple(curve(port, component, c, waves) for (port, component), c in wanted)
    basis = bench.sight.basis
    if not curves:

        def nothing(columns: Floats) -> Floats:
            return np.zeros((0, 1, columns.shape[1]))

        return Processes((), np.zeros((0, 1, 1)), nothing(basis), nothing, basis, bench.sight.data)
    shapes = np.array([features([causes[n] for n in c], waves).T for c in names])
    asked: dict[tuple[Port, int], list[int]] = {}
    for place, c in wanted:
        asked.setdefault(place, []).append(names.index(c))
    of_names = {mine: shapes[list(mine)] for mine in set(map(tuple, asked.values()))}  # many places share them
    felt = [_Felt.of(bench, place, of_names[tuple(mine)]) for place, mine in asked.items()]

    def products(columns: Floats) -> Floats:
        return np.concatenate([one.products(columns) for one in felt])

    absorbed = products(basis)
    gram = np.concatenate([one.gram for one in felt])
    gram -= absorbed @ np.swapaxes(absorbed, 1, 2)
    return Processes(curves, gram, absorbed, products, basis, bench.sight.data)


@dataclass(frozen=True, eq=False)
class _Felt:
    """Curves at one component of a port: a feature is a function of the sample, a lever the rows' way to follow it.

    Their products with anything over the rows go through sums over the rows of each sample, so that features through
    levers are never stored.
    """

    shapes: Floats  # (curve, k, sample) of the drivers or pairs that act here
    lever: csr_matrix  # (sample, row)

    @classmethod
    def of(cls, bench: Bench, place: tuple[Port, int], shapes: Floats) -> "_Felt":
        rows, felt = bench.state.rows, lever(bench, *place)
        mine, shape = np.flatnonzero(rows.data), (shapes.shape[2], len(felt))
        if rows.earlier is None or rows.kept is None:
            return cls(shapes, csr_matrix((felt[mine], (rows.sample[mine], mine)), shape=shape))
        own, old = felt / (1.0 - rows.kept), np.flatnonzero(rows.earlier >= 0)
        less = csr_matrix((rows.kept[old] * own[old], (rows.earlier[old], old)), shape=shape)
        return cls(shapes, csr_matrix((own[mine], (rows.sample[mine], mine)), shape=shape) - less)

    def products(self, columns: Floats) -> Floats:
        """(curve, k, m) with columns (row, m)."""
        count, k, samples = self.shapes.shape
        through = np.asarray(self.lever @ columns)
        return (self.shapes.reshape(-1, samples) @ through).reshape(count, k, -1)

    @property
    def gram(self) -> Floats:
        """(curve, k, k)"""
        square = self.lever @ self.lever.T  # diagonal where every row follows one sample
        felt = np.asarray(square @ self.shapes.reshape(-1, self.shapes.shape[2]).T)
        return self.shapes @ np.moveaxis(felt.reshape(self.shapes.shape[2], *self.shapes.shape[:2]), 0, 1)


def lever(bench: Bench, port: Port, component: int) -> Floats:
    """(row,) derivative of the expected rows by one component of a port."""
    return bench.state.columns(unit(port, component), np.zeros(0))[:, 0]


def places_of(bench: Bench) -> tuple[tuple[Port, int], ...]:
    """Ports of the catalogue and the components where a candidate acts.

    Lengths of links are left to geometry, and what a late clock, a load or a leaning base does at each joint to the
    joint itself.
    """
    found: dict[tuple[Port, int], tuple[Port, int]] = {}
    drivers = bench.state.drivers
    for term in {(t.port, t.physics): t for t in bench.candidates}.values():
        inner = np.array([spec.grid[len(spec.grid) // 2] for spec in term.inner])
        where = term.port.where
        of_arm = term.port.place is Place.JOINTS and not where.startswith(JOINT)
        if of_arm or term.port.past_encoders or (where.startswith("link") and not where.endswith(".tilt")):
            continue
        acts = np.any(term.basis(drivers, inner) != 0.0, axis=(0, 2))
        for component in np.flatnonzero(acts):
            found.setdefault((term.port, int(component)), (term.port, int(component)))
    return tuple(found.values())


def _may_pair(names: tuple[str, ...]) -> bool:
    """Joint angles with each other: pairs of anything are too many to be separated."""
    return all(name.startswith("q") and name[1:].isdigit() for name in names)
