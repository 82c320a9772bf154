"""Pages and words of a diagnosis."""

import importlib
from typing import TYPE_CHECKING

from calibrate.report.diagnosis.words import (
    SPLITS,
    before_after,
    free_space_words,
    limit_words,
    micrometres,
    missing_lines,
    noise_words,
    place_words,
    rival_words,
    size_of,
    stream_words,
    verdict_words,
)

if TYPE_CHECKING:
    from calibrate.report.diagnosis.diagnosis_page import write_diagnosis_report
    from calibrate.report.diagnosis.finding_page import chain_figure, chain_of

__all__ = [
    "SPLITS",
    "before_after",
    "chain_figure",
    "chain_of",
    "free_space_words",
    "limit_words",
    "micrometres",
    "missing_lines",
    "noise_words",
    "place_words",
    "rival_words",
    "size_of",
    "stream_words",
    "verdict_words",
    "write_diagnosis_report",
]

_DRAWN_BY = {
    "write_diagnosis_report": "diagnosis_page",
    "chain_figure": "finding_page",
    "chain_of": "finding_page",
}


def __getattr__(name: str) -> object:
    """A page, from its module, loaded only now: 30 MB of matplotlib stay out of a search."""
    if name not in _DRAWN_BY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_DRAWN_BY[name]}"), name)
