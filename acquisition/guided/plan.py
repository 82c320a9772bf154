"""What a guided session takes, in its order: readings of one visit are recorded together.

Cones come twice, before and after the bars, so that what drifts meanwhile is not taken for geometry.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import AcquisitionError
from acquisition.guided.reading import BarEnd, Cone, SphereSpot, Target, Vector
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Rig, Sphere
from acquisition.recording.rig.schema import BarPosition

Floats = NDArray[np.float64]
GOLDEN_RAD = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True)
class GuidedOptions:
    """How much is taken. Readings are three equations at a cone and one at a bar; an arm has some fifty unknowns."""

    postures: int = 72  # in each cone
    lengths: int = 4  # of each bar position
    seed: int = 1

    def __post_init__(self) -> None:
        if self.postures < 2 or self.lengths < 1:
            raise AcquisitionError(
                f"{self.postures} postures a cone, {self.lengths} lengths a bar position: one posture in a cone "
                "determines "
                "nothing; take 2 or more, and 1 or more lengths"
            )


@dataclass(frozen=True)
class GuidedVisit:
    """Targets one after the other that only count together: a cone alone, both ends of a bar."""

    targets: tuple[Target, ...]
    posture_rad: tuple[float, ...] | None = None  # asked for first; None: the emptiest of the joints' ranges

    @property
    def says(self) -> str:
        return self.targets[0].says


def calibration_plan(rig: Rig, options: GuidedOptions) -> tuple[GuidedVisit, ...]:
    """Cones in half of their postures, bars, cones again. AcquisitionError for a rig without any length: see below.

    A probe that only sits in cones shows no length at all: an arm half as large would sit in them as well.
    """
    if not rig.bar_positions:
        raise AcquisitionError(
            f"rig {rig.name}: no [[bar_position]]: cones alone show no length, the size of the arm would be a guess; "
            "add a [[bar]] of known length and at least one [[bar_position]]"
        )
    first = options.postures // 2
    cones = [Cone(seat.id, seat.origin_m) for seat in rig.seats.values()]
    before = [GuidedVisit((cone,)) for cone in cones for _ in range(first)]
    after = [GuidedVisit((cone,)) for cone in cones for _ in range(options.postures - first)]
    return (*before, *_lengths(rig, options.lengths), *after)


def planned_visits(plan: PosePlan, rig: Rig) -> tuple[GuidedVisit, ...]:
    """The postures of a pose plan, each in its cone. AcquisitionError for a block without one of the rig's seats."""
    out: list[GuidedVisit] = []
    for number, block in enumerate(plan.block, start=1):
        seat = None if block.seat is None else rig.seats.get(block.seat)
        if seat is None:
            known = ", ".join(map(str, rig.seats)) or "none"
            raise AcquisitionError(
                f"pose plan, block {number}: seat {block.seat} is no [[seat]] of rig {rig.name} (known: {known}); a "
                "hand-held arm is only asked into cones"
            )
        cone = Cone(seat.id, seat.origin_m)
        out += [GuidedVisit((cone,), pose.q_rad) for pose in block.pose]
    return tuple(out)


def verification_plan(rig: Rig, repeats: int = 3) -> tuple[GuidedVisit, ...]:
    """Spheres, cones and bars as the tests of ISO 10360-12 and ASME B89.4.22 want them (docs/arm-cmm.md).

    A sphere is touched in the series below; a cone is taken in 10 articulations; every length `repeats` times.
    AcquisitionError where there is nothing of it in the rig.
    """
    if not (rig.spheres or rig.seats or rig.bar_positions):
        raise AcquisitionError(f"rig {rig.name}: no [[sphere]], [[seat]] or [[bar_position]] to verify with; add them")
    return (*_touches(rig), *_articulations(rig), *_lengths(rig, repeats))


ARTICULATIONS_OF_A_CONE = 10
# Touches of each series on a sphere: size and form; location in five articulations; effective diameter, three times.
SIZE_SERIES, LOCATION_SERIES, DIAMETER_SERIES = (0,), (1, 2, 3, 4, 5), (6, 7, 8)
SERIES = {**dict.fromkeys(SIZE_SERIES, 25), **dict.fromkeys(LOCATION_SERIES, 5), **dict.fromkeys(DIAMETER_SERIES, 9)}


def _lengths(rig: Rig, times: int) -> Iterator[GuidedVisit]:
    for position in rig.bar_positions.values():
        a, b = (_end(rig, position, end) for end in "ab")
        yield from (GuidedVisit((a, b)) for _ in range(times))


def _end(rig: Rig, position: BarPosition, end: str) -> BarEnd:
    along = np.array(position.direction) / np.linalg.norm(position.direction)
    half_m = 0.5 * rig.bars[position.bar].length_m * along
    point = np.array(position.middle_m) + (half_m if end == "b" else -half_m)
    return BarEnd(position.id, position.bar, end, _vector(point))


def _articulations(rig: Rig) -> Iterator[GuidedVisit]:
    for seat in rig.seats.values():
        yield from (GuidedVisit((Cone(seat.id, seat.origin_m),)) for _ in range(ARTICULATIONS_OF_A_CONE))


def _touches(rig: Rig) -> Iterator[GuidedVisit]:
    for sphere in rig.spheres.values():
        for series, touches in SERIES.items():
            for direction in hemisphere(touches):
                yield GuidedVisit((_spot(rig, sphere, direction, series),))


def _spot(rig: Rig, sphere: Sphere, direction: Floats, series: int) -> SphereSpot:
    apart_m = 0.5 * (sphere.diameter_m + (rig.tool.probe_diameter_m or 0.0))
    point = np.array(sphere.origin_m) + apart_m * direction
    return SphereSpot(sphere.id, _vector(direction), series, _vector(point))


def hemisphere(count: int) -> Floats:
    """(count, 3) unit directions evenly over the upper half of a sphere: a spiral of equal areas, the pole first."""
    k = np.arange(count)
    z = 1.0 - k / (count - 0.5)
    radius = np.sqrt(1.0 - z**2)
    return np.stack((radius * np.cos(GOLDEN_RAD * k), radius * np.sin(GOLDEN_RAD * k), z), axis=1)


def readings_of(plan: tuple[GuidedVisit, ...]) -> int:
    """How many rows the plan makes."""
    return sum(len(visit.targets) for visit in plan)


def by_kind(plan: tuple[GuidedVisit, ...]) -> Mapping[str, int]:
    """Readings of cones, bars and spheres."""
    kinds = {Cone: "cones", BarEnd: "bars", SphereSpot: "spheres"}
    counts = dict.fromkeys(kinds.values(), 0)
    for visit in plan:
        for target in visit.targets:
            counts[kinds[type(target)]] += 1
    return counts


def _vector(values: Floats) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
