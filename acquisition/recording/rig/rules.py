"""What must hold between the keys of a rig file, beyond the type of each one.

Every rule yields faults as (key path, what is wrong and what to do); the reader adds file and line.
"""

import math
from collections.abc import Iterator

from acquisition.recording.files.bounds import ARM_M
from acquisition.recording.files.explain import in_metres, section
from acquisition.recording.rig.schema import ArmModel, Joint, Pose, Rig
from acquisition.recording.rig_artefacts import artefact_faults
from acquisition.recording.rig_instruments import instrument_faults
from acquisition.recording.rig_lines import KeyPath
from acquisition.recording.rig_robot import robot_faults

Fault = tuple[KeyPath, str]

# Frames of what an arm or a fixture carries; those of what stands in the room may be farther away.
_CARRIED: tuple[KeyPath, ...] = (
    ("arm", "flange"),
    ("fixture", "psd2_in_psd1"),
    ("camera", "in_flange"),
    ("camera", "board", "in_psd1"),
)

_DH_KEYS = ("a_m", "alpha_rad", "d_m", "theta_offset_rad")
_POE_KEYS = ("origin_m", "rotation_rad")


def faults(rig: Rig) -> Iterator[Fault]:
    """All that contradicts itself in a rig whose types are right, in the order of the file's sections."""
    for index, joint in enumerate(rig.arm.joints):
        yield from _joint_faults(("arm", "joint", index), joint, rig.arm.model)
    yield from _carried_faults(rig)
    yield from _laser_faults(rig)
    yield from _placement_faults(rig)
    yield from artefact_faults(rig)
    yield from _tolerance_faults(rig)
    yield from instrument_faults(rig)
    yield from robot_faults(rig)
    yield from _motion_faults(rig)


def _joint_faults(path: KeyPath, joint: Joint, model: ArmModel) -> Iterator[Fault]:
    own, other = (_POE_KEYS, _DH_KEYS) if model is ArmModel.LOCAL_POE else (_DH_KEYS, _POE_KEYS)
    for key in other:
        if getattr(joint, key) is not None:
            yield (
                (*path, key),
                f"'{key}' does not belong to an arm of model \"{model.value}\"; it takes {', '.join(own)}",
            )
    for key in own:
        if getattr(joint, key) is None and key != "theta_offset_rad":
            yield path, f"[[arm.joint]] needs the key '{key}' in an arm of model \"{model.value}\""
    if joint.lower_rad >= joint.upper_rad:
        yield (
            (*path, "lower_rad"),
            f"lower_rad = {joint.lower_rad!r} is not below upper_rad = {joint.upper_rad!r}; exchange or correct them",
        )


def _carried_faults(rig: Rig) -> Iterator[Fault]:
    """Origins too far away to be carried."""
    for path in _CARRIED:
        frame: object = rig
        for key in path:
            frame = getattr(frame, str(key), None)
        for index, value in enumerate(frame.origin_m if isinstance(frame, Pose) else ()):
            if abs(value) > ARM_M:
                says = f"origin_m = {value!r} in {section(path)}: expected at most {ARM_M:g} m"
                yield (*path, "origin_m", index), f"{says}{in_metres(value, ARM_M)}"


def _motion_faults(rig: Rig) -> Iterator[Fault]:
    for key in ("keep_out", "slow_area"):
        for index, box in enumerate(getattr(rig.motion, key)):
            if any(lower >= upper for lower, upper in zip(box.lower_m, box.upper_m, strict=True)):
                yield (
                    ("motion", key, index, "lower_m"),
                    f"box '{box.name}': lower_m is not below upper_m in all three; exchange or correct them",
                )
    home_rad = rig.motion.home_rad
    if home_rad is None:
        return
    if len(home_rad) != rig.n_joints:
        yield (
            ("motion", "home_rad"),
            f"home_rad has {len(home_rad)} joint readings, but the arm has {rig.n_joints} joints; give one for each",
        )
        return
    for index, (value, joint) in enumerate(zip(home_rad, rig.arm.joints, strict=True), start=1):
        if not joint.lower_rad <= value <= joint.upper_rad:
            yield (
                ("motion", "home_rad"),
                f"home_rad of joint {index} is {value!r}, outside its range {joint.lower_rad!r} to {joint.upper_rad!r}",
            )


def _laser_faults(rig: Rig) -> Iterator[Fault]:
    origin, direction = rig.tool.laser_origin_m, rig.tool.laser_direction
    if (origin is None) != (direction is None):
        missing = "laser_origin_m" if origin is None else "laser_direction"
        yield ("tool",), f"[tool] has half a laser: add '{missing}'"
    if direction is not None and math.hypot(*direction) < 1e-6:  # feels right: no hand writes a unit vector so short
        yield (
            ("tool", "laser_direction"),
            f"laser_direction = {list(direction)} points nowhere; give the beam's direction",
        )


def _placement_faults(rig: Rig) -> Iterator[Fault]:
    if rig.camera is not None and rig.fixture is None:
        yield (
            ("camera", "board"),
            "[camera.board] says where the board is on the fixture, but there is no [fixture]; add it",
        )
    yield from _twice(("placement",), tuple(placement.id for placement in rig.placement_list))
    if rig.placement_list and rig.fixture is None:
        yield ("placement",), "[[placement]] says where the fixture stood, but there is no [fixture]; add it"
    known = sorted(rig.placements)
    for index, distance in enumerate(rig.known_distances):
        path = ("known_distance", index)
        for key, number in (("from", distance.from_placement), ("to", distance.to_placement)):
            if number not in rig.placements:
                yield (*path, key), f"{key} = {number} is no placement of this rig (it has {known}); correct it"
        if distance.from_placement == distance.to_placement:
            yield (*path, "to"), f"from and to are the same placement {distance.to_placement}; a distance needs two"


def _twice(section: KeyPath, ids: tuple[int, ...]) -> Iterator[Fault]:
    for index, number in enumerate(ids):
        if number in ids[:index]:
            yield (*section, index, "id"), f"id = {number} is used twice in [[{section[0]}]]; give every one its own"


def _tolerance_faults(rig: Rig) -> Iterator[Fault]:
    if (tolerance := rig.tolerance) is None:
        return
    for what, owner in (("psd2", "fixture"), ("device", "device")):
        sizes = {key: getattr(tolerance, key) for key in (f"{what}_m", f"{what}_rad")}
        missing = [key for key, value in sizes.items() if value is None]
        if len(missing) == 1:
            yield ("tolerance",), f"[tolerance] says only half of how well {what} is known: add '{missing[0]}'"
        elif not missing and getattr(rig, owner) is None:
            yield ("tolerance", f"{what}_m"), f"{what}_m is there, but there is no [{owner}] that it is the sigma of"
