"""A law over every registered examination of check, diagnose, compare and reconcile: what its columns do not show was
not examined, with a reason and a remedy, and no verdict reports that nothing is wrong.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording import Channel, Recording, RecordingError, Samples, SamplesError, Stream, check, read
from acquisition.recording.examination import FOUND, NOT_EXAMINED, Examination, ExaminationRecord
from acquisition.recording.rig import load_rig, rig_text
from acquisition.recording.samples import CONTROLLER
from benchmarks.stream_cases import servo_scene
from benchmarks.stream_devices import devices_of_scene
from calibeam.results.check_examinations import CHECK_EXAMINATIONS, check_examinations, verdict_lines
from calibeam.results.comparison import compare
from calibeam.results.controller_findings import arm_of_controller
from calibeam.results.diagnosis import DIAGNOSE_EXAMINATIONS, diagnose_recording, diagnose_streams
from calibeam.results.motion_reconciliation import reconcile_torques
from calibeam.results.reconciliation import reconcile
from calibrate.compare.comparison_examinations import COMPARE_EXAMINATIONS
from calibrate.compare.reconciled_rows import RECONCILE_EXAMINATIONS, examined
from calibrate.diagnose.record.schema import TORQUES_IN_MOTION
from calibrate.errors import DataError
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import start_values
from calibrate.report.diagnosis import verdict_words
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

RIGS = Path(__file__).parents[2] / "rigs"
WAYS = ("absent", "too short", "constant", "invalid")
NOTHING_WRONG = ("no fault", "no errors", "agree")
CHANNELS = {
    "cmd": ("target_q_rad",),
    "q": ("actual_q_rad",),
    "enc": ("position_rad",),
    "position_rad": ("position_rad",),
    "tau": ("joint_torque_nm",),
    "photocurrents": ("photocurrent_a",),
    **dict.fromkeys(CONTROLLER, ("actual_tcp_pose_m_rad",)),
}
TIMES = ("host_s", "device_s", "sequence")


@dataclass(frozen=True)
class Ended:
    """What a command says of a recording: how its examinations ended, and its verdict in words."""

    records: tuple[ExaminationRecord, ...]
    verdict: str


def stream(name: str, device, channels: dict[str, np.ndarray]) -> Stream:
    kinds = tuple(Channel(n, "rad", v.shape[1:]) for n, v in channels.items())
    return Stream(name, kinds, device.host_s, device.track.time_s, device.sequence, channels)


@pytest.fixture(scope="module")
def motion(loaded: Recording) -> Recording:
    """Without torques, whose search takes seconds."""
    return replace(loaded, streams=spoilt_channel(loaded.streams, "joint_torque_nm", "absent"))


@pytest.fixture(scope="module")
def loaded() -> Recording:
    """A healthy arm with a second set of encoders, torques and detectors, in motion."""
    devices = devices_of_scene(servo_scene(3, moves=6), {})
    rig_path = RIGS / "ur5e-dual-psd.toml"
    joints, encoders, spots = (devices[name] for name in ("joints", "encoders", "spots"))
    command = {"target_q_rad": devices["command"].track.values, "actual_q_rad": joints.track.values}
    tool = {"actual_tcp_pose_m_rad": tool_poses(load_rig(rig_path), joints.track.values)}
    torque = {"joint_torque_nm": 20.0 * np.sin(joints.track.values)}
    u = np.repeat(spots.track.values, 2, axis=1) / 10.0
    currents = {"photocurrent_a": 1e-4 * (1.0 + u * np.tile([-1.0, 1.0], 4))}
    streams = {
        "robot": stream("robot", joints, {**command, **torque, **tool}),
        "encoders": stream("encoders", encoders, {"position_rad": encoders.track.values}),
        "psd": stream("psd", spots, currents),
    }
    rig = load_rig(rig_path)
    empty = Samples({"t_s": np.zeros(0)}, 6)
    return Recording(Path("motion.mcap"), rig_text(rig_path), rig, empty, True, streams=streams)


def tool_poses(rig, q_rad):
    """(row, 6) of the nominal flange: what a controller without faults reports."""
    arm = arm_of(rig)
    flange = arm.flange(start_values(arm.parameters), q_rad)
    turns = Rotation.from_matrix(flange[:, :3, :3]).as_rotvec()
    return np.concatenate([flange[:, :3, 3], turns], axis=1)


@pytest.fixture(scope="module")
def poses(tmp_path_factory) -> Recording:
    where = tmp_path_factory.mktemp("poses")
    write_case(conceal(Wanted("tracker", 5, defects=(), samples=40, arm="irb120")), where)
    return read(where / "recording")


@pytest.fixture(scope="module")
def log(motion: Recording) -> Recording:
    """Three encoders on one shaft, without an arm."""
    turn = np.linspace(0.0, 15.0, 2000)
    angle = np.stack([turn, 2.0 * 0.5 * turn + 0.3, turn - 0.7], axis=1)
    time_s = 0.01 * np.arange(len(turn))
    angle += 1e-6 * np.random.default_rng(1).standard_normal(angle.shape)
    one = Stream(
        "encoders", (Channel("position_rad", "rad", (3,)),), time_s + 100.0, time_s,
        np.arange(len(turn), dtype=np.int64), {"position_rad": angle},
    )  # fmt: skip
    path = RIGS / "encoders.toml"
    rig = load_rig(path, needs_arm=False)
    empty = Samples({"t_s": np.zeros(0)}, 0)
    return Recording(Path("log.mcap"), rig_text(path), rig, empty, True, streams={"encoders": one})


def spoilt(recording: Recording, column: str, way: str) -> Recording:
    """One column of a recording that shows nothing; of times those of all streams."""
    if column == "sample events":
        return replace(recording, events=())
    if column in TIMES:
        return replace(recording, streams=spoilt_times(recording.streams, way))
    if column in CHANNELS and recording.streams:
        return replace(recording, streams=spoilt_channel(recording.streams, CHANNELS[column][0], way))
    names = [c for c in recording.samples.columns if belongs(c, column)]
    return replace(recording, samples=spoilt_samples(recording.samples, names, way))


def belongs(name: str, column: str) -> bool:
    if column == "q":
        return name.startswith("q") and name.endswith("_rad")
    return name in ("x_m", "y_m", "z_m") if column == "readings" else name == column


def spoilt_times(streams, way):
    if way == "absent":
        return {}
    if way == "too short":
        return {name: rows_of(one, slice(0, 2)) for name, one in streams.items()}
    fill = (lambda t: np.full_like(t, t[0])) if way == "constant" else (lambda t: np.full(t.shape, np.nan))
    return {
        name: replace(one, host_s=fill(one.host_s), device_s=fill(one.device_s), sequence=np.zeros_like(one.sequence))
        for name, one in streams.items()
    }


def rows_of(one: Stream, rows) -> Stream:
    values = {name: v[rows] for name, v in one.values.items()}
    return replace(
        one, host_s=one.host_s[rows], device_s=one.device_s[rows], sequence=one.sequence[rows], values=values
    )


def spoilt_channel(streams, channel: str, way: str):
    out = dict(streams)
    for name, one in streams.items():
        if channel not in one.values:
            continue
        values = one.values[channel]
        if way == "absent":
            kept = {n: v for n, v in one.values.items() if n != channel}
            kinds = tuple(c for c in one.channels if c.name != channel)
            out[name] = replace(one, values=kept, channels=kinds)
            if not kept:
                del out[name]
        elif way == "too short":  # valid in two rows only
            few = np.full(values.shape, np.nan)
            few[:2] = values[:2]
            out[name] = replace(one, values={**one.values, channel: few})
        else:
            fill = np.broadcast_to(values[:1], values.shape) if way == "constant" else np.full(values.shape, np.nan)
            out[name] = replace(one, values={**one.values, channel: fill.copy()})
    return out


def spoilt_samples(samples: Samples, names, way: str) -> Samples:
    columns = {n: np.asarray(v) for n, v in samples.columns.items()}
    if way == "absent":
        return Samples({n: v for n, v in columns.items() if n not in names}, samples.n_joints)
    if way == "too short":
        return samples.take(np.arange(1))
    for name in names:
        fill = columns[name][:1] if way == "constant" else np.array([np.nan])
        columns[name] = np.repeat(fill.astype(float), len(samples))
    return Samples(columns, samples.n_joints)


def checked(recording: Recording) -> Ended:
    findings, arm = check(recording), arm_of_controller(recording) if recording.rig.n_joints else None
    records = check_examinations(recording, findings, arm)
    return Ended(records, [*verdict_lines(findings, records)][-1])


def diagnosed(recording: Recording) -> Ended:
    file = diagnose_recording(recording)[1] if len(recording.samples) else diagnose_streams(recording)[1]
    return Ended(file.examinations, verdict_words(file))


def beside(simulated: Recording) -> Callable[[Recording], Ended]:
    def compared(recording: Recording) -> Ended:
        file = compare(recording, simulated, diagnosed=False)
        return Ended(file.examinations, file.says)

    return compared


def cases(examinations: tuple[Examination, ...]):
    each = ((e, column) for e in examinations for column in e.needs)
    return [pytest.param(e, c, way, id=f"{e.what}, {c}, {way}") for (e, c), way in product(each, WAYS)]


def assert_not_examined(command: Callable[[Recording], Ended], recording: Recording, examination: Examination) -> None:
    try:
        ended = command(recording)
    except (DataError, RecordingError, SamplesError):
        return  # refused with an error: there is no verdict
    mine = [one for one in ended.records if one.what == examination.what]
    assert mine
    endings = {one.outcome for one in mine}
    assert endings <= {NOT_EXAMINED, FOUND} or examination.what == "streams"  # the other devices are examined
    assert endings & {NOT_EXAMINED, FOUND}
    assert not any(words in ended.verdict for words in NOTHING_WRONG)


OF_LOG = ("readings of the encoders", "encoders against each other")
OF_SAMPLES = ("order of the samples", "faults of the file", "physics at settled poses", "arm of the controller")
OF_CHECK = tuple(e for e in CHECK_EXAMINATIONS if e.what not in (*OF_LOG, *OF_SAMPLES))


@pytest.mark.parametrize(("examination", "column", "way"), cases(OF_CHECK))
def test_check_of_a_motion(motion, examination, column, way):
    assert_not_examined(checked, spoilt(motion, column, way), examination)


@pytest.mark.parametrize(
    ("examination", "column", "way"), cases(tuple(e for e in CHECK_EXAMINATIONS if e.what in OF_LOG))
)
def test_check_of_a_log_of_encoders(log, examination, column, way):
    assert_not_examined(checked, spoilt(log, column, way), examination)


OF_POSES = tuple(e for e in (*CHECK_EXAMINATIONS, *DIAGNOSE_EXAMINATIONS) if e.what in OF_SAMPLES)
OF_STREAMS = tuple(e for e in DIAGNOSE_EXAMINATIONS if e.what not in (*OF_LOG, *OF_SAMPLES))
OF_CONTROLLER = tuple(e for e in CHECK_EXAMINATIONS if e.needs == CONTROLLER)


@pytest.mark.parametrize(("examination", "column", "way"), cases(OF_STREAMS))
def test_diagnose_of_a_motion(motion, loaded, examination, column, way):
    recording = loaded if "tau" in examination.needs else motion
    assert_not_examined(diagnosed, spoilt(recording, column, way), examination)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("command", [checked, diagnosed])
def test_the_arm_of_a_controller(motion, command, way):
    (examination,) = OF_CONTROLLER
    assert_not_examined(command, spoilt(motion, examination.needs[0], way), examination)


@pytest.mark.parametrize(
    ("examination", "column", "way"), cases(tuple(e for e in OF_POSES if e.needs == ("q", "readings")))
)
def test_diagnose_of_poses(poses, examination, column, way):
    assert_not_examined(diagnosed, spoilt(poses, column, way), examination)


@pytest.mark.parametrize(("examination", "column", "way"), cases(tuple(e for e in OF_POSES if e.needs == ("t_s",))))
def test_check_of_poses(poses, examination, column, way):
    assert_not_examined(checked, spoilt(poses, column, way), examination)


@pytest.mark.parametrize(("examination", "column", "way"), cases(tuple(e for e, _ in COMPARE_EXAMINATIONS)))
def test_compare_of_poses_and_motions(poses, loaded, examination, column, way):
    recording = poses if "readings" in examination.needs else replace(poses, streams=loaded.streams)
    assert_not_examined(beside(recording), spoilt(recording, column, way), examination)


@pytest.mark.parametrize(
    ("examination", "column", "way"), cases(tuple(e for e in RECONCILE_EXAMINATIONS if "tau" in e.needs))
)
def test_reconcile_of_a_motion(loaded, examination, column, way):
    left_out = reconcile_torques(spoilt(loaded, column, way), None, "rig.toml")
    assert isinstance(left_out, ExaminationRecord)
    assert (left_out.what, left_out.outcome) == (examination.what, NOT_EXAMINED)


@pytest.mark.parametrize(
    ("examination", "column", "way"), cases(tuple(e for e in RECONCILE_EXAMINATIONS if "readings" in e.needs))
)
def test_reconcile_of_poses(poses, examination, column, way):
    none = TORQUES_IN_MOTION.not_examined("no torques of the joints were recorded", expected=False)

    def reconciled(recording: Recording) -> Ended:
        file = examined(reconcile(recording, poses.rig_text, "rig.toml").file, none)
        return Ended(file.examinations, file.verdict)

    few = replace(poses, samples=poses.samples.take(np.arange(20)))  # of more a whole diagnosis follows
    assert_not_examined(reconciled, spoilt(few, column, way), examination)


def test_the_recordings_that_are_spoilt_are_examined_while_they_are_whole(motion, loaded, log, poses):
    """But for the clock of the spots, which a fitted model predicts, and samples, which a motion has not."""
    of_motion = {one.what for one in diagnosed(motion).records if one.outcome != NOT_EXAMINED}
    assert {e.what for e in OF_STREAMS if not {"tau", "photocurrents"} & set(e.needs)} <= of_motion
    assert {e.what for e in OF_CONTROLLER} <= of_motion
    assert "joint compliance between encoders" in {
        one.what for one in diagnosed(loaded).records if one.outcome != NOT_EXAMINED
    }
    assert checked(log).verdict == "no errors"
    assert {e.what for e in OF_POSES if e.needs == ("q", "readings")} <= {
        one.what for one in diagnosed(poses).records if one.outcome != NOT_EXAMINED
    }
