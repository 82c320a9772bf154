"""The report of results that are not good: it says so, and shows no number that nobody may use."""

from dataclasses import replace

import numpy as np
import pytest

from acquisition.recording.recording import Recording
from calibeam.identification import Identified
from calibrate.errors import DataError
from calibrate.fit import Status
from calibrate.report.evidence import evidence
from calibrate.report.sections.centring import centring
from calibrate.report.sections.provenance import provenance
from calibrate.report.sections.summary import answers
from calibrate.report.sections.unseen import unseen
from calibrate.report.verdict import Trust, verdict
from calibrate.report.zero_report import ZeroSession, zero_page
from calibrate.zeros.result import JointZero, ZeroResult


def unknown(zero: JointZero) -> JointZero:
    return replace(zero, value_rad=None, sigma_rad=None, measurement_sigma_rad=None, why="the fit did not end")


def sound(result: ZeroResult) -> ZeroResult:
    """The same with every test passed, so that one failure at a time can be looked at."""
    assert result.held_out is not None
    assert result.repeats is not None
    noise = replace(
        result.noise,
        converged=True,
        joint_rad=result.noise.joint_believed_rad,
        psd_m=result.noise.psd_believed_m,
    )
    held_out, repeats = replace(result.held_out, chi_after=1.1), replace(result.repeats, lack_of_fit_p=0.4)
    return replace(result, noise=noise, held_out=held_out, repeats=repeats, status=Status.RANK_DEFICIENT)


def judged(recording: Recording, result: ZeroResult) -> tuple[Trust, str]:
    said = verdict(evidence(recording, result, "reported"))
    return said.trust, " ".join((said.sentence, *said.reasons))


def test_a_sound_result_is_trusted_without_a_reason_for_care(identified: Identified) -> None:
    said = verdict(evidence(identified.used, sound(identified.zeros), "reported"))
    assert (said.trust, said.reasons) == (Trust.GOOD, ())


def test_lack_of_fit_calls_for_care(identified: Identified) -> None:
    result = sound(identified.zeros)
    assert result.repeats is not None
    trust, said = judged(identified.used, replace(result, repeats=replace(result.repeats, lack_of_fit_p=1e-4)))
    assert trust is Trust.CARE
    assert "physics is missing" in said


def test_missed_unseen_poses_call_for_care(identified: Identified) -> None:
    result = sound(identified.zeros)
    assert result.held_out is not None
    trust, said = judged(identified.used, replace(result, held_out=replace(result.held_out, chi_after=4.0)))
    assert trust is Trust.CARE
    assert "4.00 times the noise" in said


def test_noise_far_above_the_believed_calls_for_care(identified: Identified) -> None:
    result = sound(identified.zeros)
    noisy = replace(result.noise, joint_rad=5.0 * result.noise.joint_believed_rad)
    assert "The joints scatter 5.00 times" in judged(identified.used, replace(result, noise=noisy))[1]


def test_a_recording_that_was_cut_short_calls_for_care(identified: Identified) -> None:
    trust, said = judged(replace(identified.used, complete=False), sound(identified.zeros))
    assert trust is Trust.CARE
    assert "cut short" in said


def test_as_many_unknowns_as_readings_is_no_trust(identified: Identified) -> None:
    trust, said = judged(identified.used, replace(sound(identified.zeros), spare=2.0))
    assert trust is Trust.NONE
    assert "as many unknowns as readings" in said


@pytest.mark.parametrize("status", [Status.NOT_FINITE, Status.OUT_OF_STEPS, Status.STALLED])
def test_a_fit_that_did_not_end_is_no_result(identified: Identified, status: Status) -> None:
    result = replace(identified.zeros, status=status, zeros=tuple(unknown(z) for z in identified.zeros.zeros))
    trust, said = judged(identified.used, result)
    assert trust is Trust.NONE
    assert status.value in said


def test_a_fit_without_a_finite_number_still_gives_a_report(identified: Identified) -> None:
    result = identified.zeros
    lost = replace(
        result,
        status=Status.NOT_FINITE,
        zeros=tuple(unknown(z) for z in result.zeros),
        theta=np.full_like(result.theta, np.nan),
        covariance=np.full_like(result.covariance, np.nan),
        residual_after_m=np.full_like(result.residual_after_m, np.nan),
        rms_after_m=float("nan"),
        repeats=None,
        held_out=None,
    )
    known = evidence(identified.used, lost, "reported")
    page = zero_page(ZeroSession(known, why_no_point_constraint="nothing was centred"))
    assert "There is no finite fit to judge" in page
    assert 'href="#proofs"' not in page
    assert "Not done: nothing was centred." in page
    assert ">nan" not in page


def test_a_recording_without_centring_and_origin_says_so(identified: Identified) -> None:
    bare = replace(identified.used, events=(), notes={}, software="", host="", started_utc="")
    assert "The recording holds no centring run." in centring(evidence(bare, identified.zeros, "reported"))
    assert provenance(bare, 9, "with both spots", "calibeam").count("not stated") >= 2


def test_a_zero_that_the_drawing_limits_is_told_from_one_that_the_measurement_limits(identified: Identified) -> None:
    zeros = tuple(
        replace(z, value_rad=0.01, sigma_rad=5e-4, measurement_sigma_rad=1e-6) if z.joint == 4 else unknown(z)
        for z in identified.zeros.zeros
    )
    known = evidence(identified.used, replace(identified.zeros, zeros=zeros), "reported")
    assert any("limited by the drawing's tolerance" in said for said in answers(known).known)
    assert "more poses will not better it" in unseen(known)


def test_notes_of_the_recording_are_text(identified: Identified) -> None:
    noted = replace(identified.used, notes={"<b>plan": "<img src=x>"})
    page = provenance(noted, 9, "with both spots", "calibeam")
    assert "&lt;b&gt;plan" in page
    assert "<img" not in page


def test_the_result_of_another_recording_is_refused(identified: Identified) -> None:
    half = replace(identified.used, samples=identified.used.samples.take(np.arange(10)))
    with pytest.raises(DataError, match=r"the result is of \d+ poses, .* has 10"):
        evidence(half, identified.zeros, "reported")


def test_the_result_of_another_rig_is_refused(identified: Identified) -> None:
    result = identified.zeros
    other = replace(result, parameters=(replace(result.parameters[0], name="joint9.zero"), *result.parameters[1:]))
    with pytest.raises(DataError, match="other parameters than the rig"):
        evidence(identified.used, other, "reported")
