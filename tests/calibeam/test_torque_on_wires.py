"""Friction hidden in an emulated UR5e that is moved and recorded over its wires: `diagnose` names it with its size."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from calibeam.cli import run
from calibrate.excitation import fourier
from simulators.ur.readout import TORQUE_PER_CURRENT_NM_A

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
FRICTION_NM = 4.0
TIME_SCALE = 2


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
    served = ["--json", "--end-with-stdin", "--robot-host", "auto", "--time-scale", str(TIME_SCALE), *hidden]
    command = [sys.executable, "-m", "calibeam", "emulate", str(rig), *served]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        yield json.loads(process.stdout.readline())["robot"]["host"]
        process.stdin.close()
        process.wait(10.0)


@pytest.fixture
def motion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(fourier, "DRAWN", 6)
    monkeypatch.setattr(fourier, "STEPS", 6)
    out = tmp_path / "motion.toml"
    words = ["excite", str(tmp_path / "rig.toml"), "--out", str(out), "--length-s", "10", "--repeats", "2"]
    assert run([*words, "--speed-share", "0.8"]) == 0
    return out


def session(tmp_path: Path, host: str, motion: Path) -> int:
    reached = tmp_path / "reached.toml"
    reached.write_text(re.sub(r'host = ".*"', f'host = "{host}"', rig_text()), encoding="utf-8")
    words = ["session", str(reached), "--motion", str(motion), "--out", str(tmp_path / "moved"), "--yes"]
    return run([*words, "--time-scale", str(TIME_SCALE)])


def test_dry_friction_is_named_at_its_joint_with_its_size(emulated: str, motion: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "diagnosis.json"
    assert session(tmp_path, emulated, motion) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "scatter of the torque between repeats" in said
    assert f"next: calibeam diagnose {tmp_path / 'moved'}" in said
    assert run(["check", str(tmp_path / "moved")]) == 0
    assert "not one settled sample" not in capsys.readouterr().out
    assert run(["diagnose", str(tmp_path / "moved"), "--out", str(out)]) == 0
    said = json.loads(out.read_text(encoding="utf-8"))
    found, *others = said["findings"]  # the largest first; set-points that a busy machine sends late shake the arm
    assert (found["physics"], found["where"]) == ("coulomb-friction", "joint3.torque")
    assert found["parameters"]["friction_nm"]["value"] == pytest.approx(FRICTION_NM, rel=0.03)
    assert "coulomb-friction" not in {one["physics"] for one in others if one["share"] > 0.01}
