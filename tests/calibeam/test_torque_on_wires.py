"""Friction hidden in an emulated UR5e that is moved and recorded over its wires: `diagnose` names it with its size,
`reconcile` brings the simulation of its rig file to move as it does, and the model stands in MuJoCo.
"""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mujoco
import pytest

from calibeam.cli import run
from calibrate.excitation import fourier
from simulators.ur.readout import TORQUE_PER_CURRENT_NM_A

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
FRICTION_NM = 4.0
TIME_SCALE = 2
OF_ITS_SIZE = 0.02


def rig_text() -> str:
    """The robot alone, with the constants of its motors and its rotors; its joints are at zero where they read zero."""
    text = RIG.read_text(encoding="utf-8")
    drives = iter(TORQUE_PER_CURRENT_NM_A)
    text = re.sub(
        r"gear_ratio = 101.0\n",
        lambda ratio: f"{ratio[0]}rotor_inertia_kg_m2 = 0.1\ntorque_per_ampere = {next(drives)}\n",
        text,
    )
    text = re.sub(r"\[devices\.(psd|encoders)\]\n(?:[^\[\n].*\n|\n)*", "", text)
    return re.sub(r"joint_zero_max_rad = .*\n", "", text)


@contextmanager
def emulated(rig: Path) -> Iterator[str]:
    """Address of the robot of `calibeam emulate --hide`."""
    hidden = ["--hide", f"coulomb joint3 {FRICTION_NM}"]
    served = ["--json", "--end-with-stdin", "--robot-host", "auto", "--time-scale", str(TIME_SCALE), *hidden]
    command = [sys.executable, "-m", "calibeam", "emulate", str(rig), *served]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        yield json.loads(process.stdout.readline())["robot"]["host"]
        process.stdin.close()
        process.wait(10.0)


def moved(rig: Path, host: str) -> Path:
    """The session folder of an exciting motion."""
    motion, reached, out = (rig.with_name(name) for name in ("motion.toml", "reached.toml", "moved"))
    with pytest.MonkeyPatch.context() as patch:  # as many drawn motions as a test needs
        patch.setattr(fourier, "DRAWN", 6)
        patch.setattr(fourier, "STEPS", 6)
        words = ["excite", str(rig), "--out", str(motion), "--length-s", "10", "--repeats", "2"]
        assert run([*words, "--speed-share", "0.8"]) == 0
    reached.write_text(re.sub(r'host = ".*"', f'host = "{host}"', rig_text()), encoding="utf-8")
    words = ["session", str(reached), "--motion", str(motion), "--out", str(out), "--yes"]
    assert run([*words, "--time-scale", str(TIME_SCALE)]) == 0
    return out


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A motion of the robot; rig.toml beside it does not know what is hidden."""
    folder = tmp_path_factory.mktemp("motion")
    (folder / "rig.toml").write_text(rig_text(), encoding="utf-8")
    with emulated(folder / "rig.toml") as host:
        return moved(folder / "rig.toml", host)


def of_controller(finding: dict[str, Any]) -> bool:
    """The emulated controller reports the mean torque of its last cycle: it is truly 1.5 ms late, at every joint."""
    if finding["physics"] != "torque-delay":
        return False
    return finding["parameters"]["delay_s"]["value"] == pytest.approx(1.5e-3, abs=0.7e-3)


def test_dry_friction_is_named_at_its_joint_with_its_size(recorded: Path, tmp_path: Path) -> None:
    out = tmp_path / "diagnosis.json"
    assert run(["diagnose", str(recorded), "--out", str(out)]) == 0
    said = json.loads(out.read_text(encoding="utf-8"))
    found = [one for one in said["findings"] if one["share"] > 0.01 and not of_controller(one)]
    assert [(one["physics"], one["where"]) for one in found] == [("coulomb-friction", "joint3.torque")]
    assert found[0]["parameters"]["friction_nm"]["value"] == pytest.approx(FRICTION_NM, rel=OF_ITS_SIZE)


def test_the_simulation_of_its_rig_file_is_brought_to_move_as_the_robot(recorded: Path, tmp_path: Path) -> None:
    out = tmp_path / "reconciled"
    assert (
        run(["reconcile", str(recorded), "--simulation", str(recorded.with_name("rig.toml")), "--out", str(out)]) == 0
    )
    joints = {one["joint"]: one for one in json.loads((out / "reconcile.json").read_text())["torques"]}
    assert joints[3]["before_nm"] > 0.95 * FRICTION_NM
    assert joints[3]["after_nm"] < 0.05 * joints[3]["before_nm"]
    for one in joints.values():  # a second of motion learned by the servo of one arm moves the other one, too
        assert one["tracking_after_rad"] < 1e-4
    assert joints[3]["tracking_after_rad"] < 0.3 * joints[3]["tracking_before_rad"]


def test_a_model_of_it_moves_on_in_mujoco_and_knows_what_is_not_new(recorded: Path, tmp_path: Path) -> None:
    model, arm = tmp_path / "model.json", tmp_path / "arm.xml"
    own = ["--out", str(tmp_path / "diagnosis.json")]
    assert run(["diagnose", str(recorded), "--model-out", str(model), *own]) == 0
    assert run(["export-model", str(model), "--to", "mjcf", "--out", str(arm)]) == 0
    loaded = mujoco.MjModel.from_xml_path(str(arm))
    assert loaded.dof_frictionloss[2] == pytest.approx(FRICTION_NM, rel=OF_ITS_SIZE)
    assert run(["diagnose", str(recorded), "--model", str(model), *own]) == 0
    said = json.loads((tmp_path / "diagnosis.json").read_text(encoding="utf-8"))
    assert said["torques"]["known"]
    (joint,) = (one for one in said["torques"]["joints"] if one["joint"] == 3)
    assert joint["unseen_before_nm"] < OF_ITS_SIZE * FRICTION_NM  # beside the model, before anything is found
    again = [one for one in said["findings"] if (one["physics"], one["where"]) == ("coulomb-friction", "joint3.torque")]
    assert all(abs(one["parameters"]["friction_nm"]["value"]) < OF_ITS_SIZE * FRICTION_NM for one in again)
