"""Every exported file, read back by a few lines of this test, gives the flange poses of the identified arm."""

import csv
import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import msgspec
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import ArmModel, Rig, load_rig
from calibrate.apply.export.export import FORMS, export_text, form_named
from calibrate.errors import DataError
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.convert import convert
from calibrate.model.parameters import values_by_name

RIGS = Path(__file__).parents[4] / "rigs"
UR5E = load_rig(RIGS / "ur5e-dual-psd.toml")
CMM = load_rig(RIGS / "arm-cmm-reference.toml")
ARMS = {"ur5e": UR5E, "ur5e by craig": Rig(1, "mdh", convert(UR5E.arm, ArmModel.MDH).arm), "arm-cmm": CMM}
Q = np.random.default_rng(9).uniform(-3, 3, (20, 6))


@pytest.fixture(params=list(ARMS), ids=list(ARMS))
def rig(request):
    return ARMS[request.param]


def errors_of(rig):
    rng = np.random.default_rng(3)
    return {p.name: float(rng.normal(0, 1e-3)) for p in arm_of(rig).parameters}


def flange(rig, corrections):
    arm = arm_of(rig)
    return arm.flange(values_by_name(arm.parameters, corrections), Q)


def frame(origin, rotation):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation.as_matrix(), origin
    return T


def turn(axis, angle):
    return frame([0, 0, 0], Rotation.from_euler(axis, angle))


def chain(parts):
    out = []
    for q in Q:
        T = parts[0]
        for angle, part in zip(q, parts[1:], strict=True):
            T = T @ turn("z", angle) @ part
        out.append(T)
    return out


def table(base, rows, last):
    """Rows: theta offset, d, a, alpha, tilt."""
    return chain(
        [base @ turn("z", rows[0][0])]
        + [
            frame([a, 0, d], Rotation.identity()) @ turn("x", alpha) @ turn("y", tilt) @ behind
            for (_, d, a, alpha, tilt), behind in zip(rows, [*(turn("z", r[0]) for r in rows[1:]), last], strict=True)
        ]
    )


def read_urdf(text):
    joints = {j.get("name"): j.find("origin") for j in ET.fromstring(text).iter("joint")}
    numbers = {k: [[float(v) for v in o.get(w).split()] for w in ("xyz", "rpy")] for k, o in joints.items()}
    names = [*(f"joint{i}" for i in range(1, 7)), "flange_fixed"]
    return chain([frame(xyz, Rotation.from_euler("xyz", rpy)) for xyz, rpy in (numbers[k] for k in names)])


def read_csv(text):
    base, *rows, last = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    cells = [[float(r[k]) for k in ("theta_offset_rad", "d_m", "a_m", "alpha_rad", "tilt_rad")] for r in rows]
    ends = [
        frame(
            [float(r[k]) for k in ("x_m", "y_m", "z_m")],
            Rotation.from_rotvec([float(r[k]) for k in ("rx_rad", "ry_rad", "rz_rad")]),
        )
        for r in (base, last)
    ]
    return table(ends[0], cells, ends[1])


def read_yaml(text):
    poses, name = {}, ""
    for line in text.splitlines():
        key, _, value = line.partition("#")[0].strip().partition(":")
        if not value.strip():
            name = key
        elif key != "hash":
            poses.setdefault(name, {})[key] = float(value)
    names = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"]
    parts = [
        frame([p[k] for k in "xyz"], Rotation.from_euler("xyz", [p[k] for k in ("roll", "pitch", "yaw")]))
        for p in (poses[k] for k in [*names, *(k for k in poses if k == "calibeam_flange")])
    ]
    return chain(parts if len(parts) == 7 else [*parts, np.eye(4)])


def read_json(text):
    content = json.loads(text)
    by_table = content["dh"]
    ends = [
        frame([by_table[k][f"{a}_m"] for a in "xyz"], Rotation.from_rotvec([by_table[k][f"r{a}_rad"] for a in "xyz"]))
        for k in ("base", "flange")
    ]
    by_parts = chain([np.array(part) for part in content["parts"]])
    rows = [list(r.values()) for r in by_table["rows"]]
    np.testing.assert_allclose(table(ends[0], rows, ends[1]), by_parts, atol=1e-9)
    return by_parts


def read_matlab(text):
    found = re.findall(r"arm\.parts\(:, :, \d+\) = \[(.*)\];", text)
    return chain([np.array([[float(v) for v in row.split()] for row in part.split(";")]) for part in found])


READERS = {
    form_named("urdf"): read_urdf,
    form_named("dh-csv"): read_csv,
    form_named("ur-kinematics"): read_yaml,
    form_named("json"): read_json,
    form_named("matlab"): read_matlab,
}


