"""Forms for controllers and for MuJoCo: zeros in the robot's signs, stiffness that sags, makes that do not fit."""

import csv
import json
import math

import mujoco
import numpy as np
import pytest

from acquisition.recording import Samples
from acquisition.recording.rig import parse_rig
from calibeam.cli import run
from calibrate.apply.export.export import export_model, form_named
from calibrate.apply.export.robot_description import SPRING
from calibrate.apply.predicting import flange_with_physics
from calibrate.model.effect_records import EffectParameter, EffectRecord, SessionRecord
from calibrate.model.model_file import (
    Covariance,
    ModelParameter,
    RigIdentity,
    write_model,
)
from tests.calibrate.apply.correct.six_joints import CHAIN, RIG, model, postures
from tests.calibrate.model.with_effects.two_joints import two_joints

COMPLIANCE_RAD_NM = 2e-5
Q = postures(6)


def of_make(make, text=RIG, **changes):
    return model(rig=RigIdentity("irb120", "0" * 64, text.replace("[arm]", f'[arm]\nmake = "{make}"')), **changes)


def soft(joint):
    """A joint that yields in proportion to its torque, found in a session over the whole range."""
    name = f"joint{joint}-compliance"
    effect = EffectRecord(
        name=name,
        where=f"joint{joint}.angle",
        physics="joint-compliance",
        depends_on=f"gravity_torque{joint}",
        shape="linear",
        order=None,
        variant="",
        parameters={"compliance_rad_nm": EffectParameter(COMPLIANCE_RAD_NM, 1e-7, "rad_nm")},
        coefficients={f"{name}.c0": COMPLIANCE_RAD_NM},
        inner={},
        about={},
        holds="always",
        range={},
    )
    table = postures(20, seed=4)
    conditions = {f"q{j + 1}_rad": tuple(table[:, j].tolist()) for j in range(6)} | {
        "t_s": tuple(map(float, range(20)))
    }
    return effect, SessionRecord("", 0.0, 19.0, "0" * 64, conditions)


def mujoco_flange(text, q_rad, springs=()):
    """(4, 4) of the flange body with drives held at readings (joint,) and every spring in balance with the weight."""
    arm = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(arm)
    for j, q in enumerate(q_rad, start=1):
        data.qpos[arm.joint(f"joint{j}").qposadr[0]] = q
    for _ in range(30):
        mujoco.mj_forward(arm, data)
        for name in springs:
            joint = arm.joint(name)
            data.qpos[joint.qposadr[0]] = -data.qfrc_bias[joint.dofadr[0]] / joint.stiffness[0]
    mujoco.mj_forward(arm, data)
    T = np.eye(4)
    T[:3, 3], T[:3, :3] = data.body("flange").xpos, data.body("flange").xmat.reshape(3, 3)
    return T


def exported(tmp_path, known, form):
    path = tmp_path / "arm"
    lost = export_model(path, parse_rig(known.rig.text, "rig.toml"), known, form)
    return path.read_text(encoding="utf-8"), lost


def samples(q):
    return Samples({"t_s": np.arange(len(q), dtype=float)} | {f"q{j + 1}_rad": q[:, j] for j in range(q.shape[1])}, 6)


def test_mujoco_stands_where_the_model_has_the_flange(tmp_path):
    known = model()
    text, _ = exported(tmp_path, known, form_named("mjcf"))
    for q, T in zip(Q, flange_with_physics(known, samples(Q))[0], strict=True):
        np.testing.assert_allclose(mujoco_flange(text, q), T, atol=1e-9)


LEANING = RIG.replace("gravity_m_s2 = [0, 0, -9.81]", "gravity_m_s2 = [3.0, -2.0, -9.0]")  # joint 1 carries, too


@pytest.mark.parametrize(("joint", "text"), [(2, RIG), (3, RIG), (1, LEANING), (3, LEANING)])
def test_mujoco_sags_as_the_model_does(tmp_path, joint, text):
    effect, session = soft(joint)
    rig = RigIdentity("irb120", "0" * 64, text)
    known = model(schema=2, effects=(effect,), session=session, covariance=Covariance((), ()), instruments=(), rig=rig)
    text, lost = exported(tmp_path, known, form_named("mjcf"))
    assert f"carried: {effect.name}" in lost
    assert not [says for says in lost if says.startswith("not carried")]
    stiff = model(rig=rig)
    soft_m, stiff_m = (flange_with_physics(m, samples(Q))[0][:, :3, 3] for m in (known, stiff))
    assert np.max(np.linalg.norm(soft_m - stiff_m, axis=1)) > 5e-6
    for q, there_m in zip(Q, soft_m, strict=True):
        sagged = mujoco_flange(text, q, [f"joint{joint}{SPRING}"])
        assert np.linalg.norm(sagged[:3, 3] - there_m) < 1e-9
    with pytest.raises(KeyError):
        mujoco.MjModel.from_xml_string(exported(tmp_path, stiff, form_named("mjcf"))[0]).joint(f"joint{joint}{SPRING}")


def test_what_a_spring_cannot_be_is_not_carried(tmp_path):
    known = two_joints()
    text, lost = exported(tmp_path, known, form_named("mjcf"))
    assert "not carried: joint1-backlash: 250.0 µm rms, at most 250.0 µm" in lost
    assert SPRING not in text


