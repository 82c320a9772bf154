"""Verification of an identified arm: the figures of both standards from a recording that the fit has not used.

A recording is refused where it is of another arm, or where the model was made of its readings. verification.json holds
the result, version 1 (docs/formats.md).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import msgspec

from acquisition.recording import Recording
from acquisition.recording.rig import Arm, Rig, parse_rig
from calibrate.errors import DataError
from calibrate.model.model_file import ModelFile
from calibrate.model.predict import Predictor
from calibrate.verify import standards
from calibrate.verify.measured_lengths import (
    BallPlaces,
    Figure,
    Judgement,
    measured,
)

STANDARDS: tuple[Callable[[BallPlaces], tuple[Figure, ...]], ...] = (
    standards.iso10360_12_figures,
    standards.b89_4_22_figures,
)
SAME_JOINTS = " The model was fitted at the same joint angles; if to these readings, the result proves nothing."


@dataclass(frozen=True)
class Verification:
    """Figures in the order of the standards."""

    figures: tuple[Figure, ...]
    samples: int
    left_out: tuple[str, ...] = ()  # series of touches that show no sphere, and why
    same_joints: bool = False  # as those of the fit, by a model that an earlier version wrote

    @property
    def failed(self) -> tuple[Figure, ...]:
        """Beyond what is permitted."""
        return tuple(figure for figure in self.figures if figure.judgement is Judgement.FAILS)

    @property
    def judged(self) -> tuple[Figure, ...]:
        """Those with a limit and a value."""
        return tuple(f for f in self.figures if f.judgement in (Judgement.CONFORMS, Judgement.FAILS))

    @property
    def sentence(self) -> str:
        """For a person, first."""
        if not self.judged:
            return "Nothing was judged: state permissible errors in the rig's [mpe]."
        if self.failed:
            return (
                f"Does not conform: {', '.join(figure.symbol for figure in self.failed)} beyond the permissible error."
            )
        parts = [figure.symbol for figure in self.judged if not figure.complete]
        rest = f" Part of the test only, with fewer measurements than it asks for: {', '.join(parts)}." if parts else ""
        rest += " Series were left out." if self.left_out else ""
        rest += SAME_JOINTS if self.same_joints else ""
        return f"Conforms in all {len(self.judged)} figures that were judged.{rest}"


def verify(recording: Recording, model: ModelFile) -> Verification:
    """DataError where the recording holds nothing to verify by, or the model is of another arm or of these readings."""
    refuse_wrong_model(recording, model)
    found = measured(recording.samples, recording.rig, Predictor.of(model))
    standards.refuse_without_probe(found)
    figures = tuple(f for figures in STANDARDS for f in figures(found))
    return Verification(figures, len(recording.samples), found.left_out, model.made_of(recording.samples) is None)


def refuse_wrong_model(recording: Recording, model: ModelFile) -> None:
    """DataError for a model of another arm, of another probe, or of these very readings.

    An arm is known by the name of its rig and by its drawing: two of one make under one name look the same.
    """
    rig = recording.rig
    if model.rig.name != rig.name:
        raise DataError(
            f"model of rig {model.rig.name}, recording of rig {rig.name}: the model is of another "
            "arm; give the model of this arm"
        )
    if model.rig.text is not None:
        _refuse_other_drawing(parse_rig(model.rig.text, f"rig.toml in the model of {model.rig.name}"), rig)
    if model.made_of(recording.samples):
        raise DataError(
            "the model was made of these very readings and fits them whatever it is worth; verify by others: "
            "`calibeam session RIG --verify` takes them"
        )


def _refuse_other_drawing(of_model: Rig, of_recording: Rig) -> None:
    for what, one, other in _drawings(of_model, of_recording):
        if one != other:
            raise DataError(
                f"rig {of_recording.name}: {what} of the model's rig file is not that of the recording's ({one} and "
                f"{other}); give the model of this arm, or identify it by this rig file"
            )


def _drawings(a: Rig, b: Rig) -> list[tuple[str, object, object]]:
    out: list[tuple[str, object, object]] = [
        ("arm.model", a.arm.model.value, b.arm.model.value),
        ("number of joints", a.n_joints, b.n_joints),
    ]
    joints = zip(_parts(a.arm), _parts(b.arm), strict=False)
    out += [(f"joint {i}", one, other) for i, (one, other) in enumerate(joints, start=1)]
    return [*out, ("arm.flange", a.arm.flange, b.arm.flange), ("tool.point_m", a.tool.point_m, b.tool.point_m)]


def _parts(arm: Arm) -> list[tuple[object, ...]]:
    """What is nominal of every joint; its range and its masses may be known better later."""
    drawn = ("a_m", "alpha_rad", "d_m", "theta_offset_rad", "origin_m", "rotation_rad")
    return [tuple(getattr(joint, name, None) for name in drawn) for joint in arm.joints]


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
