"""verification.json: what a verification said, version 1 (docs/formats.md)."""

from pathlib import Path
from typing import Literal

import msgspec

from calibrate.verification.figure import Figure
from calibrate.verification.verify import Verification

SCHEMA = 1


class OneMeasurement(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One of those behind a figure."""

    says: str
    value_m: float
    permitted_m: float | None


class FigureRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One figure of a standard."""

    symbol: str
    says: str
    standard: str
    section: str
    formula: str
    value_m: float | None
    permitted_m: float | None
    judgement: str
    taken: int
    asked: int
    complete: bool
    each: tuple[OneMeasurement, ...]
    also_m: dict[str, float]


class VerificationFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Content of verification.json."""

    schema: Literal[1]
    kind: Literal["calibeam-verification"]
    software: str
    rig: str
    recording: str
    model: str
    samples: int
    conforms: bool | None  # None: nothing was judged
    says: str
    figures: tuple[FigureRecord, ...]
    left_out: tuple[str, ...] = ()


def verification_file(found: Verification, *, rig: str, recording: str, model: str, software: str) -> VerificationFile:
    """The record to write."""
    conforms = not found.failed if found.judged else None
    figures = tuple(_record(figure) for figure in found.figures)
    return VerificationFile(
        SCHEMA,
        "calibeam-verification",
        software,
        rig,
        recording,
        model,
        found.samples,
        conforms,
        found.sentence,
        figures,
        found.left_out,
    )


def _record(figure: Figure) -> FigureRecord:
    return FigureRecord(
        figure.symbol,
        figure.says,
        figure.source.standard,
        figure.source.section,
        figure.source.formula,
        figure.value,
        figure.permitted,
        figure.judgement.name,
        figure.taken,
        figure.asked,
        figure.complete,
        tuple(OneMeasurement(*one) for one in figure.each),
        dict(figure.also),
    )


def write_verification(path: Path, file: VerificationFile) -> None:
    """Whole or not at all. OSError where the folder cannot be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(path.name + ".partial")
    partial.write_bytes(msgspec.json.format(msgspec.json.encode(file), indent=1) + b"\n")
    partial.replace(path)
