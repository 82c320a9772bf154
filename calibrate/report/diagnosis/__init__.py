"""Pages and words of a diagnosis."""

from calibrate.report.diagnosis.diagnosis_page import write_diagnosis_report
from calibrate.report.diagnosis.finding_page import chain_figure, chain_of
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
