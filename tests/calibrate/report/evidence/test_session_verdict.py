"""The first sentence: trust where all is well, care with reason and advice, no trust where nothing is gained."""

import re
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from acquisition.recording.rig import parse_rig
from calibrate.diagnose.record.schema import DiagnosisFile, FindingRecord, SplitRecord
from calibrate.report.elements.verdict import Trust
from calibrate.report.evidence.session_evidence import session_evidence
from calibrate.report.evidence.session_verdict import session_verdict


@pytest.fixture(scope="module")
def healthy(arm_session):
    session = arm_session(120)
    recording = session.recording(session.positions())
    return session_evidence(recording, session.model(recording))


def changed(evidence, **fields):
    return replace(evidence, model=msgspec.structs.replace(evidence.model, **fields))


def test_a_healthy_session_is_trusted_and_said_in_one_sentence(healthy):
    judged = session_verdict(healthy)
    assert (judged.trust, judged.reasons) == (Trust.GOOD, ())
    proof = healthy.model.proofs[0]
    assert f"{1e6 * proof.rms_distance_after_m:.1f}" in judged.sentence
    assert "What remains is noise" in judged.sentence
    assert judged.advice


def test_physics_that_the_model_lacks_is_seen_along_its_joint(arm_session):
    session = arm_session(150)
    columns = session.positions()
    columns["z_m"] = columns["z_m"] + 2e-4 * np.sin(6.0 * session.q_rad[:, 1])
    recording = session.recording(columns)
    judged = session_verdict(session_evidence(recording, session.model(recording)))
    said = " ".join(judged.reasons)
    assert judged.trust is Trust.CARE
    assert "follows J2" in said
    assert "times the assumed noise" in said
    assert any("missing physics" in do for do in judged.advice)


def test_noise_below_the_stated_is_advice_and_no_uncertainty(healthy):
    noise = healthy.model.noise | {"chi2_stated": 80.0, "dof": 300, "alarm": "BELOW_STATED"}
    judged = session_verdict(changed(healthy, noise=noise))
    assert judged.trust is Trust.GOOD
    assert any("0.516 times" in do for do in judged.advice)


def test_unseen_rows_far_beyond_the_noise_call_for_care(healthy):
    far = tuple(msgspec.structs.replace(p, chi_after=4.0, chi_predicted=3.0) for p in healthy.model.proofs)
    judged = session_verdict(changed(healthy, proofs=far))
    assert judged.trust is Trust.CARE
    assert "3.00 times what noise and sigmas predict" in judged.reasons[0]


def test_unseen_rows_that_lie_at_another_place_call_for_care_even_if_their_misfit_was_to_be_expected(healthy):
    """Such as the last block of a session, in postures of its own: missed by four times the noise, as predicted."""
    far = tuple(msgspec.structs.replace(p, chi_after=4.0, chi_predicted=1.0) for p in healthy.model.proofs)
    judged = session_verdict(changed(healthy, proofs=far))
    assert judged.trust is Trust.CARE
    assert "4.00 times the noise (1.00 times what noise and sigmas predict)" in judged.reasons[0]
    near = tuple(msgspec.structs.replace(p, chi_after=1.4, chi_predicted=1.0) for p in healthy.model.proofs)
    assert session_verdict(changed(healthy, proofs=near)).trust is Trust.GOOD


def test_an_arm_no_better_than_its_drawing_is_not_to_be_used(healthy):
    same = tuple(msgspec.structs.replace(p, rms_distance_after_m=p.rms_distance_before_m) for p in healthy.model.proofs)
    judged = session_verdict(changed(healthy, proofs=same))
    assert judged.trust is Trust.NONE
    assert "Do not use this model" in judged.sentence


def test_a_fit_that_did_not_end_is_no_model(healthy):
    judged = session_verdict(changed(healthy, status="STALLED", says="it stood still"))
    assert judged.trust is Trust.NONE
    assert judged.sentence == "No usable model: it stood still."


