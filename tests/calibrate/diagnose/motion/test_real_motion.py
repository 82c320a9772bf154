"""A real robot in motion, KUKA KR 300: friction that two recordings agree on, proved on the one that was not fitted."""

import numpy as np
import pytest

from benchmarks import motion
from calibrate.diagnose.motion import torques_of_model
from calibrate.diagnose.motion.torques import diagnose_motion
from tests.calibrate.diagnose.streams.test_real_encoders import REAL

LEFT = (0.35, 0.06, 0.1, 0.16, 0.12, 0.2)  # of the torque of B, by the model of A; joint 1 hardly moves alike in both


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    if not REAL.is_dir():
        pytest.skip("real data not found in ../shared/data beside the project")
    out = tmp_path_factory.mktemp("kr300")
    return {record: motion.recording_of(REAL, record, out) for record in "AB"}


def friction(found):
    return {(f.name.physics, f.name.where): next(iter(f.parameters.values())) for f in found.diagnosis.findings}


def test_both_recordings_find_dry_and_viscous_friction_of_every_joint_alike(recordings):
    rig, seen, unseen = recordings["A"].rig, *(motion.motion_in(recordings[record]) for record in "AB")
    a, b = (diagnose_motion(rig, one, np.random.default_rng(1)) for one in (seen, unseen))
    wanted = {(f"{kind}-friction", f"joint{j}.torque") for kind in ("coulomb", "viscous") for j in range(1, 7)}
    assert set(friction(a)) == wanted
    assert set(friction(b)) == wanted
    for name in wanted:
        assert friction(a)[name].value == pytest.approx(friction(b)[name].value, rel=0.25), name
    torque, left = motion.torque_nm(unseen), motion.left_nm(rig, unseen, torques_of_model(a, "A"))
    assert all(left < limit * torque for left, limit, torque in zip(left, LEFT, torque, strict=True))
