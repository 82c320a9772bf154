"""Positions that scatter far beyond what is believed of the device."""

import msgspec
import pytest

from calibrate.diagnose.fitted import fit_geometry
from calibrate.diagnose.from_recording import BELIEVED, beyond_noise
from calibrate.diagnose.session import session_of
from calibrate.effects.term import Missing

from .concealed import recording_of

SPEED = Missing("qd", "qd1_rad_s ...", "latency")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return recording_of(tmp_path_factory.mktemp("quiet"), family="tracker", seed=32, samples=120, arm="irb120")


def believing(recording, position_m, joint_rad=None):
    rig = recording.rig
    noise = msgspec.structs.replace(rig.noise, position_m=position_m, joint_rad=joint_rad)
    return fit_geometry(session_of(msgspec.structs.replace(rig, noise=noise), recording.samples))


def scatter_m(recording):
    return float(fit_geometry(session_of(recording.rig, recording.samples)).scatters[0].covariance[0, 0, 0] ** 0.5)


def test_what_a_belief_may_be_wrong_by_is_noise(recording):
    assert beyond_noise(believing(recording, scatter_m(recording) / 6.0), (SPEED,)) is None


def test_more_is_left_without_a_name_and_says_what_was_not_recorded(recording):
    found = beyond_noise(believing(recording, scatter_m(recording) / (3.0 * BELIEVED)), (SPEED,))
    assert found is not None
    assert found.depends_on == ("qd",)
    assert "qd1_rad_s" in found.why


def test_joints_that_are_said_to_scatter_may_do_so(recording):
    assert beyond_noise(believing(recording, scatter_m(recording) / (3.0 * BELIEVED), 2e-4), (SPEED,)) is None