def test_without_a_proof_there_is_no_trust_and_the_sentence_states_what_it_was_fitted_to(healthy):
    judged = session_verdict(changed(healthy, proofs=(), held_out=None))
    assert judged.trust is Trust.NONE
    assert "it was fitted to" in judged.sentence
    assert "no proof on unseen rows" in judged.reasons[0]


def test_a_model_of_a_diagnosis_is_trusted_as_any_other(arm_session):
    session = arm_session(120)
    recording = session.recording(session.positions())
    judged = session_verdict(session_evidence(recording, session.model_of_diagnosis(recording)))
    assert (judged.trust, judged.reasons) == (Trust.GOOD, ())


def test_physics_that_a_diagnosis_found_calls_for_care_only_where_the_model_is_not_of_a_diagnosis(healthy, arm_session):
    found = DiagnosisFile(1, "mismatch", 1e-5, 1e-4, 1e-5, (), None, ())
    assert session_verdict(healthy, found).trust is Trust.CARE
    session = arm_session(120)
    recording = session.recording(session.positions())
    with_physics = session_evidence(recording, session.model_of_diagnosis(recording))
    assert session_verdict(with_physics, found).trust is Trust.GOOD


@pytest.mark.parametrize(("removed", "recommended"), [((0.3, 0.5), True), ((-0.5, -0.3), False)])
def test_a_model_with_physics_is_recommended_where_it_would_replace_geometry(healthy, removed, recommended):
    name = ("joint2.angle", "tau2", "linear", None, "joint-compliance")
    cause = FindingRecord(*name, {}, 30.0, 0.9, "", (), 1e-3, 20.0, 20.0)
    split = SplitRecord("random", "position", 20, 0, 1e-4, 5e-5, *removed)
    found = DiagnosisFile(1, "mismatch", 1e-5, 1e-4, 1e-5, (cause,), None, (), splits=(split,))
    advice = session_verdict(healthy, found).advice
    assert any("--model-out" in one for one in advice) is recommended


def test_the_one_noisy_source_of_several_is_named(healthy):
    noise = healthy.model.noise | {"wire_believed": 1e-5, "wire": 1e-4, "wire_sigma": 1e-5}
    judged = session_verdict(changed(healthy, noise=noise))
    assert "The noise of wire is 10.0 times the assumed one." in judged.reasons


def test_a_recording_that_was_cut_short_calls_for_care(healthy):
    judged = session_verdict(replace(healthy, recording=replace(healthy.recording, complete=False)))
    assert judged.trust is Trust.CARE
    assert "cut short" in judged.reasons[0]


@pytest.mark.parametrize(("poses", "tolerance"), [(8, True), (9, False), (10, False)])
def test_as_many_unknowns_as_readings_is_no_trust_whatever_the_fit_says(arm_session, poses, tolerance):
    session = arm_session(poses)
    recording = session.recording(session.positions())
    if not tolerance:  # 27 unknowns that 27 or 30 equations have to find
        text = re.sub(r"\[tolerance\]\n(\w.*\n)+", "", recording.rig_text)
        recording = replace(recording, rig_text=text, rig=parse_rig(text, "rig"))
        assert recording.rig.tolerance is None
    judged = session_verdict(session_evidence(recording, session.model(recording)))
    assert judged.trust is Trust.NONE
    assert judged.sentence.startswith("There are as many unknowns as readings, or nearly so")
    assert any("at least 15, better 50" in do for do in judged.advice)


def test_readings_to_spare_are_counted_without_the_rows_of_the_tolerance(healthy):
    model = healthy.model
    assert healthy.spare < 3 * len(healthy.rows)
    assert healthy.spare == pytest.approx(3 * len(healthy.rows) - 30, abs=6.0)  # 27 of a UR5e, and what priors leave
    assert healthy.spare < model.noise["dof"]
