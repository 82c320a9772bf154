"""Arms that motion is tested on: UR5e and IRB 120, as drawn, and calibrated (no closed form fits those any more)."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibrate.model.arms.dh import DhArm, DhLink
from calibrate.model.arms.link_tolerance import LinkTolerance
from calibrate.model.arms.rig_arm import RigArm

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"
QUARTER = np.pi / 2.0
# ABB product specification IRB 120, 3HAC035960.
IRB120_ROWS = (
    DhLink(0.0, 0.290, 0.0, -QUARTER),
    DhLink(-QUARTER, 0.0, 0.270, 0.0),
    DhLink(0.0, 0.0, 0.070, -QUARTER),
    DhLink(0.0, 0.302, 0.0, QUARTER),
    DhLink(0.0, 0.0, 0.0, -QUARTER),
    DhLink(np.pi, 0.072, 0.0, 0.0),
)
IRB120_UPPER_RAD = np.radians([165.0, 110.0, 70.0, 160.0, 120.0, 180.0])
IRB120_LOWER_RAD = np.radians([-165.0, -110.0, -110.0, -160.0, -120.0, -180.0])


def irb120(error: float = 0.0) -> RigArm:
    """`error`: one sigma of every parameter, m and rad; 0 is the drawing."""
    arm = DhArm(IRB120_ROWS, LinkTolerance(3e-4, 5e-4))
    theta = error * np.random.default_rng(3).normal(size=len(arm.parameters))
    return RigArm.of(arm, theta, IRB120_LOWER_RAD, IRB120_UPPER_RAD)


def ur5e(error: float = 0.0) -> RigArm:
    rig = load_rig(RIG)
    drawn = RigArm.of_rig(rig)
    if error == 0.0:
        return drawn
    rows = tuple(
        DhLink(j.theta_offset_rad or 0.0, j.d_m or 0.0, j.a_m or 0.0, j.alpha_rad or 0.0) for j in rig.arm.joints
    )
    arm = DhArm(rows, LinkTolerance(3e-4, 5e-4))
    theta = error * np.random.default_rng(4).normal(size=len(arm.parameters))
    return RigArm.of(arm, theta, drawn.lower_rad, drawn.upper_rad)


MAKERS = {"irb120": irb120, "ur5e": ur5e}


@pytest.fixture(params=list(MAKERS))
def maker(request: pytest.FixtureRequest):
    return MAKERS[request.param]
