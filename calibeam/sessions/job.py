"""What a session on site is asked for, what earlier parts in the same folder have taken, and what is measured next.

The fixture may have been moved, or stand at stations beyond those of the rig file: these are added to the plan.
"""

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import msgspec

from acquisition.errors import AcquisitionError
from acquisition.recording import Recording, RecordingError, RigFileError, read
from acquisition.recording.files import shown
from acquisition.recording.mcap import differs, parts
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Placement, Pose, Rig, parse_rig
from acquisition.session.plan import Block, PlanOptions, PoseKey, blocks
from acquisition.session.records import Sample, sample_of
from calibeam.devices.site import Addresses

PLACE_EVENT, STANDS_IN = "placement", "place added"
SEED_NOTE, PLAN_NOTE = "plan_seed", "plan_sha256"
GO_ON = "to go on, give the same command with --continue"


@dataclass(frozen=True)
class EarlierParts:
    """Nothing at all: a session that begins."""

    taken: Mapping[PoseKey, Sample] = field(default_factory=dict[PoseKey, Sample])
    added: tuple[Placement, ...] = ()  # places that the rig file does not know
    stands_in: Mapping[int, int] = field(default_factory=dict[int, int])  # place -> the one that is measured instead
    standing: int | None = None  # place where the fixture was last
    notes: Mapping[str, str] = field(default_factory=dict[str, str])

    @property
    def begun(self) -> bool:
        return bool(self.notes)


def read_earlier_parts(folder: Path, rig: Rig) -> EarlierParts:
    """Of all parts. RecordingError where there are none, or they are of another rig."""
    each = begun_in(folder)
    try:
        return _of_parts(each, folder, rig)
    except (KeyError, TypeError, ValueError) as error:  # events and samples of another program, or damaged
        raise RecordingError(
            f"{folder}: its recordings do not contain which poses are done ({shown(str(error))}); "
            "begin a new session with another --out"
        ) from error


def begun_in(folder: Path) -> list[Recording]:
    """Every recording of the session. RecordingError where there is none."""
    files = parts(folder)
    if not files:
        raise RecordingError(f"{folder}: no session to go on with; leave --continue out, or give the folder of one")
    return [read(path) for path in files]


def _of_parts(each: Sequence[Recording], folder: Path, rig: Rig) -> EarlierParts:
    """KeyError, TypeError, ValueError where events or samples are not as a session writes them."""
    last = each[-1]
    listed = {place.id: place for place in rig.placement_list}
    added = tuple(place for place in last.rig.placement_list if place.id not in listed)
    if said := differs(last.rig, msgspec.structs.replace(rig, placement_list=(*rig.placement_list, *added))):
        raise RecordingError(f"{folder}: its session was of another rig: {said}; begin a new one with another --out")
    events = [event for one in each for event in one.events]
    placed = [int(event.detail["id"]) for event in events if event.kind == PLACE_EVENT]
    stands_in = {
        int(event.detail["instead_of"]): int(event.detail["id"])
        for event in events
        if event.kind == STANDS_IN and event.detail.get("instead_of") is not None
    }
    taken = {key: sample for one in each for key, sample in _taken(one).items()}
    return EarlierParts(taken, added, stands_in, placed[-1] if placed else None, each[0].notes)


def _taken(one: Recording) -> dict[PoseKey, Sample]:
    """A sample whose event was not written any more, because the process was killed, is taken once more."""
    recorded = [event.detail.get("pose") for event in one.events if event.kind == "sample"]
    rows = [sample_of(row, one.samples.n_joints) for row in one.samples.rows()]
    if len(one.samples) and not any(recorded):
        raise RecordingError(
            f"{one.path}: recorded by an earlier version, which did not record the pose of each sample; begin a new "
            "session"
        )
    return {PoseKey(**pose): row for pose, row in zip(recorded, rows, strict=False) if pose is not None}


TEXT = """
# added by the session
[[placement]]
id = {id}
psd1_in_base = {{ origin_m = {origin}, rotation_rad = {rotation} }}
"""


def with_places(rig: Rig, text: str, added: Sequence[Placement]) -> tuple[Rig, str]:
    """The rig, and its text, with these places behind its own. RigFileError where the text takes no more."""
    if not added:
        return rig, text
    longer = text.rstrip("\n") + "\n" + "".join(map(placement_text, added))
    try:
        return parse_rig(longer, f"{rig.name} with the stations of the session"), longer
    except RigFileError as error:
        raise RigFileError(
            f"rig {rig.name}: a station cannot be added to the file ({error}); write its stations as [[placement]]"
        ) from error


def placement_text(place: Placement) -> str:
    """As it stands in a rig file."""
    pose = place.psd1_in_base
    return TEXT.format(id=place.id, origin=list(pose.origin_m), rotation=list(pose.rotation_rad))


def new_place(rig: Rig, numbers: Sequence[float]) -> Placement:
    """From x, y, z (m) of PSD 1 in the base and its turn about z (deg): a fixture stands upright."""
    x, y, z, yaw_deg = numbers
    return Placement(_free(rig), Pose(origin_m=(x, y, z), rotation_rad=(0.0, 0.0, math.radians(yaw_deg))))


def same_place(rig: Rig, placement: int) -> Placement:
    """A new place about where this one was: the fixture was moved since."""
    return Placement(_free(rig), rig.placements[placement].psd1_in_base)


def moved_plan(plan: PosePlan, stands_in: Mapping[int, int]) -> PosePlan:
    """The plan with its poses at the places that are measured instead."""
    blocks = tuple(
        msgspec.structs.replace(block, placement=resolved(block.placement, stands_in)) for block in plan.block
    )
    return msgspec.structs.replace(plan, block=blocks)


def resolved(placement: int | None, stands_in: Mapping[int, int]) -> int | None:
    """A place, or the one that is measured instead of it, or of that."""
    while placement is not None and placement in stands_in:
        placement = stands_in[placement]
    return placement


def _free(rig: Rig) -> int:
    return 1 + max(rig.placements)


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
    earlier: EarlierParts
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


def part_of(job: Job, earlier: EarlierParts, half_size_m: float) -> Part:
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


def with_place(earlier: EarlierParts, place: Placement) -> EarlierParts:
    """One more place, to be measured."""
    return replace(earlier, added=(*earlier.added, place))


def with_fixture_moved(earlier: EarlierParts, place: Placement, instead_of: int) -> EarlierParts:
    """The fixture does not stand any more where it stood: what is left is measured at a new place."""
    return replace(with_place(earlier, place), stands_in={**earlier.stands_in, instead_of: place.id}, standing=None)


def notes_of(job: Job, seed: int) -> dict[str, str]:
    """How a session is begun, for who goes on with it."""
    notes = {SEED_NOTE: str(seed)}
    return notes if job.plan is None else {**notes, PLAN_NOTE: plan_sha256(job.plan_text)}


def _check_same_plan(job: Job, earlier: EarlierParts) -> None:
    if not earlier.begun:
        return
    plan_hash, begun = (plan_sha256(job.plan_text) if job.plan is not None else None), earlier.notes.get(PLAN_NOTE)
    if plan_hash != begun:
        raise AcquisitionError(
            f"{job.out}: the session was begun {'without a plan' if begun is None else 'with another --plan'}; "
            f"go on with it {'without --plan' if begun is None else 'with the same'}"
        )


def plan_sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
