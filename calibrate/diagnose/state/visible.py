"""What geometry cannot absorb: residual and candidates on the complement of everything already fitted.

Only that part of an effect can be seen; a fit hands the rest to lengths and offsets. Source: orthogonal discrepancy,
Plumlee, Bayesian calibration of inexact computer models, J. Am. Stat. Assoc. 112(519), 2017, section 3.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose import limits
from calibrate.diagnose.state.linearised import State, WhitenedRows
from calibrate.model.effects.term import Term

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
K = TypeVar("K")

RANK = 1e-10  # of the largest singular value of the scaled geometry


@dataclass(frozen=True)
class Sight:
    """Rows with everything already fitted taken out."""

    basis: Floats  # (row, rank) orthonormal, spans what is fitted
    residual: Floats  # (row,) on the complement
    dual: Floats  # (row, param) in the span: orthogonal to every other column
    data: int  # rows that are data

    @property
    def rss(self) -> float:
        return float(self.residual @ self.residual)

    def complement(self, columns: Floats) -> Floats:
        """(..., row) less what geometry absorbs."""
        return columns - (columns @ self.basis) @ self.basis.T


def sight_of(rows: WhitenedRows) -> Sight:
    """One singular value decomposition for a whole round of the search."""
    size = np.linalg.norm(rows.geometry, axis=0)
    U, s, Vt = np.linalg.svd(rows.geometry / np.where(size > 0.0, size, 1.0), full_matrices=False)
    rank = int(np.sum(s > RANK * s[0])) if len(s) else 0
    basis = U[:, :rank]
    residual = rows.residual - basis @ (basis.T @ rows.residual)
    return Sight(basis, residual, (basis / s[:rank]) @ Vt[:rank], int(rows.data.sum()))


def blind(levers: Mapping[K, float]) -> tuple[K, ...]:
    """Joints that next to no reading follows, such as joint 6 where the target lies on its axis.

    Their lever is what errors elsewhere leave there: a size over it is no angle of the joint.
    """
    most = max(levers.values(), default=0.0)
    return tuple(one for one, size in levers.items() if size < limits.BLIND * most)


@dataclass(frozen=True)
class Entry:
    """One candidate at one value of its inner parameters."""

    term: int  # index in the menu
    inner: Floats


@dataclass(frozen=True)
class EntryBlock:
    """Entries with the same number of coefficients; columns count at unit length before geometry is taken out.

    Neither columns of unit length nor those on the complement are kept: products with them follow from the length, and
    from what geometry absorbs.
    """

    entries: Ints  # (entry,) index in the menu
    size: Floats  # (entry, k) length of the whitened columns
    raw: Floats  # (entry, k, row) whitened columns, at their own length
    absorbed: Floats  # (entry, k, rank) coordinates in the basis of what is fitted
    along: Floats  # (entry, k) products with the residual
    gram: Floats  # (entry, k, k) on the complement; the diagonal is the visible share

    def products(self, columns: Floats) -> Floats:
        """(entry, k, m) of the columns at unit length with others (row, m)."""
        found = (self.raw.reshape(-1, self.raw.shape[2]) @ columns).reshape(*self.size.shape, -1)
        return np.asarray(found * inverse_of(self.size)[:, :, None])


def inverse_of(size: Floats) -> Floats:
    """1 where there is nothing."""
    return np.asarray(1.0 / np.where(size > 0.0, size, 1.0))


@dataclass(frozen=True)
class Menu:
    """All that could be added to a state, ready to be scored."""

    terms: tuple[Term, ...]
    entries: tuple[Entry, ...]
    blocks: tuple[EntryBlock, ...]
    sight: Sight

    @cached_property
    def invisible(self) -> tuple[Term, ...]:
        """Terms that these poses do not show for any of their inner values."""
        shown = np.zeros(len(self.terms), dtype=bool)
        for block in self.blocks:
            share = np.max(np.diagonal(block.gram, axis1=1, axis2=2), axis=1)
            for entry in block.entries[share > limits.VISIBLE]:
                shown[self.entries[entry].term] = True
        return tuple(term for term, seen in zip(self.terms, shown, strict=True) if not seen)

    @cached_property
    def numbers(self) -> Floats:
        """(entry,) inner parameters of each: estimated, hence paid for."""
        return np.array([len(entry.inner) for entry in self.entries], dtype=float)

    def place_of(self, term: Term) -> int:
        """Where a term stands in the menu; after all others if it is not in it."""
        return next((i for i, known in enumerate(self.terms) if known.key == term.key), len(self.terms))

    def of_terms(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(entry,) from (term,)."""
        return chosen[[entry.term for entry in self.entries]] if self.entries else np.zeros(0, dtype=bool)