PARAMETERS = tuple(
    ModelParameter(f"joint{j}.zero", "rad", value, sigma, reason)
    for j, value, sigma, reason in (
        (1, None, None, "seen only together with the base"),
        (2, CHAIN["joint2.zero"], 1e-4, None),
        (3, CHAIN["joint3.zero"], 1e-4, None),
        (4, 1e-5, 1e-4, None),
        (5, CHAIN["joint5.zero"], 1e-4, None),
        (6, None, None, "seen only together with the tool"),
    )
)


def table_of(text):
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


@pytest.mark.parametrize(("form", "make", "axis"), [("kuka-mastering", "kuka", "A"), ("fanuc-mastering", "fanuc", "J")])
def test_offsets_are_degrees_in_the_robots_signs_and_only_what_is_known(tmp_path, form, make, axis):
    text, lost = exported(tmp_path, of_make(make, parameters=PARAMETERS), form_named(form))
    rows = table_of(text)
    assert [row["axis"] for row in rows] == [f"{axis}{j}" for j in range(1, 7)]
    given = {row["axis"]: row["offset_deg"] for row in rows if row["offset_deg"]}
    assert given == {
        f"{axis}{j}": f"{math.degrees(CHAIN[f'joint{j}.zero']):.4f}" for j in (2, 3, 5)
    }  # 1e-4 rad: 0.0057 deg
    assert rows[1]["sigma_deg"] == "0.0057"
    assert [row["not_entered_because"] for row in rows] == [
        "not determined: seen only together with the base",
        "",
        "",
        "less than 2 sigma",
        "",
        "not determined: seen only together with the tool",
    ]
    assert lost[0].startswith("not carried: lengths and axes")
    assert lost[0] in text
    assert "# true angle = reading + offset, in the robot's own signs" in text.splitlines()


def test_offsets_alone_leave_what_lengths_and_axes_move_the_tip(tmp_path):
    """A model of lengths only gains nothing; of zeros only there is no better model, but the measured points."""
    zeros = {name: v for name, v in CHAIN.items() if name.endswith(".zero")}
    misses = {"rms_distance_before_m": 9.4e-4, "rms_distance_after_m": 5.1e-4}
    lengths = {"link2.length": 8e-4}
    (whole,) = exported(tmp_path, of_make("kuka", chain=zeros, **misses), form_named("kuka-mastering"))[1]
    none, _ = exported(tmp_path, of_make("kuka", chain=lengths), form_named("kuka-mastering"))[1]
    assert "at the measured points: 510\N{NO-BREAK SPACE}µm rms; nominal arm 940\N{NO-BREAK SPACE}µm" in whole
    alone, without = (part.split("µm rms")[0].split()[-1] for part in none.split(";")[1:])
    assert float(alone) == float(without) > 50.0


def test_a_table_without_an_offset_says_how_to_get_one(tmp_path):
    """Beside a link that was found, no zero is; with the links held none is only because none is off."""
    no_zero = tuple(ModelParameter(f"joint{j}.zero", "rad", None, None, "seen only with link 1") for j in range(1, 7))
    link = ModelParameter("link2.length", "m", 1e-4, 1e-5, None)
    text, lost = exported(tmp_path, of_make("kuka", parameters=(*no_zero, link)), form_named("kuka-mastering"))
    assert lost[-1].startswith("every offset is empty")
    assert "--zeros-only" in lost[-1]
    assert lost[-1] in text
    held = of_make("kuka", parameters=no_zero, chain={})
    assert not any("every offset" in says for says in exported(tmp_path, held, form_named("kuka-mastering"))[1])


def test_motor_angles_are_those_of_the_gear(tmp_path):
    geared = RIG.replace("[[arm.joint]]", "[[arm.joint]]\ngear_ratio = 100.0")
    rows = table_of(exported(tmp_path, of_make("abb", geared, parameters=PARAMETERS), form_named("abb-moc"))[0])
    assert rows[1]["motor_rad"] == "0.200"  # 2 mrad at the axis, and its sigma 0.1 mrad: 0.010 rad at the motor
    assert rows[3]["motor_rad"] == ""


@pytest.mark.parametrize(
    ("make", "form", "says"),
    [
        ("kuka", "ur-calibration", "ur-calibration is for arms of make 'ur', and the make of this one is 'kuka'"),
        ("ur", "kuka-mastering", "for arms of make 'kuka'"),
        ("rob", "json", "make"),
    ],
)
def test_a_form_that_does_not_suit_the_arm_is_refused(tmp_path, capsys, make, form, says):
    path = tmp_path / "model.json"
    write_model(path, of_make(make))
    assert run(["export-model", str(path), "--to", form]) == 1
    assert says in " ".join(capsys.readouterr().err.split())
    assert [p.name for p in tmp_path.iterdir()] == ["model.json"]


def test_a_make_that_is_not_stated_is_asked_for(tmp_path, capsys):
    write_model(tmp_path / "model.json", model())
    assert run(["export-model", str(tmp_path / "model.json"), "--to", "fanuc-mastering"]) == 1
    assert 'state make = "fanuc" under [arm]' in " ".join(capsys.readouterr().err.split())


def test_the_command_writes_next_to_the_model(tmp_path, capsys):
    write_model(tmp_path / "model.json", model())
    assert run(["export-model", str(tmp_path / "model.json"), "--to", "json"]) == 0
    assert "json: " in capsys.readouterr().out
    assert json.loads((tmp_path / "model.arm.json").read_text())["name"] == parse_rig(RIG, "rig.toml").name
