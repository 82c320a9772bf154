"""Friction hidden in an emulated UR5e that is moved and recorded over its wires: `diagnose` names it with its size."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from acquisition.recording import RecordingWriter
from acquisition.wires.streams import Pump
from calibeam.cli import run
from drivers.clock import SystemClock
from drivers.ur.control import UrControl
from drivers.ur.reader import UrReader
from simulators.ur.readout import TORQUE_PER_CURRENT_NM_A

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
FRICTION_NM = 4.0
MIDDLE_RAD = np.array([0.3, -1.4, 1.4, -0.8, 0.5, 0.0])
REACH_RAD = np.array([1.0, 0.5, 0.8, 1.0, 1.0, 1.5])
MOVES = 16


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


@pytest.fixture
def emulated(tmp_path: Path) -> Iterator[str]:
    """Address of the robot of `calibeam emulate --hide`."""
    rig = tmp_path / "rig.toml"
    rig.write_text(rig_text(), encoding="utf-8")
    hidden = ["--hide", f"coulomb joint3 {FRICTION_NM}"]
    served = ["--json", "--end-with-stdin", "--robot-host", "auto", "--time-scale", "4", *hidden]
    command = [sys.executable, "-m", "calibeam", "emulate", str(rig), *served]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        yield json.loads(process.stdout.readline())["robot"]["host"]
        process.stdin.close()
        process.wait(10.0)


def record_motion(host: str, path: Path) -> None:
    """A robot on its ways between drawn poses, at several speeds."""
    rng, clock, failures = np.random.default_rng(4), SystemClock(), []
    control, reader = UrControl(host), UrReader(host, clock=clock)
    control.connect()
    try:
        control.move_joints(MIDDLE_RAD, 2.0, 10.0)
        with RecordingWriter(path, rig_text=rig_text(), software="test", clock=clock) as writer:
            reader.connect()
            stream = writer.stream(reader.name, reader.describe(), stamps="sampled")
            pump = Pump(
                reader, clock, lambda b: stream.append(b.host_s, b.device_s, b.sequence, b.values), failures.append
            )
            pump.start()
            for _ in range(MOVES):
                goal_rad = MIDDLE_RAD + REACH_RAD * rng.uniform(-1.0, 1.0, 6)
                control.move_joints(goal_rad, rng.uniform(0.5, 1.5), rng.uniform(2.0, 5.0))
            pump.stop()
    finally:
        control.close()
        reader.close()
    assert not failures


def of_controller(finding: dict[str, Any]) -> bool:
    """The emulated controller reports the mean torque of its last cycle: it is truly 1.5 ms late, at every joint."""
    if finding["physics"] != "torque-delay":
        return False
    return finding["parameters"]["delay_s"]["value"] == pytest.approx(1.5e-3, abs=0.7e-3)


def test_dry_friction_is_named_at_its_joint_with_its_size(emulated: str, tmp_path: Path) -> None:
    path, out = tmp_path / "motion.mcap", tmp_path / "diagnosis.json"
    record_motion(emulated, path)
    assert run(["diagnose", str(path), "--out", str(out)]) == 0
    said = json.loads(out.read_text(encoding="utf-8"))
    found = [one for one in said["findings"] if one["share"] > 0.01 and not of_controller(one)]
    assert [(one["physics"], one["where"]) for one in found] == [("coulomb-friction", "joint3.torque")]
    assert found[0]["parameters"]["friction_nm"]["value"] == pytest.approx(FRICTION_NM, rel=0.02)
