"""What a session on site is asked for, and the part of it that is measured next."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from acquisition.errors import AcquisitionError
from acquisition.plan import Block, PlanOptions, PoseKey, blocks
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Placement, Rig
from calibeam.session.earlier import PLAN_NOTE, SEED_NOTE, Earlier
from calibeam.session.places import moved_plan, with_places
from calibeam.site import Addresses

MORE = 100  # index from which poses that a person asked for in addition are counted, round by round


@dataclass(frozen=True)
class Job:
    """From the command line."""

    rig: Rig
    text: str  # of the rig file
    out: Path
    addresses: Addresses
    options: PlanOptions
    plan: PosePlan | None = None
    plan_text: str = ""
    goal_m: float = 20e-6
    place: Callable[[int], None] | None = None  # moves an emulated fixture; None: a person does


@dataclass(frozen=True, eq=False)
class Part:
    """One recording of a session: its rig, with added places, what it shall take, what was taken before."""

    rig: Rig
    text: str
    earlier: Earlier
    blocks: tuple[Block, ...]  # of a session that aims
    plan: PosePlan | None  # else
    options: PlanOptions

    @property
    def seed(self) -> int:
        """Of the poses of the whole session."""
        return self.options.seed

    @property
    def left(self) -> int:
        """Poses still to be taken."""
        if self.plan is not None:
            return self.plan.poses - len({key.index for key in self.earlier.taken})
        return sum(key not in self.earlier.taken for key in self.keys)

    @property
    def keys(self) -> tuple[PoseKey, ...]:
        return tuple(key for block in self.blocks for key in block.pose_keys())

    def open_at(self, placement: int) -> bool:
        """Whether something is left to be taken there."""
        if self.plan is not None:
            numbers = {key.index for key in self.earlier.taken}
            places = [block.placement for block in self.plan.block for _ in block.pose]
            return any(place == placement and k not in numbers for k, place in enumerate(places))
        return any(key.placement == placement and key not in self.earlier.taken for key in self.keys)


def part_of(job: Job, earlier: Earlier, half_size_m: float) -> Part:
    """AcquisitionError where what is asked for contradicts how the session was begun."""
    _check_same_plan(job, earlier)
    rig, text = with_places(job.rig, job.text, earlier.added)
    if job.plan is not None:
        return Part(rig, text, earlier, (), moved_plan(job.plan, earlier.stands_in), job.options)
    options = replace(job.options, seed=int(earlier.notes.get(SEED_NOTE, job.options.seed)))
    # Added places come last, so that the poses of those before stay the same.
    every = blocks(tuple(rig.placements), half_size_m, options)
    own = [block for block in every if block.placement not in earlier.stands_in]
    own.sort(key=lambda block: block.placement not in earlier.stands_in.values())  # there the fixture is at hand
    return Part(rig, text, earlier, tuple(own), None, options)


def more_at(part: Part, placement: int, half_size_m: float, options: PlanOptions, number: int) -> tuple[Block, ...]:
    """A further round at one place, with poses of its own: the seed is another, and so are their indices.

    `number`: from 1 in this part; the rounds of earlier parts at this place come before.
    """
    number += max((key.index // MORE for key in part.earlier.taken if key.placement == placement), default=0)
    seed = options.seed + number
    again = replace(options, seed=seed, repeats=0)
    return tuple(
        replace(block, visits=tuple(replace(visit, index=MORE * number + visit.index) for visit in block.visits))
        for block in blocks((placement,), half_size_m, again)
    )


def with_place(earlier: Earlier, place: Placement) -> Earlier:
    """One more place, to be measured."""
    return replace(earlier, added=(*earlier.added, place))


def moved(earlier: Earlier, place: Placement, instead_of: int) -> Earlier:
    """The fixture does not stand any more where it stood: what is left is measured at a new place."""
    return replace(with_place(earlier, place), stands_in={**earlier.stands_in, instead_of: place.id}, standing=None)


def notes_of(job: Job, seed: int) -> dict[str, str]:
    """How a session is begun, for who goes on with it."""
    notes = {SEED_NOTE: str(seed)}
    return notes if job.plan is None else {**notes, PLAN_NOTE: _sha256(job.plan_text)}


def _check_same_plan(job: Job, earlier: Earlier) -> None:
    if not earlier.begun:
        return
    told, begun = (_sha256(job.plan_text) if job.plan is not None else None), earlier.notes.get(PLAN_NOTE)
    if told != begun:
        raise AcquisitionError(
            f"{job.out}: the session was begun {'without a plan' if begun is None else 'with another --plan'}; "
            f"go on with it {'without --plan' if begun is None else 'with the same'}"
        )


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
