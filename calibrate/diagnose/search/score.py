"""How much every candidate would explain: gain of the Bayesian information criterion, in a model or with a term out.

gain = -n ln(1 - SS / RSS) - k ln n, SS what the candidate takes of the residual's square after geometry. Source:
Schwarz, Estimating the dimension of a model, Ann. Statist. 6(2), 1978, with the noise estimated (concentrated
likelihood).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose import limits
from calibrate.diagnose.state.linearised import State
from calibrate.diagnose.state.visible import EntryBlock, Menu, Sight, inverse_of

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

RIDGE = 1e-9  # of a unit column: keeps singular ones finite, far below what is visible


@dataclass(frozen=True)
class Removed:
    """Terms taken out of a model, the rest refitted: what comes back into sight."""

    span: Floats  # (row, k) orthonormal: what the others cannot absorb of them, in the span of what is fitted
    part: Floats  # (k,) of the residual along it
    cost: int  # parameters that are no longer paid for

    @property
    def squares(self) -> float:
        return float(self.part @ self.part)


@dataclass(frozen=True)
class Scores:
    """Of every entry of a menu."""

    gain: Floats  # (entry,) of BIC; -inf where nothing is visible
    rank: Ints  # (entry,) visible combinations of coefficients
    squares: Floats  # (entry,)


def removed(state: State, sight: Sight, terms: tuple[int, ...]) -> Removed:
    """Accepted terms (indices) of a state, to be taken out."""
    owner = state.rows.owner
    own = sight.dual[:, np.isin(owner, terms)]
    span = orthonormal(own)
    amount = np.zeros(len(sight.residual))
    for i in terms:
        amount += state.columns(state.accepted[i].term, state.accepted[i].inner) @ state.accepted[i].coefficients
    return Removed(span, span.T @ (amount + state.rows.residual), own.shape[1])


def orthonormal(columns: Floats, tolerance: float = 1e-8) -> Floats:
    """(row, rank) basis of the span of columns (row, k) of any lengths."""
    size = np.linalg.norm(columns, axis=0)
    U, s, _ = np.linalg.svd(columns / np.where(size > 0.0, size, 1.0), full_matrices=False)
    return U[:, s > tolerance * max(s[0], 1e-300)] if len(s) else U


def bic_gain(squares: Floats, rss: float | Floats, parameters: Floats | Ints, n: int) -> Floats:
    """Of explaining `squares` of `rss` with so many parameters."""
    left = np.maximum(1.0 - squares / np.maximum(rss, 1e-300), 1e-12)
    return np.asarray(-n * np.log(left) - parameters * np.log(n))


def gain_of(gone: Removed, sight: Sight) -> float:
    """BIC that the removed terms are worth."""
    return float(bic_gain(np.array(gone.squares), sight.rss + gone.squares, np.array(gone.cost), sight.data))


def scores(menu: Menu, without: Removed | None = None) -> Scores:
    """Of all entries, in the model as it is or with terms taken out. A gain below zero may be stated too high."""
    count = len(menu.entries)
    squares, rank = np.zeros(count), np.zeros(count, dtype=np.intp)
    rss = menu.sight.rss + (without.squares if without is not None else 0.0)
    for block in menu.blocks:
        gram, along = projected(block, menu.sight, without)
        numbers = menu.numbers[block.entries]
        squares[block.entries], rank[block.entries] = _explained(gram, along, numbers, rss, menu.sight.data)
    gain = bic_gain(squares, rss, rank + menu.numbers, menu.sight.data)
    return Scores(np.where(rank > 0, gain, -np.inf), rank, squares)


def projected(block: EntryBlock, sight: Sight, without: Removed | None) -> tuple[Floats, Floats]:
    """Gram matrices (entry, k, k) and products with the residual (entry, k) in the model without some terms."""
    if without is None:
        return block.gram, block.along
    back = block.absorbed @ (sight.basis.T @ without.span)
    return block.gram + back @ np.swapaxes(back, 1, 2), block.along + back @ without.part


def coefficients(menu: Menu, entry: int, without: Removed | None = None) -> Floats:
    """(k,) of one entry, everything else refitted; zero along what cannot be seen."""
    one = _alone(menu, entry)
    gram, along = projected(one, menu.sight, without)
    w, V = np.linalg.eigh(gram[0])
    inverse = np.where(w > limits.VISIBLE, 1.0 / np.maximum(w, limits.VISIBLE), 0.0)
    size = one.size[0]
    return (V * inverse) @ (V.T @ along[0]) / np.where(size > 0.0, size, 1.0)


def _explained(gram: Floats, along: Floats, numbers: Floats, rss: float, data: int) -> tuple[Floats, Ints]:
    """Squares and rank, by eigenvalues only where even all combinations for the price of one would be worth it."""
    k = along.shape[1]
    own = np.einsum("ekk->ek", gram)
    if k == 1:
        seen = own[:, 0] > limits.VISIBLE
        return np.where(seen, along[:, 0] ** 2 / np.where(seen, own[:, 0], 1.0), 0.0), seen.astype(np.intp)
    solved = np.linalg.solve(gram + RIDGE * np.eye(k), along[..., None])[..., 0]
    squares = np.minimum(np.einsum("ek,ek->e", along, solved), rss)
    rank = np.any(own > limits.VISIBLE, axis=1).astype(np.intp)
    near = np.flatnonzero(bic_gain(squares, rss, rank + numbers, data) > 0.0)
    w, V = np.linalg.eigh(gram[near])
    turned = np.einsum("ekl,ek->el", V, along[near])
    seen = w > limits.VISIBLE
    squares[near] = np.sum(np.where(seen, turned**2 / np.where(seen, w, 1.0), 0.0), axis=1)
    rank[near] = seen.sum(axis=1)
    return squares, rank


def turned_out(block: EntryBlock) -> Floats:
    """(entry, k, k) what makes orthonormal rows of every entry's columns behind geometry; zero where nothing shows."""
    w, V = np.linalg.eigh(block.gram)
    turn = V * np.where(w > limits.VISIBLE, 1.0 / np.sqrt(np.maximum(w, limits.VISIBLE)), 0.0)[:, None, :]
    return np.swapaxes(turn, 1, 2)


def directions(menu: Menu, entry: int) -> Floats:
    """(rank, row) orthonormal rows of one entry behind geometry."""
    one = _alone(menu, entry)
    turn = turned_out(one)[0]
    unit = one.raw[0] * inverse_of(one.size[0])[:, None]
    return turn[np.any(turn != 0.0, axis=1)] @ menu.sight.complement(unit)


def _alone(menu: Menu, entry: int) -> EntryBlock:
    block = next(b for b in menu.blocks if entry in b.entries)
    at = np.flatnonzero(block.entries == entry)
    return EntryBlock(
        block.entries[at], block.size[at], block.raw[at], block.absorbed[at], block.along[at], block.gram[at]
    )
