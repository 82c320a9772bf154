"""Each fault of a stream is found in its place with its size; streams without it are left in peace."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import streams
from benchmarks.stream_cases import servo_scene
from calibrate.diagnose.streams.continuity import Fault, breaks
from calibrate.diagnose.streams.following import following
from calibrate.diagnose.streams.ringing import ringing
from calibrate.diagnose.streams.settling import Window, stands_of, unsettled
from calibrate.diagnose.streams.slips import slips
from calibrate.diagnose.streams.track import Outcome, Track


@pytest.mark.parametrize("seed", [1, 2])
def test_ringing_has_its_frequency_its_damping_and_its_joint(seed):
    frequency, damping, joint_right = streams.ringing_case(seed)
    assert abs(frequency) < 2.0
    assert abs(damping) < 20.0
    assert joint_right


def test_nothing_rings_behind_a_well_damped_servo():
    assert not streams.quiet_case(1)


def test_ringing_needs_a_stand():
    scene = servo_scene(1)
    assert ringing(scene.spots(), ()).outcome is Outcome.NOT_DETERMINABLE


@pytest.mark.parametrize(("made", "kind"), [(streams.delay_case, "delay"), (streams.lag_case, "first-order lag")])
def test_a_reading_behind_its_setpoint_tells_by_how_much_and_how(made, kind):
    error, said = made(1)
    assert abs(error) < 5.0
    assert said == kind


def test_a_joint_that_stands_has_no_following_error():
    scene = servo_scene(1)
    command = scene.command()
    command.values[:, 4] = 0.3
    said = following(command, replace(command, values=command.values.copy()))
    assert said[4].outcome is Outcome.NOT_DETERMINABLE
    assert said[4].behind_s is None
    assert said[0].outcome is Outcome.ABSENT


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_encoder_slip_is_found_among_seats_that_scatter(seed):
    found, error_rad, false = streams.slip_case(seed)
    assert found
    assert error_rad < 2.5e-5
    assert false == 0


def test_few_stands_do_not_judge_slips():
    scene = servo_scene(1, moves=3)
    said = slips(scene.encoders(), scene.joints(), stands_of(scene.command()))
    assert not any(said.judged)
    assert said.found == ()


@pytest.mark.parametrize("seed", [1, 2])
def test_missed_double_backward_and_frozen_samples_are_asked_to_the_sample(seed):
    assert streams.breaks_case(seed) == (True, 0)


def test_a_standing_reading_is_not_frozen():
    scene = servo_scene(1)
    joints = scene.joints()
    coarse = replace(joints, values=np.round(joints.values, 4))
    assert not [b for b in breaks(coarse, None, joints) if b.fault is Fault.FROZEN]
    assert not breaks(coarse)


@pytest.mark.parametrize(("catches_up", "frozen"), [(True, 1), (False, 0)])
def test_a_joint_that_sticks_while_its_set_point_creeps_on_is_not_frozen(catches_up, frozen):
    """A frozen reading jumps to where the motion has come; a joint that stuck goes on from where it stood."""
    t = np.arange(1000) * 4e-3
    command = np.round(0.1 * np.sin(t), 6)[:, None]
    reading = command.copy()
    reading[300:320] = reading[300]
    if not catches_up:
        reading[320:] += reading[300] - command[319]
    found = breaks(Track("joints", "rad", t, reading), None, Track("command", "rad", t, command))
    assert len([b for b in found if b.fault is Fault.FROZEN]) == frozen


def test_noise_that_stops_is_a_frozen_reading():
    rng = np.random.default_rng(1)
    values = np.round(rng.normal(0.0, 1e-6, (1000, 2)), 9)
    values[300:340] = values[300]
    found = breaks(Track("spots", "m", np.arange(1000) * 1e-3, values), noisy=True)
    assert [(b.fault, b.first, b.last) for b in found] == [(Fault.FROZEN, 300, 339)]


def test_unsettled_samples_are_distinguished_from_settled_ones():
    found, of, false, healthy = streams.settling_case(1)
    assert (found, false) == (of, 0)
    assert of > 0 < healthy


def test_the_share_of_an_exponential_that_was_still_to_come_is_reported():
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 1.0, 1e-3)
    spots = Track("spots", "m", t, np.exp(-t / 0.08)[:, None] * 1e-4 + rng.normal(0.0, 1e-6, (1000, 1)))
    stands = stands_of(Track("command", "rad", t, np.zeros((1000, 1))))
    (early, late) = unsettled(spots, [Window(0.05, 0.07), Window(0.8, 0.85)], stands)
    assert early.outcome is Outcome.FOUND
    assert early.tau_s == pytest.approx(0.08, rel=0.05)
    assert early.left_share == pytest.approx(np.mean(np.exp(-t[50:71] / 0.08)), rel=0.05)
    assert late.outcome is not Outcome.FOUND
