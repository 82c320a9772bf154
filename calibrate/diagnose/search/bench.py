"""A state on the bench: what judging additions, removals and replacements needs, computed once and if asked for."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose import limits
from calibrate.diagnose.search.score import (
    Removed,
    Scores,
    orthonormal,
    removed,
    scores,
)
from calibrate.diagnose.state.linearised import State
from calibrate.diagnose.state.visible import RANK, Menu, Sight, beyond, blind, menu_of, sight_of
from calibrate.model.effects.curve import unit
from calibrate.model.effects.term import Accepted, Term, at_joint

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

RECENT = 2  # menus that are kept, of closed terms and open ones: they are most of what a diagnosis holds


@dataclass(frozen=True, eq=False)
class Bench:
    """A state, seen by the search."""

    state: State
    given: Menu | None = None  # what is left of the menu where something was taken out of sight

    @cached_property
    def sight(self) -> Sight:
        return sight_of(self.state.rows) if self.given is None else self.given.sight

    @cached_property
    def blind(self) -> frozenset[str]:
        """Ports of joints that next to no reading follows: nothing can be found there, whatever its size."""
        return frozenset(blind(self._levers))

    @cached_property
    def _levers(self) -> Mapping[str, float]:
        """Port of each joint -> what one radian there does to all rows together."""
        n = self.state.drivers.n_joints
        angles = [unit(at_joint(joint, n)[0], joint - 1) for joint in range(1, n + 1)]
        return {one.port.where: float(np.linalg.norm(self.state.columns(one, np.zeros(0)))) for one in angles}

    @cached_property
    def candidates(self) -> tuple[Term, ...]:
        """All terms that could be seen at their place."""
        return tuple(term for term in self.state.candidates() if term.port.where not in self.blind)

    @property
    def menu(self) -> Menu:
        """Closed terms: those that name physics."""
        return recent_menu(self, False) if self.given is None else self.given

    @property
    def open_menu(self) -> Menu:
        """Open families of the catalogue: they compete, but name nothing."""
        return recent_menu(self, True)

    @cached_property
    def scores(self) -> Scores:
        return scores(self.menu)

    @cached_property
    def gone(self) -> tuple[Removed, ...]:
        """Each accepted term taken out alone."""
        return tuple(removed(self.state, self.sight, (i,)) for i in range(len(self.state.accepted)))

    @cached_property
    def rank(self) -> Ints:
        """(term,) combinations of coefficients of each accepted term that the others leave visible."""
        return np.array([self._rank(i) for i in range(len(self.state.accepted))], dtype=np.intp)

    @cached_property
    def share(self) -> Floats:
        """(term,) of each accepted term's square behind geometry that the other terms cannot absorb."""
        return np.array([self._share(i) for i in range(len(self.state.accepted))])

    @cached_property
    def bic(self) -> float:
        """Of the whole model; terms only are paid for, geometry is the same in all."""
        numbers = sum(len(a.inner) for a in self.state.accepted)
        return self.state.minus_two_log_likelihood + (int(self.rank.sum()) + numbers) * float(np.log(self.sight.data))

    @cached_property
    def noise_rad(self) -> float:
        """Turn of the joint that is felt most, which an average pose would show as one sigma."""
        most = max(self._levers.values())
        return float(np.sqrt(self.state.samples) / most) if most > 0.0 else 0.0

    @cached_property
    def plausible(self) -> NDArray[np.bool_]:
        """(term,) whether each accepted term is of a size that a machine could have."""
        accepted = self.state.accepted
        return np.array([a.term.plausible(a.coefficients, a.inner, self.noise_rad) for a in accepted], dtype=bool)

    def with_taken(self, proposed: Accepted) -> "Bench":
        """As if a term had been fitted: the linear part of a refit."""
        columns = self.state.columns(proposed.term, proposed.inner)
        return Bench(self.state, beyond(self.menu, orthonormal(self.sight.complement(columns.T).T, limits.VISIBLE)))

    def menu_of(self, terms: tuple[Term, ...]) -> Menu:
        return menu_of(self.state, terms, self.sight)

    def contribution(self, accepted: Accepted) -> Floats:
        """(row,) what a term adds to the expected rows."""
        return self.state.columns(accepted.term, accepted.inner) @ accepted.coefficients

    def _rank(self, i: int) -> int:
        accepted = self.state.accepted[i]
        columns = self.state.columns(accepted.term, accepted.inner)
        size = np.linalg.norm(columns, axis=0)
        left = self.gone[i].span.T @ (columns / np.where(size > 0.0, size, 1.0))
        return int(np.sum(np.linalg.eigvalsh(left.T @ left) > limits.VISIBLE))

    def behind(self, accepted: Accepted) -> Floats:
        """(row,) an accepted term's contribution that geometry cannot absorb."""
        amount = self.contribution(accepted)
        return amount - self.geometry @ (self.geometry.T @ amount)

    @cached_property
    def geometry(self) -> Floats:
        """(row, rank) orthonormal: what is fitted, without the terms."""
        own = np.isin(self.state.rows.owner, range(len(self.state.accepted)))
        return orthonormal(self.state.rows.geometry[:, ~own], RANK)

    def _share(self, i: int) -> float:
        """Of the contribution itself: combinations that the data do not need do not count."""
        behind = self.behind(self.state.accepted[i])
        alone = self.gone[i].span.T @ self.contribution(self.state.accepted[i])
        return float(alone @ alone / max(behind @ behind, 1e-300))


@lru_cache(maxsize=RECENT)
def recent_menu(bench: Bench, open_: bool) -> Menu:
    """Of closed terms or open families at a state; made again where a search comes back to an older one."""
    return bench.menu_of(tuple(term for term in bench.candidates if term.open is open_))
