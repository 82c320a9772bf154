"""Two calibrations of one arm: nothing moves against itself, a moved zero is found and no other, gauges never count."""

import re

import msgspec
import numpy as np
import pytest

from calibrate.errors import DataError
from calibrate.report.drift.drift_chapter import drift_chapter, sentence
from calibrate.report.drift.two_calibrations import Calibration, drift_of
from calibrate.report.evidence.session_evidence import session_evidence
from calibrate.report.session_report import session_answers
from calibrate.report.workspace.workspace_errors import session_arm

MOVED_RAD = 3.7e-4


@pytest.fixture(scope="module")
def now(arm_session):
    session = arm_session(70)
    recording = session.recording(session.positions())
    return session_evidence(recording, session.model(recording))


@pytest.fixture(scope="module")
def before(arm_session):
    """Last year: other poses, other noise, joint 3 not yet moved."""
    session = arm_session(70, seed=11, moved_rad=(0.0, 0.0, -MOVED_RAD, 0.0, 0.0, 0.0))
    recording = session.recording(session.positions())
    return Calibration("last year", session.model(recording), recording)


@pytest.fixture(scope="module")
def drift(now, before):
    return drift_of(Calibration("now", now.model, now.recording), before, session_arm(now))


def compared_with(now, model):
    return drift_of(Calibration("now", now.model), Calibration("then", model), "not asked for")


def changed(model, name, by, sigma=None):
    """The model with one correction off by so much."""
    parameters = tuple(
        msgspec.structs.replace(p, value=p.value + by, sigma=sigma or p.sigma) if p.name == name else p
        for p in model.parameters
    )
    return msgspec.structs.replace(model, parameters=parameters)


def test_a_calibration_has_not_moved_against_itself(now):
    same = drift_of(Calibration("now", now.model), Calibration("then", now.model), session_arm(now))
    assert same.found is False
    assert {c.change for c in same.compared.changes} == {0.0}
    assert same.tool is not None
    assert same.tool.largest_m == 0.0
    assert "no drift shows" in sentence(same)
    assert "<svg" not in drift_chapter(same)


def test_a_moved_zero_is_found_with_its_size_and_no_other(drift):
    (clear,) = drift.compared.significant
    assert clear.name == "joint3.zero"
    assert abs(clear.change - MOVED_RAD) < 3.0 * clear.sigma
    assert drift.compared.together.significant


def test_the_sentence_names_joint_size_uncertainty_and_what_the_tool_is_off(drift):
    lines = sentence(drift)
    number = re.search(r"joint 3 moved by (0\.\d+)° \(([\d.]+)\s?sigma\)", lines)
    assert number is not None, lines
    assert float(number[1]) == pytest.approx(np.degrees(MOVED_RAD), abs=0.005)
    assert re.search(r"tool error up to \d+", lines)


def test_the_tool_moves_by_the_lever_of_the_joint(drift):
    """Joint 3 of a UR5e turns less than 0.7 m of arm and tool; the other changes are noise of some 10 um."""
    assert MOVED_RAD * 0.3 < drift.tool.largest_m < MOVED_RAD * 0.75 + 2e-4
    assert drift.tool.largest_m > 3.0 * drift.tool.largest_sigma_m


def test_the_page_says_it_on_the_first_screen_and_in_a_chapter(now, drift):
    assert sentence(drift) == session_answers(now, drift).drift
    chapter = drift_chapter(drift)
    assert "<svg" in chapter
    assert "<b>changed</b>" in chapter
    assert f"{len(drift.compared.changes)} parameters are compared" in chapter
    assert "joints went through" in chapter


def test_where_base_and_target_stand_is_no_drift(now):
    gauges = [p for p in now.model.parameters if p.name.startswith(("device", "tool")) and p.value is not None]
    assert gauges
    moved = now.model
    for p in gauges:
        moved = changed(moved, p.name, 0.1)
    found = compared_with(now, moved).compared
    assert not found.significant
    assert {c.name.partition(".")[0].rstrip("0123456789") for c in found.changes} <= {"joint", "link"}


def test_a_drawing_that_took_up_the_correction_is_no_drift(now):
    parts = now.model.rig.text.split("theta_offset_rad = 0.0\n")
    drawn = "theta_offset_rad = 0.0\n".join(parts[:3]) + "theta_offset_rad = 0.002\n"
    drawn += "theta_offset_rad = 0.0\n".join(parts[3:])
    rig = msgspec.structs.replace(now.model.rig, text=drawn)
    then = changed(msgspec.structs.replace(now.model, rig=rig), "joint3.zero", -0.002)
    assert not compared_with(now, then).compared.significant
    assert compared_with(now, changed(now.model, "joint3.zero", -0.002)).compared.significant


def test_what_only_one_of_them_determines_is_left_out_with_the_reason(now):
    open_ = tuple(
        msgspec.structs.replace(p, value=None, sigma=None, undetermined="too few") if p.name == "joint3.zero" else p
        for p in now.model.parameters
    )
    found = compared_with(now, msgspec.structs.replace(now.model, parameters=open_)).compared
    assert "joint3.zero" not in {c.name for c in found.changes}
    assert dict(found.left_out)["joint3.zero"] == "determined only now"


def test_the_limit_grows_with_the_number_of_parameters_and_is_that_of_bonferroni(now):
    found = compared_with(now, now.model).compared
    few = tuple(p for p in now.model.parameters if p.name in ("joint2.zero", "joint3.zero"))
    two = compared_with(now, msgspec.structs.replace(now.model, parameters=few)).compared
    assert two.limit_sigmas == pytest.approx(2.807, abs=1e-3)  # 0.9975 of a normal law
    assert found.limit_sigmas > two.limit_sigmas


@pytest.mark.parametrize(("then", "warned"), [("A-1", False), ("B-2", True)])
def test_another_serial_number_is_a_plain_warning(now, then, warned):
    def with_serial(number):
        text = now.model.rig.text.replace("[arm]\n", f'[arm]\nserial_number = "{number}"\n', 1)
        return msgspec.structs.replace(now.model, rig=msgspec.structs.replace(now.model.rig, text=text))

    found = drift_of(Calibration("now", with_serial("A-1")), Calibration("then", with_serial(then)), "not asked for")
    assert any("A-1 now, B-2 then" in warning for warning in found.warnings) is warned


@pytest.mark.parametrize(("alarm", "warned"), [("NONE", False), ("ABOVE_STATED", True), ("BELOW_STATED", False)])
def test_a_model_that_leaves_more_than_noise_is_no_witness_of_drift(now, alarm, warned):
    then = msgspec.structs.replace(now.model, noise=now.model.noise | {"alarm": alarm})
    calm = msgspec.structs.replace(now.model, noise=now.model.noise | {"alarm": "NONE"})
    found = drift_of(Calibration("now", calm), Calibration("then", then), "not asked for")
    assert [w for w in found.warnings if "The model of then leaves more than noise" in w] == list(found.warnings)
    assert bool(found.warnings) is warned


def test_arms_that_cannot_be_compared_are_refused_with_the_reason(now):
    with pytest.raises(DataError, match="fitted as 'mdh', this one as 'dh'"):
        compared_with(now, msgspec.structs.replace(now.model, arm_model="mdh"))
    old = msgspec.structs.replace(now.model, rig=msgspec.structs.replace(now.model.rig, text=None))
    with pytest.raises(DataError, match="does not hold its rig file"):
        compared_with(now, old)
