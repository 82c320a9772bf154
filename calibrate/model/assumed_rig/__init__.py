"""The rig as assumed before calibration: where spots fall at a pose, for alignment and for the report."""

from calibrate.model.assumed_rig.assumed_arm import BelievedArm
from calibrate.model.assumed_rig.assumed_fixture import BelievedFixture, Light
from calibrate.model.assumed_rig.assumed_rig import BelievedRig

__all__ = ["BelievedArm", "BelievedFixture", "BelievedRig", "Light"]
