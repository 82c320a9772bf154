"""What a session shall measure: fixture places, both orders, centred and off-centre spots, repeats and approaches."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from acquisition.centring.aim import BeamTarget
from acquisition.centring.strategies import REGISTERED, CentringChoice

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PoseKey:
    """Which pose of which plan a sample is: noted in the journal, so that a session can be gone on with."""

    placement: int
    first: int
    index: int  # of the visits of a place and order, or of a plan of poses
    again: int = 0  # 1: taken again, 2: and from the other side


@dataclass(frozen=True)
class Visit:
    """One pose to take. `centred` asks for the servo down to its tolerance; else lit faces are enough."""

    placement: int
    target: BeamTarget
    centred: bool
    repeat: int | None = None  # group of poses that are taken again later
    index: int = 0  # among those of its place and order

    def key(self, again: int = 0) -> PoseKey:
        return PoseKey(self.placement, self.target.first, self.index, again)


@dataclass(frozen=True)
class PlanOptions:
    """How much to measure. The four poses of the source are the first two centred ones of each order at one place.

    Off-centre spots bring the scale of the arm, several places the range of its joints (mismatch study, section 3).
    """

    centred: int = 3  # per place and order
    off_centre: int = 8  # per place and order
    repeats: int = 2  # poses per block taken again at its end, then once more from the other side
    face_share: float = 0.85  # of the half face that off-centre spots may use
    stand_off_m: tuple[float, float] = (0.10, 0.32)
    roll_rad: tuple[float, float] = (-2.6, 2.6)
    opposite_rad: float = 0.035  # how far the other side is
    dwell_s: float = 0.2
    seed: int = 1
    centring: CentringChoice = REGISTERED


@dataclass(frozen=True)
class Block:
    """The visits of one place and order, in the order to take them."""

    placement: int
    first: int
    visits: tuple[Visit, ...] = field(default_factory=tuple)

    def pose_keys(self) -> list[PoseKey]:
        """Everything that is to be taken, repeats last."""
        again = [visit.key(k) for visit in self.visits if visit.repeat is not None for k in (1, 2)]
        return [*(visit.key() for visit in self.visits), *again]


def blocks(placements: tuple[int, ...], half_size_m: float, options: PlanOptions) -> Iterator[Block]:
    """One block a place and order. Roll grows by small steps from where the light was found, so that the arm, whose
    zeros are not known yet, never jumps further than its error lets the spots survive.
    """
    rng = np.random.default_rng(options.seed)
    for placement in placements:
        for first in (1, 2):
            yield Block(placement, first, tuple(_visits(placement, first, half_size_m, options, rng)))


def _visits(
    placement: int, first: int, half_size_m: float, options: PlanOptions, rng: np.random.Generator
) -> Iterator[Visit]:
    total = options.centred + options.off_centre
    rolls = _out_and_back(np.linspace(*options.roll_rad, total))
    stand_offs = rng.uniform(*options.stand_off_m, total)
    centred_at = set(np.linspace(0, total - 1, options.centred).round().astype(int).tolist())
    edge_m = options.face_share * half_size_m
    off_centre = [k for k in range(total) if k not in centred_at]
    again = dict(zip(off_centre, range(options.repeats), strict=False))
    for k in range(total):
        centred = k in centred_at
        spots = np.zeros(4) if centred else rng.uniform(-edge_m, edge_m, 4)
        x1, y1, x2, y2 = (float(v) for v in spots)
        target = BeamTarget(first, (x1, y1, x2, y2), float(stand_offs[k]), float(rolls[k]))
        group = again.get(k)
        repeat = None if group is None else 1 + group + options.repeats * (2 * placement + first - 3)
        yield Visit(placement, target, centred, repeat, k)


def _out_and_back(rolls_rad: Floats) -> Floats:
    """From the middle outwards to one side, back over the middle to the other: short steps only."""
    middle = len(rolls_rad) // 2
    up, down = rolls_rad[middle:], rolls_rad[:middle][::-1]
    return np.concatenate([up, down])