def menu_of(state: State, terms: Sequence[Term], sight: Sight) -> Menu:
    """Every term at every value of its grids."""
    entries: list[Entry] = []
    columns: dict[int, list[Floats]] = {}  # by their number
    widths: list[int] = []
    for index, term in enumerate(terms):
        if grid := grid_of(term):
            found = state.columns_at(term, grid)
            columns.setdefault(found.shape[1], []).append(found)
            widths += [found.shape[1]] * len(grid)
            entries += [Entry(index, inner) for inner in grid]
    blocks = tuple(_block(np.flatnonzero(np.equal(widths, k)), columns.pop(k), sight) for k in sorted(columns) if k > 0)
    return Menu(tuple(terms), tuple(entries), blocks, sight)


def beyond(menu: Menu, span: Floats) -> Menu:
    """The menu with orthonormal columns (row, k) of the complement taken out of sight, too."""
    sight = menu.sight
    basis = np.concatenate([sight.basis, span], axis=1)
    residual = sight.residual - span @ (span.T @ sight.residual)
    return Menu(
        menu.terms,
        menu.entries,
        tuple(_deflated(block, span, span.T @ sight.residual) for block in menu.blocks),
        Sight(basis, residual, sight.dual, sight.data),
    )


def grid_of(term: Term) -> list[Floats]:
    """All combinations of the coarse values of a term's inner parameters, an end after its begin."""
    meshed = np.meshgrid(*(np.array(inner.grid) for inner in term.inner), indexing="ij")
    if not meshed:
        return [np.zeros(0)]
    values = np.stack([m.ravel() for m in meshed], axis=1)
    for j, spec in enumerate(term.inner):
        values = values[values[:, j] > values[:, j - 1]] if spec.later else values
    return list(values)


def _block(chosen: Ints, columns: list[Floats], sight: Sight) -> EntryBlock:
    """Takes its columns out of the list: all candidates at once are most of what a diagnosis holds."""
    raw, at = np.empty((len(chosen), columns[0].shape[1], len(sight.residual))), 0
    while columns:
        part = columns.pop(0)
        raw[at : at + len(part)] = part
        at += len(part)
    gram = raw @ np.swapaxes(raw, 1, 2)
    size = np.sqrt(np.diagonal(gram, axis1=1, axis2=2))
    unit = inverse_of(size)
    whole = EntryBlock(chosen, size, raw, raw[:, :, :0], raw[:, :, 0], gram * unit[:, :, None] * unit[:, None, :])
    products = whole.products(np.column_stack([sight.basis, sight.residual]))
    absorbed, along = products[:, :, :-1], products[:, :, -1]
    return replace(whole, absorbed=absorbed, along=along, gram=whole.gram - absorbed @ np.swapaxes(absorbed, 1, 2))


def _deflated(block: EntryBlock, span: Floats, part: Floats) -> EntryBlock:
    """`part` (k,) of the residual along the span."""
    more = block.products(span)
    gram = block.gram - more @ np.swapaxes(more, 1, 2)
    absorbed = np.concatenate([block.absorbed, more], axis=2)
    return EntryBlock(block.entries, block.size, block.raw, absorbed, block.along - more @ part, gram)
