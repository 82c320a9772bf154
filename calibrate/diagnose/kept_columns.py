"""Columns of candidates without weights, kept while values stay near those at which they were computed.

A search asks for the same thousand columns at every state, and states differ by micrometres: what changes from one to
the next is mostly the weights, which come afterwards.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from calibrate.effects.ports import Perturbation

Floats = NDArray[np.float64]
Key = tuple[object, ...]
Columns = list[Floats]  # of each instrument (row, k, coefficient)

NEAR = 1e-4  # m, rad: within it derivatives differ by no more than that part of a metre's lever


@dataclass(frozen=True, eq=False)
class Setting:
    """Where the frames of a session stand: the values of geometry, and what terms add."""

    geometry: Floats  # (param,)
    by: Perturbation

    def near(self, other: "Setting") -> bool:
        """Whether frames there are nearly those here. What acts on a reading moves no frame."""
        parts = zip(_moving(self.by), _moving(other.by), strict=True)
        off = [np.abs(other.geometry - self.geometry), *(np.abs(old - new) for old, new in parts)]
        return max(float(part.max(initial=0.0)) for part in off) < NEAR


@dataclass(eq=False)
class KeptColumns:
    """Of the candidates of one session at one setting; another one begins anew. Shared by all states of a search."""

    _at: Setting | None = None
    _near: Setting | None = None  # asked for last, and found near
    _columns: dict[Key, Columns] = field(default_factory=dict[Key, Columns])

    def of(self, key: Key, at: Setting, compute: Callable[[], Columns]) -> Columns:
        """Those of one candidate, computed where they are not known at or near this setting."""
        if at is not self._near:
            if self._at is None or not self._at.near(at):
                self._at = at
                self._columns.clear()
            self._near = at
        if key not in self._columns:
            self._columns[key] = compute()
        return self._columns[key]


def _moving(by: Perturbation) -> tuple[Floats, ...]:
    return by.joints_rad, by.frames, by.surroundings
