"""The table nominal, correction, calibrated: an arm of its calibrated numbers is the identified one."""

import csv
import json

import numpy as np
import pytest
from msgspec.structs import replace
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import ArmModel, parse_rig, rig_text
from calibeam.cli import run
from calibeam.commands.rig import shipped_rigs
from calibrate.apply.export.export import export_model, form_named
from calibrate.apply.export.identified import identified_arm
from calibrate.apply.export.nominal_table import nominal_table
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.convert import convert
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.model_file import ModelParameter, RigIdentity, write_model
from tests.calibrate.apply.correct.six_joints import RIG, model, postures

IRB = parse_rig(RIG, "rig.toml")
FANUC_TEXT = rig_text(shipped_rigs()["fanuc-lrmate-200id"])
KUKA = parse_rig(rig_text(shipped_rigs()["kuka-kr6-r900"]), "rig.toml")
Q = postures(8)


def stated(rig, *, without=()):
    """A value for every parameter of the arm but those of `without`, which have a reason."""
    rng = np.random.default_rng(5)
    return tuple(
        ModelParameter(p.name, p.unit, None, None, "seen only together with the base")
        if p.name.endswith(tuple(without)) or p.name in without
        else ModelParameter(p.name, p.unit, float(rng.normal(0.0, 1e-3)), 1e-5, None)
        for p in arm_of(rig).parameters
    )


def table(rig, parameters):
    values = {p.name: p.value for p in parameters if p.value is not None}
    arm = identified_arm(rig, values, stated=parameters)
    return {row.parameter: row for row in nominal_table(arm)}, RigArm.of_rig(rig, values)


@pytest.mark.parametrize("drawn_as", ["dh", "mdh"])
def test_a_dh_table_of_the_calibrated_numbers_is_the_identified_arm(drawn_as):
    rig = IRB if drawn_as == "dh" else replace(IRB, arm=convert(IRB.arm, ArmModel.MDH).arm)
    rows, real = table(rig, stated(rig, without=(".tilt",)))
    before = 1 if drawn_as == "mdh" else 0
    joints = tuple(
        replace(
            joint,
            theta_offset_rad=float(np.radians(rows[f"J{i}"].calibrated)),
            d_m=1e-3 * rows[f"link{i}.offset"].calibrated,
            a_m=1e-3 * rows[f"link{i - before}.length"].calibrated,
            alpha_rad=float(np.radians(rows[f"link{i - before}.twist"].calibrated)),
        )
        for i, joint in enumerate(rig.arm.joints, start=1)
    )
    again = RigArm.of_rig(replace(rig, arm=replace(rig.arm, joints=joints)))
    np.testing.assert_allclose(again.frames(Q)[:, -1], real.frames(Q)[:, -1], atol=1e-12)


def test_axes_of_a_local_poe_arm_are_moved_by_the_calibrated_numbers():
    rows, real = table(KUKA, stated(KUKA, without=(".roll", ".pitch", ".yaw")))
    joints = []
    for i, joint in enumerate(KUKA.arm.joints):
        turn = Rotation.from_rotvec(joint.rotation_rad)
        there = turn.apply([1e-3 * rows[f"link{i}.{axis}"].calibrated for axis in "xyz"])
        joints.append(replace(joint, origin_m=tuple(there.tolist())))
    flange = KUKA.arm.flange
    at = Rotation.from_rotvec(flange.rotation_rad).apply([1e-3 * rows[f"link6.{axis}"].calibrated for axis in "xyz"])
    arm = replace(KUKA.arm, joints=tuple(joints), flange=replace(flange, origin_m=tuple(at.tolist())))
    zeros = np.radians([rows[f"A{j}"].calibrated for j in range(1, 7)])  # a KUKA has A1 ... A6
    again = RigArm.of_rig(replace(KUKA, arm=arm))
    np.testing.assert_allclose(again.frames(Q + zeros)[:, -1], real.frames(Q)[:, -1], atol=1e-12)


def test_axes_of_a_coupled_arm_are_in_its_readings():
    rig = parse_rig(FANUC_TEXT, "rig.toml")
    parameters = tuple(p for p in stated(rig) if p.name.endswith(".zero"))
    rows, real = table(rig, parameters)
    zeros = np.radians([rows[f"J{j}"].correction for j in range(1, 7)])
    np.testing.assert_allclose(RigArm.of_rig(rig).frames(Q + zeros)[:, -1], real.frames(Q)[:, -1], atol=1e-12)


def test_what_is_not_determined_has_its_drawn_number_and_the_reason():
    rows, _ = table(IRB, stated(IRB, without=("joint1.zero", "link2.tilt")))
    for name in ("J1", "link2.tilt"):
        row = rows[name]
        assert (row.correction, row.sigma, row.calibrated) == (None, None, None)
        assert row.why == "seen only together with the base"
    assert rows["J2"].nominal == pytest.approx(np.degrees(IRB.arm.joints[1].theta_offset_rad or 0.0))
    assert rows["J2"].sigma == pytest.approx(np.degrees(1e-5))


def test_the_file_and_the_json_hold_the_same_rows(tmp_path):
    parameters = stated(IRB, without=("joint1.zero",))
    chain = {p.name: p.value for p in parameters if p.value is not None}
    known = model(rig=RigIdentity("irb120", "0" * 64, RIG), parameters=parameters, chain=chain, covariance=None)
    export_model(tmp_path / "arm.json", IRB, known, form_named("json"))
    in_json = json.loads((tmp_path / "arm.json").read_text())["table"]
    write_model(tmp_path / "model.json", known)
    assert run(["export-model", str(tmp_path / "model.json"), "--to", "table"]) == 0
    lines = (tmp_path / "model.table.csv").read_text(encoding="utf-8").splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert [row["parameter"] for row in rows] == [row["parameter"] for row in in_json]
    assert {row["sigma"] for row in rows if row["unit"] == "deg"} == {"", "0.00057"}  # 10 µrad
    for row, same in zip(rows, in_json, strict=True):
        for name in ("nominal", "correction", "sigma", "calibrated"):
            shown, behind = row[name], len(row[name].partition(".")[2])  # two digits of sigma; the JSON has them all
            assert (
                shown == ""
                if same[name] is None
                else float(shown) == pytest.approx(same[name], abs=0.51 * 10.0**-behind)
            )
        assert row["not_determined_because"] == same["why"]
