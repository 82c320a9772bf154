"""A plan of explicit joint poses, `next.toml`: written by a diagnosis, run by a session (docs/formats.md)."""

import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct

from acquisition.recording.errors import RigFileError, shown
from acquisition.recording.files.bounds import Identity, Kilograms, Many, Metres, Name, PerJoint, Radians, Sentence
from acquisition.recording.files.explain import KeyPath
from acquisition.recording.files.toml_file import parse_toml, read_text
from acquisition.recording.output import toml_output, write_output
from acquisition.recording.rig import Rig

Way = Annotated[int, Meta(ge=-1, le=1)]
POSE_PLAN = toml_output(("schema", "rig", "purpose"), "pose plan")
Spots = tuple[Metres, Metres, Metres, Metres]


class PlannedPose(Struct, frozen=True, forbid_unknown_fields=True):
    """One pose; where a fixture stands, also where the light is expected on it."""

    q_rad: PerJoint[Radians]  # readings, one a joint
    approach: PerJoint[Way] = ()  # the way each joint comes; 0 or absent: as it falls
    spots_m: Spots | None = None  # psd1 x, y, psd2 x, y
    repeat: Identity | None = None  # poses of one number are one pose, taken again


class PlannedBlock(Struct, frozen=True, forbid_unknown_fields=True):
    """Poses that follow one another at one place."""

    pose: Many[PlannedPose]
    placement: Identity | None = None
    first_psd: Literal[1, 2] | None = None
    seat: Identity | None = None
    payload_kg: Kilograms | None = None


class PosePlan(Struct, frozen=True, forbid_unknown_fields=True):
    """A whole plan."""

    schema: Literal[1]
    rig: Name  # its name
    block: Many[PlannedBlock]
    purpose: Many[Sentence] = ()  # one line for a person each

    @property
    def poses(self) -> int:
        return sum(len(block.pose) for block in self.block)


def read_pose_plan(path: Path, rig: Rig) -> PosePlan:
    """The plan of a file, checked against the rig. RigFileError naming file, line, key, value and remedy."""
    file = parse_toml(read_text(path, "pose plan", RigFileError), str(path), RigFileError)
    plan = file.checked(PosePlan)
    for place, says in _contradictions(plan, rig):
        raise file.error(place, says)
    return plan


def write_pose_plan(path: Path, plan: PosePlan) -> None:
    """Write the file. OutputError, OSError as `write_output`."""
    write_output(path, "\n".join(_lines(plan)) + "\n", POSE_PLAN)


def _contradictions(plan: PosePlan, rig: Rig) -> Iterator[tuple[KeyPath, str]]:
    if plan.rig != rig.name:
        yield (
            ("rig",),
            f"rig = '{shown(plan.rig, 60)}', but this rig is '{shown(rig.name, 60)}'; give the plan of this rig",
        )
    for b, block in enumerate(plan.block):
        if block.placement is not None and block.placement not in rig.placements:
            known = ", ".join(map(str, rig.placements)) or "none"
            yield ("block", b, "placement"), f"placement {block.placement} is not in the rig (known: {known})"
        for p, pose in enumerate(block.pose):
            yield from (((("block", b, "pose", p)), says) for says in _of_pose(pose, rig))


def _of_pose(pose: PlannedPose, rig: Rig) -> Iterator[str]:
    joints = rig.arm.joints
    if len(pose.q_rad) != len(joints):
        yield f"q_rad has {len(pose.q_rad)} angles, the arm {len(joints)} joints; give one a joint"
        return
    if pose.approach and len(pose.approach) != len(joints):
        yield f"approach has {len(pose.approach)} entries, the arm {len(joints)} joints; give one a joint, or none"
    for i, (q, joint) in enumerate(zip(pose.q_rad, joints, strict=True), start=1):
        if not math.isfinite(q) or not joint.lower_rad <= q <= joint.upper_rad:
            yield (
                f"joint {i} at {q:g} rad is outside its range {joint.lower_rad:g} ... {joint.upper_rad:g}; "
                "leave the pose out"
            )


def _lines(plan: PosePlan) -> Iterator[str]:
    yield f"schema = {plan.schema}"
    yield f"rig = {_text(plan.rig)}"
    yield "purpose = ["
    yield from (f"  {_text(line)}," for line in plan.purpose)
    yield "]"
    for block in plan.block:
        yield "\n[[block]]"
        for name in ("placement", "first_psd", "seat", "payload_kg"):
            value = getattr(block, name)
            if value is not None:
                yield f"{name} = {value!r}"
        for pose in block.pose:
            yield "[[block.pose]]"
            yield f"q_rad = {_row(pose.q_rad)}"
            if pose.approach:
                yield f"approach = {_row(pose.approach)}"
            if pose.spots_m is not None:
                yield f"spots_m = {_row(pose.spots_m)}"
            if pose.repeat is not None:
                yield f"repeat = {pose.repeat}"


def _row(values: Iterable[float]) -> str:
    return f"[{', '.join(map(repr, values))}]"


def _text(value: str) -> str:
    """A basic string of TOML: JSON's is one, but for what lies beyond the first plane, which stands as it is."""
    return msgspec.json.encode(value).decode()