@pytest.mark.filterwarnings("ignore:Gimbal lock")
@pytest.mark.parametrize("form", list(READERS), ids=lambda f: f.name)
@pytest.mark.parametrize("wrong", [False, True], ids=["as drawn", "identified"])
def test_a_file_read_back_gives_the_same_flange(rig, form, wrong):
    corrections = errors_of(rig) if wrong else {}
    read = READERS[form](export_text(rig, corrections, form))
    np.testing.assert_allclose(read, flange(rig, corrections), atol=1e-9)


@pytest.mark.parametrize("name", ["ur5e", "ur5e by craig"])
def test_lists_of_the_controller_added_to_the_drawing_give_the_same_flange(name):
    """Without a tilt behind the last turn or in front of the first one, for which the lists have no place."""
    rig = ARMS[name]
    corrections = {k: v for k, v in errors_of(rig).items() if not k.startswith(("link0", "link6.tilt"))}
    lists = dict(
        re.findall(r"^(delta_\w+) = \[(.*)\]$", export_text(rig, corrections, form_named("ur-calibration")), re.M)
    )
    delta = np.array(
        [[float(v) for v in lists[k].split(",")] for k in ("delta_theta", "delta_d", "delta_a", "delta_alpha")]
    ).T
    assert abs(delta[1:4, 1]).max() > 10.0, "offsets of parallel axes run away, as in the controllers' own files"
    drawn = np.array([[j.theta_offset_rad, j.d_m, j.a_m, j.alpha_rad] for j in UR5E.arm.joints])
    rows = np.column_stack([drawn + delta, np.zeros(6)]).tolist()
    np.testing.assert_allclose(table(np.eye(4), rows, np.eye(4)), flange(rig, corrections), atol=1e-9)


def test_mujoco_reads_the_urdf_and_agrees(rig):
    corrections = errors_of(rig)
    text = export_text(rig, corrections, form_named("urdf"))
    option = '<mujoco><compiler boundmass="1" boundinertia="1" fusestatic="false"/></mujoco>'
    model = mujoco.MjModel.from_xml_string(re.sub(r"(<robot[^>]*>)", r"\1" + option, text))
    data = mujoco.MjData(model)
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "flange")
    for q, expected in zip(Q, flange(rig, corrections), strict=True):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(data.xpos[body], expected[:3, 3], atol=1e-9)
        np.testing.assert_allclose(data.xmat[body].reshape(3, 3), expected[:3, :3], atol=1e-9)


def test_the_urdf_carries_limits_and_the_tool_point_as_corrected():
    robot = ET.fromstring(export_text(CMM, {"tool.x": 1e-3, "device.x": 5.0}, form_named("urdf")))
    tool = next(j for j in robot.iter("joint") if j.get("name") == "tool_point_fixed")
    assert tool.find("origin").get("xyz") == "0.001 0.0 0.0"
    first = next(j for j in robot.iter("joint") if j.get("name") == "joint1").find("limit")
    assert float(first.get("lower")) == CMM.arm.joints[0].lower_rad


@pytest.mark.parametrize("form", [f for f in FORMS if not f.offsets and f.name != "table"], ids=lambda f: f.name)
def test_every_file_states_unit_and_sign(form):
    text = export_text(UR5E, {}, form)
    assert re.search(r"\bm(,| and) rad\b", text)
    assert "joint values are the readings" in text


def test_a_ur_kinematics_file_of_the_drawing_is_the_published_one():
    """ur_description, ur5e: shoulder z, upper_arm roll, forearm x, wrist_1 x and z, wrist_2 y, wrist_3 y."""
    text = export_text(UR5E, {}, form_named("ur-kinematics"))
    values, name = {}, ""
    for line in text.splitlines():
        key, _, value = line.partition("#")[0].strip().partition(":")
        name = key if not value.strip() else name
        values[f"{name}.{key}"] = value.strip()
    published = {
        "shoulder.z": 0.1625,
        "upper_arm.roll": np.pi / 2,
        "forearm.x": -0.425,
        "wrist_1.x": -0.3922,
        "wrist_1.z": 0.1333,
        "wrist_2.y": -0.0997,
        "wrist_3.y": 0.0996,
    }
    for key, number in published.items():
        assert float(values[key]) == pytest.approx(number, abs=1e-12), key


def test_a_correction_of_a_joint_that_is_not_there_is_refused():
    with pytest.raises(DataError, match=r"no parameter joint9\.zero .* 6 joints"):
        export_text(UR5E, {"joint9.zero": 1e-3}, form_named("json"))


@pytest.mark.parametrize("form", ["urdf", "mjcf"])
def test_a_name_with_control_characters_leaves_the_xml_well_formed(form):
    named = msgspec.structs.replace(UR5E, name='a\x1b[2J\x00 -- "<b>')
    ET.fromstring(export_text(named, {}, form_named(form)))
