"""What must hold between the artefacts of a rig file: cones, bars in their positions, spheres."""

import math
from collections.abc import Iterator

from acquisition.recording.rig.schema import Rig
from acquisition.recording.rig_lines import KeyPath

Fault = tuple[KeyPath, str]
SHORTEST = 1e-6  # feels right: no hand writes a direction so short


def artefact_faults(rig: Rig) -> Iterator[Fault]:
    """(key path, what is wrong and what to do), as the rules of rig_rules."""
    named = {
        "bar": [bar.id for bar in rig.bar_list],
        "bar_position": [position.id for position in rig.bar_position_list],
        "seat": [seat.id for seat in rig.seat_list],
        "sphere": [sphere.id for sphere in rig.sphere_list],
    }
    for section, ids in named.items():
        for index, number in enumerate(ids):
            if number in ids[:index]:
                yield (section, index, "id"), f"id = {number} is used twice in [[{section}]]; give every one its own"
    for index, position in enumerate(rig.bar_position_list):
        path: KeyPath = ("bar_position", index)
        if position.bar not in rig.bars:
            known = ", ".join(map(str, rig.bars)) or "none"
            yield (*path, "bar"), f"bar = {position.bar} is no [[bar]] of this rig (known: {known}); add or correct it"
        if math.hypot(*position.direction) < SHORTEST:
            yield (*path, "direction"), f"direction = {list(position.direction)} points nowhere; say how the bar lies"
    if rig.sphere_list and rig.tool.probe_diameter_m is None:
        yield ("tool",), "[[sphere]] is touched from outside: add 'probe_diameter_m', the ball's, to [tool]"
