"""What model.json, schema 2, holds beside geometry: effects, and the session that they were found in.

docs/formats.md explains every key.
"""

from collections.abc import Sequence
from typing import Annotated, Literal

from msgspec import Meta, Struct

from acquisition.recording.files import shown
from acquisition.recording.files.bounds import Instant, Label, Many, Name, Number, Statistic, Whole

Component = Annotated[int, Meta(ge=0, le=15)]  # of a port: six of a frame, one for each joint of the joints
Waves = Annotated[int, Meta(ge=1, le=64)]  # of a curve over each of its drivers


class StrictRecord(Struct, frozen=True, forbid_unknown_fields=True):
    """Every part of it."""


class EffectParameter(StrictRecord, frozen=True):
    """As a person reads it; null where the data do not determine it."""

    value: Number | None
    sigma: Statistic | None
    unit: Label


class EffectCurve(StrictRecord, frozen=True):
    """What an unknown cause of one driver adds at its port, and one sigma of it, at knots over the recorded range."""

    driver: Name
    unit: Label
    knots: Many[Number]
    values: Many[Number]
    sigma: Many[Statistic]

    def __post_init__(self) -> None:
        if not len(self.knots) == len(self.values) == len(self.sigma):
            raise ValueError("knots, values and sigma of a curve are of different lengths")


class EffectRecord(StrictRecord, frozen=True):
    """One piece of physics. `coefficients` and `inner` are what a prediction takes, by their names in `covariance`."""

    name: Name
    where: Name
    physics: Name
    depends_on: Label  # several: joined by commas
    shape: Label
    order: Whole | None
    variant: Label
    parameters: dict[Name, EffectParameter]
    coefficients: dict[Name, Number]
    inner: dict[Name, Number]
    about: dict[Name, Number]
    holds: Literal["always", "session"]
    range: dict[Name, tuple[Number, Number]]
    confidence: Statistic | None = None
    says: Label = ""
    listed: Label = ""  # its physics in the catalogue, where `physics` is unknown although its form has a name
    curve: EffectCurve | None = None
    place: Label = ""  # of the port, of an unknown cause that is a curve: a Place; two ports may share `where`
    frame: Component | None = None  # B_i that moves, where `place` is a frame
    component: Component | None = None  # of that port
    waves: Waves | None = None
    after: Label = ""  # name of the effect of the session that left this behind, from the end of that session on

    def __post_init__(self) -> None:
        for driver, (low, high) in self.range.items():
            if low > high:
                raise ValueError(f"range.{shown(driver)} ends below its start: {low} to {high}")


class SessionRecord(StrictRecord, frozen=True):
    """The recording that the effects were found in, and the conditions that they are stated about."""

    started_utc: Label
    first_t_s: Instant
    last_t_s: Instant
    readings_sha256: Label
    conditions: dict[Name, Many[Number | None]]  # column of samples.csv -> one value a sample

    def __post_init__(self) -> None:
        lengths = {name: len(values) for name, values in self.conditions.items()}
        if len(set(lengths.values())) > 1:
            short = min(lengths, key=lambda name: lengths[name])
            raise ValueError(
                f"session.conditions.{shown(short)} holds {lengths[short]} values, others {max(lengths.values())}"
            )


def check_physics(schema: int, effects: Sequence[EffectRecord], session: SessionRecord | None) -> None:
    """ValueError where effects contradict each other, or what they are stated about is missing."""
    if effects and schema == 1:
        raise ValueError("schema 1 holds no effects; a model with effects is of schema 2")
    if effects and session is None:
        raise ValueError("effects without session: what they are stated about is missing")
    names = [effect.name for effect in effects]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(f"effects: two are named {shown(twice)}; each name stands once")
    for effect in effects:
        if effect.after and (effect.after not in names or effect.holds != "always"):
            raise ValueError(
                f"effect {shown(effect.name)} is left behind by {shown(effect.after)}, which is not listed"
            )
