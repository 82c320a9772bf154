"""A Gaussian process at each port in turn, over each driver or pair of drivers: where does structure without name sit?

Geometry is projected out and the marginal likelihood decides, noise and amplitude estimated, a length scale for every
driver (irrelevant ones win nothing). Sources: "put randomness on each state, see which one wants it", Kristensen,
Madsen, Jorgensen, Automatica 40(2), 2004; Rasmussen, Williams, Gaussian Processes for Machine Learning, 2006, sections
2.7 and 5.4.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.causes import acts_at, causes_of
from calibrate.diagnose.curve import UNKNOWN, Curve, at_component, curve, features, frequencies
from calibrate.diagnose.score import Removed
from calibrate.effects.drivers import Drivers
from calibrate.effects.ports import Port
from calibrate.effects.term import Shape

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

WAVES = {1: 10, 2: 5}  # of each driver, by their number
SCALES = (0.15, 0.3, 0.6, 1.2)  # length over half the range of a driver
LOUDNESS = (0.003, 0.03, 0.3, 3.0, 30.0, 300.0)  # variance of the process over that of the noise
TIME = "time"  # port where all joints are off at once, each by its speed
CHUNK = 12  # curves that are asked at once
RIDGE = 1e-9  # of a Gram matrix's mean diagonal: far below what any process amplifies


@dataclass(frozen=True)
class Processes:
    """All ports with all drivers of one number, ready to be asked about any residual."""

    curves: tuple[Curve, ...]
    gram: Floats  # (curve, k, k) on the complement of what is fitted
    columns: Floats  # (curve * k, row) on the complement
    raw: Floats  # (curve * k, row)
    rows: int  # data rows

    def gains(self, residual: Floats) -> Floats:
        """(curve, draw) of residuals (row, draw) on the complement."""
        count, k = self.gram.shape[:2]
        return self._gains(self.gram, (self.columns @ residual).reshape(count, k, -1), np.sum(residual**2, axis=0))

    def best(
        self, residual: Floats, allowed: Bools, without: Removed | None = None, least: float = 0.0
    ) -> tuple[int, float] | None:
        """The curve that gains most of a residual (row,), and its gain; terms taken out first, if any.

        None where none gains more than `least`.

        No process explains more than plain least squares on its features, so curves are asked in the order of that
        bound until it falls below what is found.
        """
        count, k = self.gram.shape[:2]
        gram, along, rss = self.gram, (self.columns @ residual).reshape(count, k, 1), float(residual @ residual)
        if without is not None:
            back = (self.raw @ without.span).reshape(count, k, without.span.shape[1])
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
        ridge = RIDGE * np.maximum(np.trace(gram, axis1=1, axis2=2) / max(k, 1), 1e-300)
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
        root = np.sqrt(density / density.sum())
        w, V = np.linalg.eigh(gram * root[:, None] * root)
        w = np.maximum(w, 0.0)
        turned = np.swapaxes(V, 1, 2) @ (root[:, None] * along)
        level = np.maximum(np.sum(w, axis=1), 1e-300) / self.rows
        best = np.full(along.shape[::2], -np.inf)
        for loud in LOUDNESS:
            ratio = (loud / level)[:, None]
            shrunk = ratio / (1.0 + ratio * w)
            left = np.maximum(rss - np.sum(shrunk[:, :, None] * turned**2, axis=1), 1e-12 * rss)
            gain = self.rows * np.log(rss / left) - np.sum(np.log1p(ratio * w), axis=1)[:, None]
            best = np.maximum(best, gain)
        return best


def processes(bench: Bench, places: Sequence[tuple[Port, int]], drivers: int) -> Processes:
    """Curves of every single driver (1) or pair (2) at each port and component."""
    causes, waves = causes_of(bench.state.drivers), WAVES[drivers]
    names = [c for c in combinations(causes, drivers) if drivers == 1 or _may_pair(c)]
    wanted = [(place, c) for place in places for c in names if all(acts_at(name, place[0].where) for name in c)]
    curves = tuple(curve(port, component, c, waves) for (port, component), c in wanted)
    if not curves:
        nothing = np.zeros((0, len(bench.sight.residual)))
        return Processes((), np.zeros((0, 1, 1)), nothing, nothing, bench.sight.data)
    felt = {place: lever(bench, *place) for place in places}
    sample = np.maximum(bench.state.rows.sample, 0)
    shapes = {c: features([causes[n] for n in c], waves).T[:, sample] for c in names}
    raw = np.concatenate([shapes[c] * felt[place] for place, c in wanted])
    seen = bench.sight.complement(raw)
    blocks = seen.reshape(len(curves), -1, seen.shape[1])
    return Processes(curves, blocks @ np.swapaxes(blocks, 1, 2), seen, raw, bench.sight.data)


def lever(bench: Bench, port: Port, component: int) -> Floats:
    """(row,) derivative of the expected rows by one component of a port."""
    return bench.state.columns(_Unit(port, (), Shape.CONSTANT, UNKNOWN, component=component), np.zeros(0))[:, 0]


def places_of(bench: Bench) -> tuple[tuple[Port, int], ...]:
    """Ports of the catalogue and the components where a candidate acts.

    Lengths of links are left to geometry, and what a late clock does at each joint to the joint itself.
    """
    found: dict[tuple[Port, int], tuple[Port, int]] = {}
    drivers = bench.state.drivers
    for term in {(t.port, t.physics): t for t in bench.state.candidates()}.values():
        inner = np.array([spec.grid[len(spec.grid) // 2] for spec in term.inner])
        where = term.port.where
        if where == TIME or term.port.past_encoders or (where.startswith("link") and not where.endswith(".tilt")):
            continue
        acts = np.any(term.basis(drivers, inner) != 0.0, axis=(0, 2))
        for component in np.flatnonzero(acts):
            found.setdefault((term.port, int(component)), (term.port, int(component)))
    return tuple(found.values())


@dataclass(frozen=True)
class _Unit(Curve):
    """Constant one at a component: its column is the sensitivity of all rows."""

    def basis(self, drivers: Drivers, inner: Floats) -> Floats:
        return at_component(self.port, self.component, np.ones((len(drivers.t_s), 1)), drivers)


def _may_pair(names: tuple[str, ...]) -> bool:
    """Joint angles with each other: pairs of anything are too many to be told apart."""
    return all(name.startswith("q") and name[1:].isdigit() for name in names)
