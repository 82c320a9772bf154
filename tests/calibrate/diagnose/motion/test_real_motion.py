"""A real robot in motion, KUKA KR 300: friction that two recordings agree on, proved on the one that was not fitted."""

import pytest

from benchmarks import motion
from tests.calibrate.diagnose.streams.test_real_encoders import REAL

LEFT = (0.6, 0.1, 0.2, 0.25, 0.15, 0.2)  # of the torque of B, by what A has taught; joint 1 hardly moves alike in both


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    if not REAL.is_dir():
        pytest.skip("real data not found in ../shared/data beside the project")
    out = tmp_path_factory.mktemp("kr300")
    return {record: motion.recording_of(REAL, record, out) for record in "AB"}


def friction(found):
    return {(f.name.physics, f.name.where): next(iter(f.parameters.values())) for f in found.diagnosis.findings}


def test_both_recordings_find_dry_and_viscous_friction_of_every_joint_alike(recordings):
    a, b = (motion.diagnosed(recordings[record]) for record in "AB")
    wanted = {(f"{kind}-friction", f"joint{j}.torque") for kind in ("coulomb", "viscous") for j in range(1, 7)}
    assert set(friction(a)) == set(friction(b)) == wanted
    for name, one in friction(a).items():
        other = friction(b)[name]
        assert one.value == pytest.approx(other.value, rel=0.25), name
    torque, left = motion.left_nm(a.model, recordings["B"])
    assert all(left < limit * torque for left, limit, torque in zip(left, LEFT, torque, strict=True))
