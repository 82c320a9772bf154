"""Kinds of values in a rig file, with their ranges: what its records are made of. Vectors are plain tuples."""

from typing import Annotated

from msgspec import Meta

Vector = tuple[float, float, float]
Positive = Annotated[float, Meta(gt=0.0)]
NotNegative = Annotated[float, Meta(ge=0.0)]
Identity = Annotated[int, Meta(ge=1)]
Word = Annotated[str, Meta(min_length=1)]
ZERO: Vector = (0.0, 0.0, 0.0)
