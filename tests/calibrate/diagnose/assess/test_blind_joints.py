"""A joint that next to no reading follows: said once, and nothing is found in it."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from acquisition.recording.samples import POSITION
from calibeam.results.diagnosis import diagnose_recording
from calibrate.model.arms.rig_arm import RigArm
from tests.calibrate.diagnose.concealed import changed, recording_of

SIGMA_M = 1e-5


@pytest.fixture(scope="module")
def near_the_axis(tmp_path_factory):
    """A target a tenth of a millimetre off the axis of joint 6, which sways across it by its angle: by what nobody
    can say, for 0.4 rad of the joint would do the same.
    """
    drawn = recording_of(tmp_path_factory.mktemp("near"), family="tracker", seed=3, samples=60)
    point_m = (1e-4, 0.0, 0.1)
    rig = structs.replace(drawn.rig, tool=structs.replace(drawn.rig.tool, point_m=point_m))
    q_rad = drawn.samples.joints()
    T = RigArm.of_rig(rig).frames(q_rad)[:, -1]
    sway_m = 4.0 * SIGMA_M * np.sin(3.0 * q_rad[:, 5])
    at = T[:, :3, :3] @ np.array(point_m) + T[:, :3, 3] + sway_m[:, None] * T[:, :3, 1]
    at += np.random.default_rng(5).normal(0.0, SIGMA_M, at.shape)
    samples = changed(drawn.samples, **dict(zip(POSITION, at.T, strict=True)))
    return diagnose_recording(replace(drawn, rig=rig, samples=samples))[1]


def test_the_blind_joint_is_named_once_with_the_remedy(near_the_axis):
    (said,) = [line for line in near_the_axis.next if "blind" in line]
    assert said.startswith("joint6.angle is blind")
    assert said.endswith("put the target off its axis")


def test_nothing_is_found_or_excluded_in_it(near_the_axis):
    assert "joint6.angle" not in {f.where for f in near_the_axis.findings}
    assert "joint6.angle" not in {r.where for r in near_the_axis.rejected}
    assert "joint6.angle" not in {s.where for s in near_the_axis.smallest}
    assert "joint6.angle" in {one.where for one in near_the_axis.invisible}
