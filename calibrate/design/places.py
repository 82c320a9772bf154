"""How many places of the fixture, and which; and whether distances between them are needed for the scale.

Places are chosen one after the other: each time the one with which as many poses as asked for, shared out evenly over
places and their candidates, leave the smallest error over the workspace. Two sums each: without any known distance, and
with those between all chosen places.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Placement
from calibrate.design.candidates import Candidates
from calibrate.design.information import Information
from calibrate.model.parameters import index_of, priors
from calibrate.model.rigid import transform

Floats = NDArray[np.float64]

NEEDED = 0.9  # of the error without: distances that leave more bring next to nothing


@dataclass(frozen=True)
class Places:
    """So many places, and what as many poses as asked for promise there."""

    ids: tuple[int, ...]
    free_space_m: float
    scale_sigma: float
    with_distances_m: float
    with_distances_scale: float

    @property
    def distances_needed(self) -> bool:
        """Whether known distances would make the error clearly smaller."""
        return self.with_distances_m < NEEDED * self.free_space_m


def choose_places(
    found: Information,
    candidates: Candidates,
    placements: Sequence[Placement],
    poses: int,
    distance_sigma_m: float,
    most: int,
) -> tuple[Places, ...]:
    """One to `most` places, the best of those that any candidate reaches."""
    own = {int(k): _mean(found, candidates.placement == k) for k in np.unique(candidates.placement)}
    chosen: list[int] = []
    out: list[Places] = []
    while len(chosen) < min(most, len(own)):
        rest = [k for k in own if k not in chosen]
        errors = [found.free_space_m(_information(found, own, [*chosen, k], poses)) for k in rest]
        chosen.append(rest[int(np.argmin(errors))])
        out.append(_found_places(found, own, chosen, placements, poses, distance_sigma_m))
    return tuple(out)


def _mean(found: Information, mine: NDArray[np.bool_]) -> Floats:
    """(param, param) information of one pose of a place, on average."""
    X = found.rows[mine].reshape(-1, found.n)
    return X.T @ X / int(mine.sum())


def _information(found: Information, own: dict[int, Floats], chosen: Sequence[int], poses: int) -> Floats:
    return np.eye(found.n) + poses / len(chosen) * np.sum([own[k] for k in chosen], axis=0)


def _found_places(
    found: Information,
    own: dict[int, Floats],
    chosen: Sequence[int],
    placements: Sequence[Placement],
    poses: int,
    distance_sigma_m: float,
) -> Places:
    without = _information(found, own, chosen, poses)
    rows = _distances(found, placements, chosen) / distance_sigma_m
    known = without + rows.T @ rows
    return Places(
        tuple(chosen),
        found.free_space_m(without),
        found.scale_sigma(without),
        found.free_space_m(known),
        found.scale_sigma(known),
    )


def _distances(found: Information, placements: Sequence[Placement], chosen: Sequence[int]) -> Floats:
    """(pair, param) derivative of the distance of every two chosen places by the scaled unknowns."""
    column, size = index_of(found.parameters), priors(found.parameters)
    T = {p.id: transform(p.psd1_in_base.origin_m, p.psd1_in_base.rotation_rad) for p in placements}
    rows: list[Floats] = []
    for a, b in combinations(chosen, 2):
        span = T[b][:3, 3] - T[a][:3, 3]
        along, row = span / np.linalg.norm(span), np.zeros(found.n)
        for sign, place in ((-1.0, a), (1.0, b)):
            columns = [column[f"placement{place}.{axis}"] for axis in ("x", "y", "z")]
            row[columns] = sign * along @ T[place][:3, :3] * size[columns]
        rows.append(row)
    return np.array(rows).reshape(-1, found.n)
