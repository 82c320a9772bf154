"""Places that a session adds to those of its rig file: where the fixture was moved, or stands in addition."""

import math
from collections.abc import Mapping, Sequence

import msgspec

from acquisition.recording import RigFileError
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Placement, Pose, Rig, parse_rig

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
        return parse_rig(longer, f"{rig.name} with the places of the session"), longer
    except RigFileError as error:
        raise RigFileError(
            f"rig {rig.name}: a place cannot be added to the file ({error}); write its places as [[placement]]"
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
