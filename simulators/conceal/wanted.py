"""What is asked for: a family of sessions, its size, and what shall be hidden in it."""

from dataclasses import dataclass
from typing import Literal, get_args

from simulators.conceal.noise import Kind

Family = Literal["dual-psd", "tracker", "cones", "wire"]
FAMILIES: tuple[Family, ...] = get_args(Family)
Side = Literal["link", "motor", "beside"]  # of second encoders: simulators/conceal/second_encoders.py
SIDES: tuple[Side, ...] = get_args(Side)
INSTRUMENT = {"dual-psd": "dual-psd", "tracker": "position", "cones": "seat", "wire": "wire"}


class ConcealError(ValueError):
    """What was asked for cannot be drawn."""


@dataclass(frozen=True)
class Wanted:
    """One session. The same record and seed always give the same recording."""

    family: Family
    seed: int
    defects: tuple[str, ...] = ()  # kinds; "outside": one that no catalogue lists; "any": one that a catalogue may list
    enr: float = 1.0  # wanted effect over noise of each defect
    samples: int = 300
    places: int = 3  # of a fixture; cones: seats
    arm: str | None = None  # by name; None: drawn
    noise: Kind = "white"
    withhold: bool = False  # the column that would name the defect is not recorded
    encoders: Side | None = None  # second encoders are recorded, and defects are of machine-like size, whatever `enr`
    side_stated: bool = False  # the rig file says on which side of the gear they sit
