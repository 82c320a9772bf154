"""What stays between two readings of one angle: offsets, their changes and droops of the right size, and no others."""

from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from benchmarks.moving_arm import motion, sampled
from benchmarks.stream_cases import JOINT_NOISE_RAD, servo_scene
from benchmarks.stream_devices import devices_of_scene
from calibrate.diagnose.streams.angle_offsets import angle_offsets
from calibrate.diagnose.streams.examine import examine
from calibrate.diagnose.streams.stream_findings import offset_findings
from calibrate.diagnose.streams.streams_of_recording import gravity_levers
from calibrate.diagnose.streams.track import Outcome, Track
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import start_values

ROOT = Path(__file__).parents[4]
RIGS = ("ur5e-tracker.toml", "arm-cmm-reference.toml")
RATE_HZ, ROWS, LAG_S, JOINTS = 125.0, 5000, 0.010, 6
OFFSET_RAD, SAG_RAD, SECOND_RAD = np.radians((17.0, 2.9, 2.0))
SMALL_RAD = np.radians(0.01)
SECOND = "offset of the second encoders"


@pytest.fixture(scope="module")
def course():
    """Times, set-points and readings of a healthy arm that is 10 ms behind them."""
    rng = np.random.default_rng(1)
    path = motion(rng, 40, JOINTS)
    time_s = 0.1 + np.arange(ROWS) / RATE_HZ
    read = sampled(path.time_s, path.command_rad, time_s - LAG_S)
    read += rng.normal(0.0, JOINT_NOISE_RAD, read.shape)
    return time_s, sampled(path.time_s, path.command_rad, time_s), read


@pytest.fixture
def wide():
    """As `course`, with joints that turn through more than a radian, as gravity needs it."""
    rng = np.random.default_rng(2)
    time_s = np.arange(ROWS) / RATE_HZ
    rates = np.array([0.31, 0.47, 0.59, 0.41, 0.37, 0.53])
    phases = rng.uniform(0.0, 2.0 * np.pi, JOINTS)

    def at(t):
        return 1.2 * np.sin(rates * t[:, None] + phases)

    return time_s, at(time_s), at(time_s - LAG_S) + rng.normal(0.0, JOINT_NOISE_RAD, (ROWS, JOINTS))


def offsets(time_s, command, read, levers=None, *, wraps=False, zeros_rad=()):
    tracks = Track("joints", "rad", time_s, read), Track("command", "rad", time_s, command)
    return angle_offsets(*tracks, levers, wraps=wraps, zeros_rad=zeros_rad)


def plus(values, joint, more_rad, rows=slice(None)):
    out = values.copy()
    out[rows, joint - 1] += more_rad
    return out


def only(found, joint):
    """The result of this joint, where nothing is found at the others."""
    assert all(one.outcome is Outcome.ABSENT for one in found if one.joint != joint)
    (mine,) = (one for one in found if one.joint == joint)
    return mine


def is_size(size, true_rad):
    return abs(size.value - true_rad) < min(5.0 * size.sigma, SMALL_RAD)


def test_a_constant_part_beside_a_lag_is_an_offset_of_its_joint(course):
    time_s, command, read = course
    one = only(offsets(time_s, command, plus(read, 3, OFFSET_RAD)), 3)
    (whole,) = one.stretches
    assert whole.found
    assert one.droop is None
    assert is_size(whole.offset, OFFSET_RAD)
    (finding,) = offset_findings("joints", one)
    assert (finding.name.physics, finding.name.where, finding.from_s) == ("angle-offset", "joint3.angle", None)
    assert finding.parameters["offset_rad"] == whole.offset
    assert "the reading of joint 3 in joints shows 296.70" in finding.says
    assert "more than its set-point" in finding.says


