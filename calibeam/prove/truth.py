"""The truth of a case as the seal holds it: the part that a score needs, with types."""

from collections.abc import Sequence
from typing import Any

import msgspec

from calibeam.prove.record import UNKNOWN


class TrueDefect(msgspec.Struct, frozen=True):
    """One concealed mechanism."""

    mechanism: str
    physics: str
    port: str
    drivers: tuple[str, ...]
    figures: dict[str, float]
    enr: float  # effect over noise, after geometry


class TrueNoise(msgspec.Struct, frozen=True):
    """One sigma that was drawn, and the rms of what was added."""

    kind: str
    sigma_m: float
    rms_m: float


class FreeSpace(msgspec.Struct, frozen=True):
    """Where the tool truly is at the poses asked: tip, or beam."""

    tip_m: list[list[float]] | None = None
    beam_origin_m: list[list[float]] | None = None
    beam_direction: list[list[float]] | None = None


class Exact(msgspec.Struct, frozen=True):
    """Readings without noise."""

    values_m: list[list[float]]


class Truth(msgspec.Struct, frozen=True):
    """What was hidden; everything else of the sealed document stays in the file."""

    wanted: dict[str, Any]
    defects: tuple[TrueDefect, ...]
    withheld: tuple[str, ...]
    noise: TrueNoise
    exact: Exact
    free_space: FreeSpace


def truth_of(content: bytes, without: Sequence[str] = ()) -> Truth:
    """Of an opened seal. Physics that was taken out of the catalogue is unknown, and has to be called so."""
    truth = msgspec.json.decode(content, type=Truth)
    defects = (msgspec.structs.replace(d, physics=UNKNOWN) if d.physics in without else d for d in truth.defects)
    return msgspec.structs.replace(truth, defects=tuple(defects))
