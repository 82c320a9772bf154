"""`compare --simulation`: a motion beside a URDF or MJCF file, whose torques lack what the measured ones hold."""

import json

import mujoco
import numpy as np
import pytest

from benchmarks.drawn_motion import RIG, ROTOR_KG_M2, Hidden, in_mujoco, links_of, recorded, rig_of_test
from calibeam.cli import run
from calibeam.results.comparison import compare_torques
from calibrate.errors import DataError
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import start_values

ARMATURE = f'armature="{ROTOR_KG_M2}"'
IMPORTED = "q1..q6 [rad] = q, tau1..tau6 [Nm] = tau"


def simulation(folder, joint=lambda number: ARMATURE, second=1.0):
    """The MJCF file of the arm that `recorded` moves."""
    rig = rig_of_test()
    arm = arm_of(rig)
    frames = arm.frames(start_values(arm.parameters), np.zeros((1, 6)))[0]
    links = links_of(rig)
    links[1] *= second
    model = in_mujoco(frames, links, np.array(rig.arm.gravity_m_s2), joint)
    path = folder / "arm.xml"
    mujoco.mj_saveLastXML(str(path), model)
    return path


def named(file):
    return {(d.physics, d.where, d.side) for d in file.differences if d.decides}


def test_a_friction_that_only_one_side_has_and_one_of_another_size(tmp_path):
    extra = {2: 'damping="6"', 4: 'frictionloss="0.5"', 5: 'frictionloss="1"'}
    path = simulation(tmp_path, lambda number: f"{ARMATURE} {extra.get(number, '')}")
    file = compare_torques(recorded(Hidden(coulomb={3: 2.0, 4: 2.0}, viscous={2: 6.0})), path, None)
    assert file.verdict == "mismatch"
    assert named(file) == {
        ("coulomb-friction", "joint3.torque", "measured"),
        ("coulomb-friction", "joint4.torque", "both"),
        ("coulomb-friction", "joint5.torque", "simulated"),
    }
    sizes = {d.where: d.sizes["friction_nm"] for d in file.differences}
    for where, true in (("joint3.torque", 2.0), ("joint4.torque", 1.5), ("joint5.torque", -1.0)):
        assert abs(sizes[where].value - true) < max(4.0 * sizes[where].sigma, 0.02)
    third = file.torques.joints[2]
    assert abs(third.difference_nm - 2.0) < 0.05
    assert third.left_nm < 0.2


def test_a_simulation_with_all_that_the_arm_has_agrees(tmp_path):
    path = simulation(tmp_path, lambda number: f'{ARMATURE} damping="{6 if number == 2 else 0}"')
    file = compare_torques(recorded(Hidden(viscous={2: 6.0})), path, None)
    assert file.verdict == "consistent", file.says
    assert all(one.difference_nm < 0.1 for one in file.torques.joints)
    assert all(one.measured_nm > 5.0 for one in file.torques.joints[1:3])


def test_a_mass_of_the_simulation_that_is_off_is_a_difference_without_a_number_of_a_link(tmp_path):
    file = compare_torques(recorded(Hidden()), simulation(tmp_path, second=0.97), None)
    assert file.verdict == "mismatch"
    assert named(file) == {("link-mass", "links", "")}
    (one,) = (d for d in file.differences if d.decides)
    assert "joint 2" in one.says
    assert abs(one.sizes["torque_nm"].value - file.torques.joints[1].difference_nm) < 0.02


def test_a_log_without_samples_by_the_command(tmp_path, capsys):
    recording, path = recorded(Hidden(coulomb={3: 2.0})), simulation(tmp_path)
    values = recording.streams["robot"].values
    table = np.column_stack([recording.streams["robot"].device_s, values["actual_q_rad"], values["joint_torque_nm"]])
    head = ",".join(["t_s", *(f"q{i}" for i in range(1, 7)), *(f"tau{i}" for i in range(1, 7))])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header=head, comments="")
    log, out = tmp_path / "log.mcap", tmp_path / "compare.json"
    made = ["import", str(tmp_path / "log.csv"), "--streams", "--rig", str(RIG), "--out", str(log)]
    assert run([*made, "--yes", "--columns", IMPORTED]) == 0
    assert run(["compare", str(log), "--simulation", str(path), "--out", str(out), "--exit-code"]) == 1
    printed = capsys.readouterr().out
    assert "Joint 3 needs" in printed
    assert "torque over the moments" in printed
    file = json.loads(out.read_bytes())
    assert (file["verdict"], file["simulated"], file["matched"]) == ("mismatch", "arm.xml", 0)
    assert [one["joint"] for one in file["torques"]["joints"]] == [1, 2, 3, 4, 5, 6]


def test_a_recording_without_motion_is_refused(tmp_path):
    still = recorded(Hidden(), length_s=2.0)
    values = still.streams["robot"].values
    values["actual_q_rad"][:] = values["actual_q_rad"][0]
    with pytest.raises(DataError, match="torques are not compared: no joint moves"):
        compare_torques(still, simulation(tmp_path), None)
