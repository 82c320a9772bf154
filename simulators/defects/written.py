"""Mechanisms as plain values: [{"mechanism": "soft-joint", "fields": {...}}, ...], as a revealed truth lists them."""

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from simulators.defects.defect import Defect
from simulators.defects.mechanisms import MECHANISMS


class WrittenError(ValueError):
    """The name of no mechanism, or other quantities than it has."""


def written(defects: Sequence[Defect]) -> list[dict[str, Any]]:
    """Ready for JSON."""
    return [{"mechanism": defect.KIND, "fields": dict(vars(defect))} for defect in defects]


def defects_of(listed: Sequence[Mapping[str, Any]]) -> tuple[Defect, ...]:
    """The mechanisms that were written. WrittenError with the name and the remedy."""
    return tuple(_made(one) for one in listed)


def _made(one: Mapping[str, Any]) -> Defect:
    kind: Any = next((kind for kind in MECHANISMS if one.get("mechanism") == kind.KIND), None)
    if kind is None:
        names = ", ".join(kind.KIND for kind in MECHANISMS)
        raise WrittenError(f"no mechanism {one.get('mechanism')!r}; there are {names}")
    try:
        return msgspec.convert(one.get("fields", {}), type=kind)
    except msgspec.ValidationError as error:
        raise WrittenError(f"mechanism {kind.KIND}: {error}; correct its fields") from error
