"""The end of a calibration in ten lines: how good the arm is, whether to trust it, why, what was found, what to do."""

from collections.abc import Iterator

from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.report.elements.verdict import Answers

REASONS, CAUSES = 2, 3  # of each at most: all of them stand in the report


def calibration_lines(answers: Answers, diagnosis: DiagnosisFile | None, kept: str) -> Iterator[str]:
    """`kept`: why the model is the geometry alone; empty where it holds the physics found."""
    judged = answers.verdict
    yield judged.sentence
    yield f"trust: {judged.trust.value}"
    yield from (f"  {reason}" for reason in judged.reasons[:REASONS])
    found = () if diagnosis is None else diagnosis.findings
    for number, one in enumerate(found[:CAUSES], start=1):
        yield f"{number}. {one.says} (confidence {one.confidence:.2f})"
    if len(found) > CAUSES:
        yield f"and {len(found) - CAUSES} more causes: in the report"
    yield f"the model is the geometry alone: {kept}" if kept else "the model holds the physics found"
    yield from (f"to do: {advice}" for advice in judged.advice[:1])
