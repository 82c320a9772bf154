"""What `check` examines of a recording, and the sentence that its examinations allow."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from acquisition.recording import Finding, Recording
from acquisition.recording.check_recording import Problem, Severity
from acquisition.recording.examination import (
    FOUND,
    NO_REMEDY,
    Examination,
    ExaminationRecord,
    all_examined,
    examined_names,
    not_examined_lines,
)
from acquisition.recording.recording_examinations import RECORDING_EXAMINATIONS, recording_examinations
from calibeam.results.controller_findings import CONTROLLER_ARM, controller_examination
from calibrate.diagnose.streams import devices_of, examine_encoders
from calibrate.fit.controller_arm import ControllerArm
from calibrate.model.effects.term import Size
from calibrate.quantities import angle_with_sigma

SIGMAS = 5.0  # of an eccentricity that is found
PAIRS = Examination(
    "encoders against each other",
    ("position_rad",),
    "record all encoders of a shaft while it turns, for a thousand rows or more",
)


@dataclass(frozen=True, eq=False)
class CheckedRecording:
    """A recording with the findings of its check and the arm of its controller, where it shows one."""

    recording: Recording
    findings: tuple[Finding, ...]
    arm: ControllerArm | None


def _pairs(checked: CheckedRecording) -> Iterator[ExaminationRecord]:
    """Of a log of encoders alone: slips and eccentricity, each encoder against the first."""
    alone = checked.recording.rig.n_joints == 0
    device = devices_of(checked.recording).get("encoders") if alone else None
    if device is None:
        why = "no readings of encoders were recorded" if alone else "the encoders are those of an arm's joints"
        yield PAIRS.not_examined(why, expected=alone, remedy="" if alone else NO_REMEDY)
        return
    if device.track.channels < 2:
        yield PAIRS.not_examined("there is one encoder only", expected=False, remedy=NO_REMEDY)
    for pair in examine_encoders(device)[1]:
        slips = [Size(one.size_rad, one.sigma_rad) for one in pair.slips]
        where, found = f"encoder {pair.number}", "; ".join(_in_words(pair.once_rad, slips))
        if found:
            yield PAIRS.found(found, where)
        elif pair.once_rad is not None:
            yield PAIRS.nothing(SIGMAS * pair.once_rad.sigma, "rad", where)
        else:
            yield PAIRS.not_examined(pair.why or "the readings do not determine it", where)


def _in_words(once: Size | None, slips: Sequence[Size]) -> Iterator[str]:
    if once is not None and once.value > SIGMAS * once.sigma:
        yield f"eccentricity {angle_with_sigma(once.value, once.sigma)}, once a turn"
    yield from (f"slip of {angle_with_sigma(one.value, one.sigma)}" for one in slips)


def _controller(checked: CheckedRecording) -> Iterator[ExaminationRecord]:
    if checked.recording.rig.n_joints:
        yield controller_examination(checked.recording, checked.arm)
    else:
        yield CONTROLLER_ARM.not_examined("the rig has no arm", expected=False, remedy=NO_REMEDY)


BEYOND_THE_RECORDING: tuple[tuple[Examination, Callable[[CheckedRecording], Iterator[ExaminationRecord]]], ...] = (
    (PAIRS, _pairs),
    (CONTROLLER_ARM, _controller),
)
CHECK_EXAMINATIONS = tuple(one for one, _ in (*RECORDING_EXAMINATIONS, *BEYOND_THE_RECORDING))


def check_examinations(
    recording: Recording, findings: tuple[Finding, ...], arm: ControllerArm | None
) -> tuple[ExaminationRecord, ...]:
    """The endings of all examinations of `check`."""
    checked = CheckedRecording(recording, findings, arm)
    beyond = (record for _, examine in BEYOND_THE_RECORDING for record in examine(checked))
    return (*recording_examinations(recording, findings), *beyond)


def verdict_lines(findings: Sequence[Finding], examinations: Sequence[ExaminationRecord]) -> Iterator[str]:
    """What was not examined, then the verdict: no errors only where all that the recording allows was examined."""
    yield from not_examined_lines(examinations)
    if any(finding.is_error for finding in findings):
        yield "not fit for use: errors above"
    elif any(finding.problem is Problem.READINGS for finding in findings):
        yield "readings were left out; see the warnings above"
    elif not examined_names(examinations):
        yield "nothing was examined: the reasons are above"
    elif not all_examined(examinations):
        found = dict.fromkeys(one.what for one in examinations if one.outcome == FOUND)
        rest = [name for name in examined_names(examinations) if name not in found]
        seen = f"see above what was found: {', '.join(found)}; " if found else ""
        yield f"{seen}nothing wrong in what was examined: {', '.join(rest) or 'the rest'}"
    elif any(finding.severity is Severity.WARNING for finding in findings):
        yield "no errors; see the warnings above"
    elif any(one.outcome == FOUND for one in examinations):
        yield "no errors; see above what was found"
    else:
        yield "no errors"