@pytest.mark.parametrize(("first_rad", "then_rad"), [(0.0, OFFSET_RAD), (OFFSET_RAD, 0.0), (-0.1, OFFSET_RAD)])
def test_an_offset_that_changes_has_a_stretch_of_each_size(course, first_rad, then_rad):
    time_s, command, read = course
    changed = plus(plus(read, 3, first_rad), 3, then_rad - first_rad, slice(ROWS // 2, None))
    one = only(offsets(time_s, command, changed), 3)
    first, then = one.stretches
    interval_s = 25 / RATE_HZ
    assert first.to_s == then.from_s == pytest.approx(time_s[ROWS // 2], abs=interval_s)
    assert (first.from_s, then.to_s) == pytest.approx((time_s[0], time_s[-1]), abs=interval_s)
    for stretch, true_rad in ((first, first_rad), (then, then_rad)):
        assert is_size(stretch.offset, true_rad)
        assert stretch.found == bool(true_rad)
    findings = offset_findings("joints", one)
    assert [f.from_s for f in findings] == [s.from_s for s in one.stretches if s.found]
    assert all("between" in f.says for f in findings)


def test_a_sag_by_the_joints_own_angle_is_a_droop_and_no_offset(wide):
    time_s, command, read = wide
    sag = -SAG_RAD * np.cos(command[:, 1])
    one = only(offsets(time_s, command, plus(read, 2, sag)), 2)
    assert one.droop is not None
    assert not one.by_gravity
    assert one.droop.value == pytest.approx(0.5 * np.ptp(sag), rel=0.01)
    assert not any(stretch.found for stretch in one.stretches)
    (finding,) = offset_findings("joints", one)
    assert (finding.name.physics, finding.name.where) == ("droop", "joint2.angle")
    assert finding.name.depends_on == ("q2",)
    assert finding.rivals == ()


def test_a_sag_by_the_torque_of_gravity_is_a_droop_of_that_torque(wide):
    """Joints 2 and 3 bear the links behind them; the torque turns with the joints in front, too."""
    time_s, command, read = wide
    levers = gravity_levers(load_rig(ROOT / "rigs" / RIGS[0]))
    torque = levers(command)[:, 2]
    sag = SAG_RAD * torque / np.abs(torque).max()
    one = only(offsets(time_s, command, plus(read, 3, sag), levers), 3)
    assert one.by_gravity
    assert one.droop.value == pytest.approx(0.5 * np.ptp(sag), rel=0.01)
    (finding,) = offset_findings("joints", one)
    assert (finding.name.physics, finding.name.depends_on) == ("droop", ("gravity_torque3",))


@pytest.mark.parametrize("rig", RIGS)
def test_the_torque_of_gravity_is_the_loss_of_height_of_the_links_ends(rig):
    """By virtual work, with differences of the heights."""
    rig, step_rad = load_rig(ROOT / "rigs" / rig), 1e-6
    arm, q = arm_of(rig), np.random.default_rng(3).uniform(-1.5, 1.5, (20, rig.n_joints))

    def energy(q_rad):
        ends = arm.frames(start_values(arm.parameters), q_rad)[:, 1:, :3, 3]
        return -np.sum(ends @ np.array(rig.arm.gravity_m_s2), axis=1)

    nudges = step_rad * np.eye(rig.n_joints)
    slope = np.stack([(energy(q + one) - energy(q - one)) / (2.0 * step_rad) for one in nudges], axis=1)
    np.testing.assert_allclose(gravity_levers(rig)(q), -slope, atol=1e-6)


def test_healthy_joints_have_neither_offset_nor_droop_and_a_finite_limit():
    for seed in range(20):
        scene = servo_scene(seed, moves=6)
        joints, command, encoders = scene.joints(125.0), scene.command(125.0), scene.encoders()
        found = [*angle_offsets(joints, command, wraps=False), *angle_offsets(encoders, joints, wraps=True)]
        found = [one.known(stepped=False, bent=False) if one.zeroless else one for one in found]
        assert len(found) == 2 * JOINTS
        for one in found:
            assert one.outcome is Outcome.ABSENT, (seed, one)
            assert offset_findings("joints", one) == [], (seed, one)
            assert 0.0 < one.limit_rad < np.radians(1.0), (seed, one)


@pytest.mark.parametrize("moves", [4, 6, 10])
def test_a_disc_off_its_centre_is_no_change_and_hides_none(moves):
    """An arm that goes from place to place shows its discs as levels."""
    for seed in range(10):
        scene = servo_scene(seed, moves=moves)
        joints, encoders = scene.joints(125.0), scene.encoders()
        middle = len(encoders.time_s) // 2
        stepped = replace(encoders, values=plus(encoders.values, 3, 2e-3, slice(middle, None)))
        whole = (one.known(stepped=False, bent=False) for one in angle_offsets(encoders, joints, wraps=True))
        assert {one.outcome for one in whole} == {Outcome.ABSENT}
        one = only([o.known(stepped=False, bent=False) for o in angle_offsets(stepped, joints, wraps=True)], 3)
        (finding,) = offset_findings("encoders", one)
        assert finding.parameters["change_rad"].value == pytest.approx(2e-3, abs=2.5e-4)  # twice a disc, at most
        assert "s than at the beginning" in finding.says


@pytest.mark.parametrize(("share", "outcome"), [(0.8, Outcome.ABSENT), (1.2, Outcome.FOUND)])
def test_an_offset_is_found_beyond_the_stated_limit_only(course, share, outcome):
    time_s, command, read = course
    limit_rad = offsets(time_s, command, read)[2].limit_rad
    assert offsets(time_s, command, plus(read, 3, share * limit_rad))[2].outcome is outcome


def test_a_joint_that_stands_while_others_move_is_judged(course):
    time_s, command, read = course
    still, rng = command.copy(), np.random.default_rng(4)
    still[:, 3] = 0.3
    stood = read.copy()
    stood[:, 3] = 0.3 + SECOND_RAD + rng.normal(0.0, JOINT_NOISE_RAD, ROWS)
    one = only(offsets(time_s, still, stood), 4)
    assert is_size(one.stretches[0].offset, SECOND_RAD)
    stood[:, 3] -= SECOND_RAD
    assert offsets(time_s, still, stood)[3].outcome is Outcome.ABSENT


def test_an_arm_that_stands_shows_nothing(course):
    time_s, command, read = course
    found = offsets(time_s, np.zeros_like(command), 1e-6 * read)
    assert {(one.outcome, one.why) for one in found} == {(Outcome.NOT_DETERMINABLE, "no joint moves")}


def test_rows_that_were_not_read_are_left_out(course):
    time_s, command, read = course
    holes = plus(read, 3, OFFSET_RAD)
    holes[::7] = np.nan
    holes[100:400, 1] = np.nan
    assert is_size(only(offsets(time_s, command, holes), 3).stretches[0].offset, OFFSET_RAD)


def test_too_few_rows_are_stated(course):
    time_s, command, read = course
    few = read.copy()
    few[60:] = np.nan
    for one in offsets(time_s, command, few):
        assert (one.outcome, one.limit_rad) == (Outcome.NOT_DETERMINABLE, None)
        assert "rows in which both were read, of at least 80" in one.why


def test_a_reading_that_never_changes_is_not_judged(course):
    time_s, command, read = course
    stuck = read.copy()
    stuck[:, 2] = 1.0
    found = offsets(time_s, command, stuck)
    assert [one.joint for one in found if one.why] == [3]
    assert found[2].why == "one of the two readings never changes while the other one does"
    assert found[2].outcome is Outcome.NOT_DETERMINABLE


def test_readings_within_one_turn_are_judged_on_the_circle(course):
    """359 degrees in place of 0, less 2 degrees of the zero; joint 3 counts against the joint."""
    time_s, command, read = course
    turned = read + np.radians(359.0)
    turned[:, 2] = np.radians(359.0) - read[:, 2]
    found = offsets(time_s, command, turned % (2.0 * np.pi), wraps=True, zeros_rad=[np.radians(-2.0)] * JOINTS)
    for one in found:
        assert is_size(one.stretches[0].offset, np.radians(1.0))
        assert one.outcome is Outcome.FOUND


def test_a_second_reading_of_another_shaft_is_not_judged(course):
    time_s, command, read = course
    other = read.copy()
    other[:, 2] = read[:, 4]
    one = offsets(time_s, command, other, wraps=True)[2]
    assert "does not follow the joint" in one.why


@pytest.fixture(scope="module")
def scene():
    return servo_scene(21, moves=10, stand_s=1.0)


def seconds(scene, more_rad):
    """Devices whose second encoder of joint 3 reads so much more."""
    devices = devices_of_scene(deepcopy(scene), {})
    track = devices["encoders"].track
    return devices | {
        "encoders": replace(devices["encoders"], track=replace(track, values=plus(track.values, 3, more_rad)))
    }


def of_second(report):
    return [one for one in report.examinations if one.what == SECOND]


def test_a_second_encoder_off_its_stated_zero_is_found(scene):
    report = examine(seconds(scene, SECOND_RAD), zeros_rad=[0.01] * JOINTS)
    (found,) = (one for one in report.findings if one.name.physics == "angle-offset")
    assert (found.name.where, found.stream) == ("joint3.angle", "encoders")
    assert is_size(found.parameters["offset_rad"], SECOND_RAD)
    assert "more than the joint's reading" in found.says
    endings = {one.where: one for one in of_second(report)}
    assert endings.pop("joint3").says == found.says
    assert {one.outcome for one in endings.values()} == {"nothing found"}
    assert all(one.limit is not None and one.limit < SECOND_RAD for one in endings.values())


def test_without_its_zero_an_offset_is_not_examined_and_the_remedy_is_stated(scene):
    report = examine(seconds(scene, SECOND_RAD), zeros_rad=[0.01, 0.01, None, 0.01, 0.01, 0.01])
    assert not any(one.name.physics == "angle-offset" for one in report.findings)
    (left,) = (one for one in of_second(report) if one.outcome == "not examined")
    assert "no zero of the second encoder of joint3" in left.reason
    assert "`encoder_zero_rad`" in left.remedy
    assert "`calibeam compare`" in left.remedy


def test_an_encoder_that_does_not_answer_is_named_and_the_others_are_examined(scene):
    """Of joint 2 no reading ever came, of joint 5 one row in ten: a row counts only with the readings of all."""
    devices = seconds(scene, SECOND_RAD)
    track = devices["encoders"].track
    values = plus(track.values, 2, np.nan)
    values[np.arange(len(values)) % 10 > 0, 4] = np.nan
    devices["encoders"] = replace(devices["encoders"], track=replace(track, values=values))
    report = examine(devices, zeros_rad=[0.01] * JOINTS)
    assert report.clocks["encoders"].offset_s == pytest.approx(15.0, abs=1e-4)
    (found,) = (one for one in report.findings if one.name.physics == "angle-offset")
    assert found.name.where == "joint3.angle"
    for what in (SECOND, "slips of the second encoders"):
        endings = {one.where: one for one in report.examinations if one.what == what and one.where}
        assert {where for where, one in endings.items() if one.outcome == "not examined"} == {"joint2", "joint5"}
        assert endings["joint2"].reason == f"read in 0 of {len(values)} rows"
        assert endings["joint2"].expected
        assert "wiring" in endings["joint2"].remedy
        assert set(endings) == {f"joint{j + 1}" for j in range(JOINTS)}


def test_the_limit_beside_a_stated_zero_is_not_below_what_would_be_reported(scene):
    """Discs off their centres make a millirad: less than five of their sigmas beside the zero is no finding."""
    report = examine(seconds(scene, 1e-3), zeros_rad=[0.01] * JOINTS)
    (one,) = [r for r in report.examinations if r.what == SECOND and r.where == "joint3"]
    assert one.outcome == "nothing found"
    assert one.limit > 1e-3
