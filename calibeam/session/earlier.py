"""What earlier parts of a session in the same folder have taken, and under which places: read from their recordings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from acquisition.plan import PoseKey
from acquisition.recording import Recording, RecordingError, read
from acquisition.recording.files import shown
from acquisition.recording.mcap import differs, parts
from acquisition.recording.rig import Placement, Rig
from acquisition.sample import Sample, sample_of

PLACE_EVENT, STANDS_IN = "placement", "place added"
SEED_NOTE, PLAN_NOTE = "plan_seed", "plan_sha256"


@dataclass(frozen=True)
class Earlier:
    """Nothing at all: a session that begins."""

    taken: Mapping[PoseKey, Sample] = field(default_factory=dict[PoseKey, Sample])
    added: tuple[Placement, ...] = ()  # places that the rig file does not know
    stands_in: Mapping[int, int] = field(default_factory=dict[int, int])  # place -> the one that is measured instead
    standing: int | None = None  # place where the fixture was last
    notes: Mapping[str, str] = field(default_factory=dict[str, str])

    @property
    def begun(self) -> bool:
        return bool(self.notes)


def earlier_of(folder: Path, rig: Rig) -> Earlier:
    """Of all parts. RecordingError where there are none, or they are of another rig."""
    files = parts(folder)
    if not files:
        raise RecordingError(f"{folder}: no session to go on with; leave --continue out, or give the folder of one")
    each = [read(path) for path in files]
    try:
        return _of_parts(each, folder, rig)
    except (KeyError, TypeError, ValueError) as error:  # events and samples of another program, or damaged
        raise RecordingError(
            f"{folder}: its recordings do not contain which poses are done ({shown(str(error))}); "
            "begin a new session with another --out"
        ) from error


def _of_parts(each: Sequence[Recording], folder: Path, rig: Rig) -> Earlier:
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
    return Earlier(taken, added, stands_in, placed[-1] if placed else None, each[0].notes)


def _taken(one: Recording) -> dict[PoseKey, Sample]:
    """A sample whose event was not written any more, because the process was killed, is taken once more."""
    told = [event.detail.get("pose") for event in one.events if event.kind == "sample"]
    rows = [sample_of(row, one.samples.n_joints) for row in one.samples.rows()]
    if len(one.samples) and not any(told):
        raise RecordingError(
            f"{one.path}: recorded by an earlier version, which did not say which pose a sample is; begin a new session"
        )
    return {PoseKey(**pose): row for pose, row in zip(told, rows, strict=False) if pose is not None}
