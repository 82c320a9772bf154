"""A real drive with an encoder on either side: KUKA KR 300, motor torques recorded (../shared/data/kr300-encoders)."""

import csv
from pathlib import Path

import pytest

from acquisition.recording import read
from calibeam.cli import run
from calibrate.diagnose.record.file import read_diagnosis

REAL = Path(__file__).parents[5] / "shared" / "data" / "kr300-encoders"
COLUMNS = (
    "se1_deg..se3_deg [deg] = enc, motor1_deg..motor6_deg [deg] = q, ref1_deg..ref6_deg [deg] = cmd, "
    "torque1_motor_Nm..torque6_motor_Nm [Nm] = motor_tau"
)
# a_m, alpha in right angles, d_m, theta in right angles: KR 300 R2500 ultra, KUKA's data sheet
TABLE = (
    *((0.35, -1, 0.675, 0), (1.15, 0, 0.0, -1), (-0.041, -1, 0.0, 0)),
    *((0.0, 1, 1.0, 0), (0.0, -1, 0.0, 0), (0.0, 0, 0.24, 0)),
)
RIGHT_RAD = 1.5707963267948966


@pytest.fixture
def diagnosed(tmp_path):
    if not REAL.is_dir():
        pytest.skip("real data not found in ../shared/data beside the project")
    with (REAL / "parameters.csv").open(encoding="utf-8") as file:
        ratios = list(map(float, list(csv.reader(file))[1][1:]))
    joints = [
        f"[[arm.joint]]\na_m = {a}\nalpha_rad = {al * RIGHT_RAD}\nd_m = {d}\ntheta_offset_rad = {th * RIGHT_RAD}\n"
        f"lower_rad = -3.2\nupper_rad = 3.2\ngear_ratio = {ratio}\n"
        for (a, al, d, th), ratio in zip(TABLE, ratios, strict=True)
    ]
    rig = tmp_path / "rig.toml"
    rig.write_text('schema = 1\nname = "kr300"\n[arm]\nmodel = "dh"\n' + "\n".join(joints), encoding="utf-8")

    def of(record):
        out = tmp_path / f"{record}.mcap"
        source = REAL / f"recorded_{record}.csv"
        command = ["import", str(source), "--streams", "--rig", str(rig), "--yes", "--columns", COLUMNS]
        assert run([*command, "--out", str(out)]) == 0
        assert len(read(out).streams) == 1
        assert run(["diagnose", str(out), "--out", str(tmp_path / "found.json")]) == 0
        return read_diagnosis(tmp_path / "found.json")

    return of


@pytest.mark.parametrize("record", ["A", "B"])
def test_one_lag_of_the_second_encoders_no_slack_no_slip_and_compliance_of_the_size_of_a_large_drive(diagnosed, record):
    file = diagnosed(record)
    by = {(one.physics, one.where): one for one in file.findings}
    late = by.pop(("latency", "time")).parameters["latency_s"]
    assert late.value is not None
    assert 2.7e-3 < late.value < 3.3e-3
    assert {physics for physics, _ in by} <= {"joint-compliance"}  # no slack, no slip, no lag of one joint
    for one in by.values():
        size = one.parameters["stiffness_nm_per_rad"]
        assert size.value is not None
        assert 3e6 < size.value < 3e7
    assert sum("compliance of joint" in said for said in file.streams.unseen) == 3 - len(by)
