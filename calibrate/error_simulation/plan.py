"""`errors.toml`: which errors of an arm, by which law and how large (docs/error-simulation.md)."""

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from msgspec import Struct

from acquisition.recording.files import KeyPath, parse_toml, read_text, shown
from acquisition.recording.files.bounds import (
    Expansion,
    Few,
    Kelvin,
    KelvinOrNone,
    Metres,
    MetresOrNone,
    Name,
    Number,
    Order,
    PerJoint,
    Radians,
    RadiansOrNone,
)
from calibrate.error_simulation.sources import Law
from calibrate.errors import DataError

SUFFIX = {"m": "_m", "rad": "_rad", "K": "_k"}


class SourceEntry(Struct, frozen=True, forbid_unknown_fields=True):
    """One [[source]]: names or shell patterns of them, a law, its size in the unit of the source."""

    what: Few[Name]
    law: Name = "normal"
    shape: PerJoint[Number] = ()
    scale_m: MetresOrNone | None = None
    scale_rad: RadiansOrNone | None = None
    scale_k: KelvinOrNone | None = None
    loc_m: Metres | None = None
    loc_rad: Radians | None = None
    loc_k: Kelvin | None = None
    order: Order | None = None  # of waves, cycles a turn

    def law_in(self, unit: str) -> Law:
        """Its law for sources of a unit. DataError where the size is not in this unit."""
        suffix = SUFFIX[unit]
        scale, loc = getattr(self, f"scale{suffix}"), getattr(self, f"loc{suffix}")
        if scale is None:
            raise DataError(
                f"source {shown(', '.join(self.what))}: no scale{suffix}, but this error is in {unit}; give it"
            )
        return Law(self.law, scale, loc or 0.0, self.shape)


class ErrorPlan(Struct, frozen=True, forbid_unknown_fields=True):
    """A whole file; a later entry wins over an earlier one."""

    schema: Literal[1]
    source: Few[SourceEntry]
    expansion_per_k: Expansion | None = None  # of the links' material; heat needs it
    believed: bool = True  # whether what the rig file believes stands beside it


NOTHING_STATED = ErrorPlan(schema=1, source=())


def read_error_plan(path: Path) -> ErrorPlan:
    """The plan of a file. DataError naming file, line, key, value and remedy."""
    file = parse_toml(read_text(path, "error plan", DataError), str(path), DataError)
    plan = file.checked(ErrorPlan)
    for place, says in _contradictions(plan):
        raise file.error(place, says)
    return plan


def _contradictions(plan: ErrorPlan) -> Iterator[tuple[KeyPath, str]]:
    for i, entry in enumerate(plan.source):
        stated = [s for s in SUFFIX.values() if getattr(entry, f"scale{s}") is not None]
        if len(stated) != 1:
            yield ("source", i), "a source wants one of scale_m, scale_rad, scale_k; give the one of its unit"
            continue
        for suffix in SUFFIX.values():
            if suffix != stated[0] and getattr(entry, f"loc{suffix}") is not None:
                yield ("source", i, f"loc{suffix}"), f"loc{suffix} beside scale{stated[0]}; give loc{stated[0]}"
        try:
            entry.law_in(next(unit for unit, s in SUFFIX.items() if s == stated[0]))
        except DataError as error:
            yield ("source", i), str(error)
