"""A real drive with an encoder on either side: KUKA KR 300, motor torques recorded (../shared/data/kr300-encoders)."""

from pathlib import Path

import pytest

from acquisition.recording import read
from benchmarks import motion
from calibeam.cli import run
from calibrate.diagnose.record.file import read_diagnosis

REAL = Path(__file__).parents[5] / "shared" / "data" / "kr300-encoders"


@pytest.fixture
def diagnosed(tmp_path):
    if not REAL.is_dir():
        pytest.skip("real data not found in ../shared/data beside the project")

    def of(record):
        out = motion.recording_of(REAL, record, tmp_path).path
        assert len(read(out).streams) == 1
        assert run(["diagnose", str(out), "--out", str(tmp_path / "found.json")]) == 0
        return read_diagnosis(tmp_path / "found.json")

    return of


@pytest.mark.parametrize("record", ["A", "B"])
def test_one_lag_of_the_second_encoders_no_slack_no_slip_and_compliance_of_the_size_of_a_large_drive(diagnosed, record):
    file = diagnosed(record)
    by = {(one.physics, one.where): one for one in file.findings if one.stream != "torque"}
    late = by.pop(("latency", "time")).parameters["latency_s"]
    assert late.value is not None
    assert 2.7e-3 < late.value < 3.3e-3
    assert {physics for physics, _ in by} <= {"joint-compliance"}  # no slack, no slip, no lag of one joint
    for one in by.values():
        size = one.parameters["stiffness_nm_per_rad"]
        assert size.value is not None
        assert 3e6 < size.value < 3e7
    bent = [one for one in file.examinations if one.what == "joint compliance between encoders"]
    assert [one.outcome == "found" for one in bent].count(True) == len(by)
    assert all(one.limit is not None for one in bent if one.outcome == "nothing found")
    assert "angle-offset" not in {one.physics for one in file.findings}
