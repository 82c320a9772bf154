"""`errors.toml`: which errors of an arm, by which law and how large (docs/error-simulation.md)."""

import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct

from acquisition.recording.rig_faults import explain
from acquisition.recording.rig_lines import KeyPath, key_lines, line_of
from calibrate.error_simulation.law import Law
from calibrate.errors import DataError

NotNegative = Annotated[float, Meta(ge=0.0)]
Positive = Annotated[float, Meta(gt=0.0)]
SUFFIX = {"m": "_m", "rad": "_rad", "K": "_k"}


class SourceEntry(Struct, frozen=True, forbid_unknown_fields=True):
    """One [[source]]: names or shell patterns of them, a law, its size in the unit of the source."""

    what: tuple[str, ...]
    law: str = "normal"
    shape: tuple[float, ...] = ()
    scale_m: NotNegative | None = None
    scale_rad: NotNegative | None = None
    scale_k: NotNegative | None = None
    loc_m: float | None = None
    loc_rad: float | None = None
    loc_k: float | None = None
    order: Positive | None = None  # of waves, cycles a turn

    def law_in(self, unit: str) -> Law:
        """Its law for sources of a unit. DataError where the size is not in this unit."""
        suffix = SUFFIX[unit]
        scale, loc = getattr(self, f"scale{suffix}"), getattr(self, f"loc{suffix}")
        if scale is None:
            raise DataError(f"source {', '.join(self.what)}: no scale{suffix}, but this error is in {unit}; give it")
        return Law(self.law, scale, loc or 0.0, self.shape)


class ErrorPlan(Struct, frozen=True, forbid_unknown_fields=True):
    """A whole file; a later entry wins over an earlier one."""

    schema: Literal[1]
    source: tuple[SourceEntry, ...]
    expansion_per_k: Positive | None = None  # of the links' material; heat needs it
    believed: bool = True  # whether what the rig file believes stands beside it


NOTHING_STATED = ErrorPlan(schema=1, source=())


def read_error_plan(path: Path) -> ErrorPlan:
    """The plan of a file. DataError naming file, line, key, value and remedy."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise DataError(f"{path}: cannot read the error plan ({error.strerror}); check the path") from error
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: the error plan is not UTF-8 (byte {error.start}); save it as UTF-8") from error
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise DataError(f"{path}: not TOML: {error}; correct the line") from error
    lines = key_lines(text)
    try:
        plan = msgspec.convert(document, type=ErrorPlan)
    except msgspec.ValidationError as error:
        raise _fault(path, lines, *explain(error, document, ErrorPlan)) from error
    for place, says in _contradictions(plan):
        raise _fault(path, lines, place, says)
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


def _fault(path: Path, lines: Mapping[KeyPath, int], place: KeyPath, says: str) -> DataError:
    return DataError(f"{path} line {line_of(lines, place)}: {says}")
