"""What two rig files state differently, key by key, in the order of the file."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from acquisition.recording.rig import Rig
from acquisition.recording.samples import BAR

SAME = 1e-12  # m, rad or a share of a number: one number written twice
# What places a reading: where two recordings' rigs differ in it, one at most states the arm that both are about.
PLACES = ("arm", "tool", "fixture", "placement", "known_distance", BAR)
NUMBERS = (
    "model", "a_m", "alpha_rad", "d_m", "theta_offset_rad", "origin_m", "rotation_rad", "point_m", "laser_origin_m",
    "laser_direction", "length_m",
)  # fmt: skip

Value = str | float | bool | None


@dataclass(frozen=True)
class RigKey:
    """One key. `difference`: measured less simulated of numbers."""

    key: str  # "arm.joint 4.d_m"
    measured: Value
    simulated: Value
    difference: float | None
    geometry: bool  # False: limits, masses, noise, devices, what does not place a reading


def rig_differences(measured: Rig, simulated: Rig) -> tuple[RigKey, ...]:
    """Keys that only one of them has stand with None on the other side."""
    one, two = dict(_leaves(measured)), dict(_leaves(simulated))
    keys = [*one, *(key for key in two if key not in one)]
    return tuple(_key(key, one.get(key), two.get(key)) for key in keys if not _same(one.get(key), two.get(key)))


def _leaves(rig: Rig) -> Iterator[tuple[str, Value]]:
    plain: Mapping[str, Any] = msgspec.to_builtins(rig)
    for name, value in plain.items():
        if name not in ("schema", "name"):
            yield from _below(name, value)


def _below(path: str, value: Any) -> Iterator[tuple[str, Value]]:
    if isinstance(value, Mapping):
        for name, one in value.items():
            yield from _below(f"{path}.{name}", one)
    elif isinstance(value, Sequence) and not isinstance(value, str):
        for number, one in enumerate(value, start=1):
            named = one.get("id", number) if isinstance(one, Mapping) else number
            yield from _below(f"{path} {named}", one)
    else:
        yield path, value


def _same(one: Value, two: Value) -> bool:
    if isinstance(one, float | int) and isinstance(two, float | int):
        return math.isclose(one, two, rel_tol=SAME, abs_tol=SAME)
    return one == two


def _key(path: str, one: Value, two: Value) -> RigKey:
    numbers = isinstance(one, float | int) and isinstance(two, float | int) and not isinstance(one, bool)
    difference = float(one) - float(two) if numbers and one is not None and two is not None else None
    parts = [part.split(" ")[0] for part in path.split(".")]
    return RigKey(path, one, two, difference, parts[0] in PLACES and any(part in NUMBERS for part in parts[1:]))
