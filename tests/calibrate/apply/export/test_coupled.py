"""Arms whose controller couples joints: exports by physical angles, mastering in the robot's own readings."""

import csv
import json
import math

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from acquisition.recording.rig import parse_rig, rig_text
from calibeam.commands.rig import shipped_rigs
from calibrate.apply.export.export import export_model, export_text, form_named
from calibrate.errors import DataError
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.coupled_readings import by_reading
from calibrate.model.model_file import Covariance, ModelParameter, RigIdentity
from calibrate.model.parameters import values_by_name
from tests.calibrate.apply.correct.six_joints import model
from tests.calibrate.apply.export import test_export

TEXT = rig_text(shipped_rigs()["fanuc-lrmate-200id"])
FANUC = parse_rig(TEXT, "rig.toml")
AGAINST = parse_rig(TEXT.replace("by = 1.0", "by = -1.0"), "rig.toml")  # a coupling the other way
Q = np.random.default_rng(9).uniform(-1.5, 1.5, (20, 6))  # readings
ZEROS = {f"joint{j}.zero": 1e-3 * value for j, value in enumerate((0.4, 1.5, -0.8, 0.5, 2.0, -0.3), start=1)}


def errors_of(rig):
    rng = np.random.default_rng(3)
    return {p.name: float(rng.normal(0, 1e-3)) for p in arm_of(rig).parameters}


def flange(rig, corrections, q=Q):
    arm = arm_of(rig)
    return arm.flange(values_by_name(arm.parameters, corrections), q)


def in_mujoco(text, angles):
    arm = mujoco.MjModel.from_xml_string(text)
    data, out = mujoco.MjData(arm), []
    for row in angles:
        data.qpos[:6] = row
        mujoco.mj_kinematics(arm, data)
        T = np.eye(4)
        T[:3, 3], T[:3, :3] = data.body("flange").xpos, data.body("flange").xmat.reshape(3, 3)
        out.append(T)
    return np.array(out)


@pytest.mark.parametrize("rig", [FANUC, AGAINST], ids=["by 1", "by -1"])
@pytest.mark.parametrize("form", ["urdf", "dh-csv", "json", "matlab", "mjcf"])
def test_a_file_read_back_at_physical_angles_stands_where_the_readings_put_the_arm(rig, form, monkeypatch):
    wrong = errors_of(rig)
    text = export_text(rig, wrong, form_named(form))
    by = rig.arm.joints[2].follows.by
    angles = Q.copy()
    angles[:, 2] += by * Q[:, 1]  # as the file says
    assert f"joint 3 = reading 3 {'+' if by > 0 else '-'} reading 2" in text
    monkeypatch.setattr(test_export, "Q", angles)
    there = in_mujoco(text, angles) if form == "mjcf" else test_export.READERS[form_named(form)](text)
    np.testing.assert_allclose(there, flange(rig, wrong), atol=1e-9)
    assert np.max(np.abs(np.array(there) - flange(rig, wrong, angles))) > 0.1  # the readings are other angles


@pytest.mark.parametrize(("rig", "by"), [(FANUC, 1.0), (AGAINST, -1.0)])
def test_limits_are_those_of_the_angle(rig, by):
    two, three = rig.arm.joints[1], rig.arm.joints[2]
    low, high = json.loads(export_text(rig, {}, form_named("json")))["joints"][2].values()
    other = (two.lower_rad, two.upper_rad) if by > 0 else (-two.upper_rad, -two.lower_rad)
    assert (low, high) == pytest.approx((three.lower_rad + other[0], three.upper_rad + other[1]))


def test_the_json_has_the_matrix_from_readings_to_angles():
    content = json.loads(export_text(FANUC, {}, form_named("json")))
    assert np.array_equal(content["angles_by_readings"], by_reading(FANUC.arm))


def known(rig, text, sigma=1e-4, correlation=0.0):
    names = tuple(ZEROS)
    rows = np.diag(np.full(6, sigma**2))
    rows[1, 2] = rows[2, 1] = correlation * sigma**2
    parameters = tuple(ModelParameter(name, "rad", value, sigma, None) for name, value in ZEROS.items())
    return model(
        rig=RigIdentity(rig.name, "0" * 64, text), arm_model=rig.arm.model.value, chain=ZEROS, parameters=parameters,
        covariance=Covariance(names, tuple(map(tuple, rows.tolist()))),
    )  # fmt: skip


def table_of(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


@pytest.mark.parametrize("by", [1.0, -1.0])
def test_mastered_by_these_offsets_the_controller_reads_where_the_arm_stands(tmp_path, by):
    """An arm as drawn at readings with the offsets added stands where the model has the arm at the readings."""
    text = TEXT.replace("by = 1.0", f"by = {by}")
    rig = parse_rig(text, "rig.toml")
    export_model(tmp_path / "x", rig, known(rig, text, 1e-10), form_named("fanuc-mastering"))
    offsets = np.radians([float(row["offset_deg"]) for row in table_of(tmp_path / "x")])
    np.testing.assert_allclose(flange(rig, {}, Q + offsets), flange(rig, ZEROS), atol=1e-11)
    assert offsets[2] == pytest.approx(ZEROS["joint3.zero"] - by * ZEROS["joint2.zero"], abs=1e-11)
    assert np.max(np.abs(flange(rig, {}, Q + list(ZEROS.values())) - flange(rig, ZEROS))) > 1e-4  # zeros alone do not


@pytest.mark.parametrize(("correlation", "shares"), [(0.0, math.sqrt(2.0)), (0.9, math.sqrt(0.2))])
def test_sigma_of_a_coupled_offset_has_both_zeros_and_their_correlation(tmp_path, correlation, shares):
    export_model(tmp_path / "x", FANUC, known(FANUC, TEXT, 1e-4, correlation), form_named("fanuc-mastering"))
    sigma = np.radians([float(row["sigma_deg"]) for row in table_of(tmp_path / "x")])
    assert sigma == pytest.approx([1e-4, 1e-4, shares * 1e-4, 1e-4, 1e-4, 1e-4], rel=0.02)  # two digits


def test_an_offset_of_a_zero_that_is_not_determined_is_not_either(tmp_path):
    found = known(FANUC, TEXT)
    open_ = ModelParameter("joint2.zero", "rad", None, None, "seen only together with joint 3")
    parameters = tuple(open_ if p.name == open_.name else p for p in found.parameters)
    export_model(tmp_path / "x", FANUC, replace(found, parameters=parameters), form_named("fanuc-mastering"))
    why = [row["not_entered_because"] for row in table_of(tmp_path / "x")]
    assert [bool(one) for one in why] == [False, True, True, False, False, False]


@pytest.mark.parametrize(("form", "make"), [("ur-calibration", "ur"), ("ur-kinematics", "ur"), ("abb-moc", "abb")])
def test_what_a_form_cannot_carry_is_refused_with_the_reason(tmp_path, form, make):
    text = TEXT.replace('make = "fanuc"', f'make = "{make}"')
    rig = parse_rig(text, "rig.toml")
    with pytest.raises(DataError, match="joint 3 follows another joint, and"):
        export_model(tmp_path / "x", rig, known(rig, text), form_named(form))
    assert not list(tmp_path.iterdir())
