"""The sentence at the top: what was found, and what speaks against trusting it."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from calibrate.fit import Status
from calibrate.report.evidence import Evidence
from calibrate.report.quantities import length, significant
from calibrate.uncertainty.redundancy import checks_nothing
from calibrate.zeros.result import JointZero, ZeroResult

UNLIKELY = 0.01  # lack of fit: the usual level (Draper, Smith, Applied Regression Analysis, 1998, ch. 2.1)
WORSE_UNSEEN = 1.5  # whitened error on unseen poses; the doubt of a healthy fit adds 5 to 20 % to 1
NOISIER = 3.0  # found over believed; believed noise is often wrong by this much, beyond it something is broken
READY = "Put the zeros into the controller, or use model.json as it is (calibeam identify --export)."
AGAIN = "Measure again, with more and more different poses."
SMALL_SHARE = 0.5  # measurement under this share of sigma: something else limits the zero


UNCHECKED = "There are as many unknowns as readings, or nearly so: any arm would fit, and nothing checks the result."
MORE_POSES = "Measure more poses: at least 15, better 50, all over the workspace."

Doubt = tuple[str, str]  # what speaks against trust, and what to do about it


class Trust(Enum):
    """How far the result may be used; the value is the page's colour for it."""

    GOOD = "good"
    CARE = "care"
    NONE = "bad"


@dataclass(frozen=True)
class Verdict:
    """One sentence, every reason for care, and what to do."""

    trust: Trust
    sentence: str
    reasons: tuple[str, ...]
    advice: tuple[str, ...] = ()  # what to do about them


def verdict(evidence: Evidence) -> Verdict:
    """From the result and the recording; the thresholds are those at the top of this file."""
    result = evidence.result
    found = [z for z in result.zeros if z.value_rad is not None]
    doubts = tuple(_doubts(evidence))
    reasons = tuple(says for says, _ in doubts)
    advice = tuple(dict.fromkeys(do for _, do in doubts if do))
    if not found or result.status in (Status.NOT_FINITE, Status.OUT_OF_STEPS, Status.STALLED):
        return Verdict(Trust.NONE, "No joint zero was determined.", (result.status.value, *reasons), (AGAIN, *advice))
    if checks_nothing(result.spare):
        return Verdict(Trust.NONE, f"{UNCHECKED} Do not use the zeros.", reasons, (MORE_POSES, *advice))
    explained = (
        f"The model explains the spots to {length(result.rms_after_m)} rms (before: {length(result.rms_before_m)})"
    )
    if not doubts:
        return Verdict(Trust.GOOD, f"{_count(result)} {explained}; what remains is noise.", (), (READY,))
    return Verdict(Trust.CARE, f"{_count(result)} {explained}, but use the numbers with care.", reasons, advice)


def _count(result: ZeroResult) -> str:
    found = sum(z.value_rad is not None for z in result.zeros)
    return f"{found} of {len(result.zeros)} joint zeros are determined."


def limited_by_measurement(zero: JointZero) -> bool:
    """Whether more poses would make the zero better; False: the drawing's tolerance of the links is the limit."""
    if zero.measurement_sigma_rad is None or zero.sigma_rad is None:
        return True
    return zero.measurement_sigma_rad >= SMALL_SHARE * zero.sigma_rad


def _doubts(evidence: Evidence) -> Iterator[Doubt]:
    yield from _doubts_about_fit(evidence.result)
    yield from _doubts_about_noise(evidence.result)
    if not evidence.recording.complete:
        yield "The recording was cut short; what is in it is good, but the plan was not finished.", "Finish the plan."
    for damage in evidence.recording.damage:
        yield f"The file is damaged: {damage}.", "Keep the file as it is, and record again if you can."


def _doubts_about_fit(result: ZeroResult) -> Iterator[Doubt]:
    repeats, unseen = result.repeats, result.held_out
    if result.status is Status.AT_BOUND:
        yield f"{Status.AT_BOUND.value}.", "Look up which parameter it is below, and check the rig file's drawing."
    if repeats is not None and repeats.lack_of_fit_p < UNLIKELY:
        yield (
            "Repeated poses scatter less than the model misses them "
            f"(lack of fit F = {significant(repeats.lack_of_fit)}, "
            f"p = {significant(repeats.lack_of_fit_p, 2)}): physics is missing from the model.",
            "Run `calibeam diagnose`: it says which physics is missing.",
        )
    if unseen is not None and unseen.chi_after > WORSE_UNSEEN:
        yield (
            f"Poses that the fit has not seen are missed by {significant(unseen.chi_after)} times the noise.",
            "Check that nothing moved during the session, and measure where the arm will work.",
        )
    if unseen is None:
        yield (
            "There is no proof on unseen poses: too few poses, or it was not asked for.",
            "Measure at least 15 poses, better 50, so that some can be kept for the proof.",
        )


def _doubts_about_noise(result: ZeroResult) -> Iterator[Doubt]:
    noise = result.noise
    if not noise.converged:
        yield "The size of the noise did not settle; sigmas are a guess.", "Measure more poses."
    if noise.joint_rad > NOISIER * noise.joint_believed_rad:
        times = significant(noise.joint_rad / noise.joint_believed_rad)
        yield (
            f"The joints scatter {times} times as much as the rig file says.",
            "Let the arm settle longer before each sample, and check its brakes, gears and mounting.",
        )
    if noise.psd_m > NOISIER * noise.psd_believed_m:
        times = significant(noise.psd_m / noise.psd_believed_m)
        yield (
            f"The detectors scatter {times} times as much as stated.",
            "Keep daylight off the detectors, clean them, and run `calibeam psd-check`.",
        )
