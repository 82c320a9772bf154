"""A slip of a second encoder is judged after what else may lie between the two encoders of a joint."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.stream_cases import servo_scene
from calibrate.diagnose.streams.settling import stands_of
from calibrate.diagnose.streams.slips import slips

SOFT_JOINT, SLIPPED_JOINT = 1, 2  # from 0
SOFT_RAD = 4e-4  # at the largest torque: 8 urad/Nm under 50 Nm
SLIP_RAD = 2e-4


def torque(q_rad):
    """A share of the largest: of an arm whose second and third joint lie across gravity."""
    return 0.7 * np.cos(q_rad[:, 1]) + 0.3 * np.cos(q_rad[:, 1] + q_rad[:, 2])


def causes(joint, q_rad):
    return torque(q_rad)[:, None]


def read(seed, *, slip=False):
    scene = servo_scene(seed, moves=40)
    joints, encoders = scene.joints(), scene.encoders()
    values = encoders.values.copy()
    values[:, SOFT_JOINT] += SOFT_RAD * torque(encoders.values)
    if slip:
        at_s = 0.5 * (encoders.time_s[0] + encoders.time_s[-1])
        values[:, SLIPPED_JOINT] += SLIP_RAD * (encoders.time_s > at_s)
    return replace(encoders, values=values), joints, stands_of(scene.command())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_soft_joint_is_no_slip(seed):
    encoders, joints, stands = read(seed)
    found = slips(encoders, joints, stands, causes)
    assert all(found.judged)
    assert found.found == ()


def test_a_true_slip_is_found_next_to_a_soft_joint():
    encoders, joints, stands = read(1, slip=True)
    (found,) = slips(encoders, joints, stands, causes).found
    assert found.joint == SLIPPED_JOINT + 1
    assert found.size_rad == pytest.approx(SLIP_RAD, abs=4.0 * found.sigma_rad + 1e-5)
