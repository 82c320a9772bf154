"""Logs of other programs as streams: delays between two clocks with drift, ROS 2 bags, CAN logs through a DBC file."""

import math
import re
from pathlib import Path

import can
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rosbags.rosbag1 import Writer as OldWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from acquisition.recording import read
from calibeam.cli import run
from calibrate.compare.streams import late_against_joints, stream_pairs
from calibrate.diagnose.record.file import read_diagnosis
from calibrate.diagnose.streams.examine import examine
from calibrate.diagnose.streams.recorded import devices_of
from simulators.streams.course import course

ROOT = Path(__file__).parents[2]
RIG = ROOT / "docs" / "examples" / "lab" / "rig.toml"
DELAYS_S = (1e-4, 1e-3, 1e-2, 5e-2, 2e-1)
DRIFT = 8e-5  # of the second clock, in s/s
FOUND_S = 1e-4
EPOCH_S = 1_769_860_800


@pytest.fixture(scope="module")
def way():
    """How an arm goes through eight poses, on true time."""
    return course(np.random.default_rng(5).uniform(-1.5, 1.5, (8, 6)))


def joints(way, delay_s=0.0, rate_hz=125.0, rate=0.0, seed=1):
    """Stamps on a clock of that rate, and angles that are older by the delay; with the noise of encoders."""
    true_s = np.arange(0.5, way.time_s[-1] - 0.5, 1.0 / rate_hz)
    noise = 5e-6 * np.random.default_rng(seed).standard_normal((len(true_s), 6))
    return true_s * (1.0 + rate), way.at(way.q_rad, true_s - delay_s) + noise


def logs(folder, way, delay_s, drift=DRIFT):
    """robot.csv as a German program writes it, encoders.parquet on another clock."""
    stamp_s, q_rad = joints(way)
    lines = ["Zeit [s];" + ";".join(f"A{i} [deg]" for i in range(1, 7)) + ";Load [N]"]
    lines += [
        ";".join(f"{v:.9f}".replace(".", ",") for v in (t, *np.degrees(q), 12.0))
        for t, q in zip(stamp_s, q_rad, strict=True)
    ]
    (folder / "robot.csv").write_text("\n".join(lines), encoding="utf-8-sig")
    stamp_s, encoder_rad = joints(way, delay_s, rate_hz=100.0, rate=drift, seed=2)
    columns = {"time [ms]": 1e3 * stamp_s} | {f"enc{i} [mrad]": 1e3 * encoder_rad[:, i - 1] for i in range(1, 7)}
    pq.write_table(pa.table(columns), folder / "encoders.parquet")
    return folder / "robot.csv", folder / "encoders.parquet"


def imported(out, *sources, rig=RIG, more=()):
    assert run(["import", *map(str, sources), "--streams", "--rig", str(rig), "--out", str(out), "--yes", *more]) == 0
    return read(out)


@pytest.mark.parametrize("delay_s", DELAYS_S)
def test_delays_between_clocks_that_drift_are_found(tmp_path, way, delay_s):
    recording = imported(tmp_path / "log.mcap", *logs(tmp_path, way, delay_s))
    fit = examine(devices_of(recording)).clocks["encoders"]
    # a stamp s of the second clock is of true time s / (1 + drift), and its angle is older by the delay
    expected_s = fit.middle_s / (1.0 + DRIFT) - delay_s - fit.middle_s
    assert fit.offset_s == pytest.approx(expected_s, abs=FOUND_S)
    assert fit.drift == pytest.approx(-DRIFT, abs=5e-6)


def test_a_delay_and_a_drift_are_findings_and_a_common_clock_is_none(tmp_path, way):
    late = examine(devices_of(imported(tmp_path / "late.mcap", *logs(tmp_path, way, 0.02))))
    (found,) = [f for f in late.findings if f.name.physics == "latency"]
    assert found.parameters["latency_s"].value == pytest.approx(
        0.02 + DRIFT * late.clocks["encoders"].middle_s, abs=FOUND_S
    )
    prompt = examine(devices_of(imported(tmp_path / "prompt.mcap", *logs(tmp_path, way, 0.0, drift=0.0))))
    assert [f for f in prompt.findings if f.name.physics == "latency"] == []


def test_diagnose_judges_streams_without_samples(tmp_path, way, capsys):
    imported(tmp_path / "log.mcap", *logs(tmp_path, way, 0.02))
    out = tmp_path / "diagnosis.json"
    assert run(["diagnose", str(tmp_path / "log.mcap"), "--out", str(out)]) == 0
    shown = capsys.readouterr().out
    assert "Streams only: 1 cause found" in shown
    assert "clock of encoders: joints' clock -2" in shown
    assert read_diagnosis(out).findings[0].physics == "latency"


def test_compare_finds_by_how_much_later_the_second_encoders_are(tmp_path, way):
    measured = imported(tmp_path / "measured.mcap", *logs(tmp_path, way, 0.05))
    simulated = imported(tmp_path / "simulated.mcap", *logs(tmp_path, way, 0.0))
    pairs = stream_pairs(devices_of(measured), devices_of(simulated))
    later_s, sigma_s = late_against_joints(pairs)["encoders"]
    assert later_s == pytest.approx(0.05, abs=FOUND_S)
    assert sigma_s < FOUND_S


def test_values_come_in_si_and_nothing_is_lost(tmp_path, way):
    recording = imported(tmp_path / "log.mcap", *logs(tmp_path, way, 0.0))
    stamp_s, q_rad = joints(way)
    robot = recording.streams["robot"]
    np.testing.assert_allclose(robot.host_s, stamp_s, atol=1e-9)
    np.testing.assert_allclose(robot.values["actual_q_rad"], q_rad, atol=1e-10)
    assert set(robot.values["Load"]) == {12.0}
    np.testing.assert_allclose(
        recording.streams["encoders"].values["position_rad"][0], joints(way, seed=2, rate_hz=100.0)[1][0]
    )


def test_names_and_units_of_one_log_are_stated_for_it(tmp_path, way):
    stamp_s, q_rad = joints(way)
    for name in ("one", "two"):
        table = {"t": stamp_s} | {f"J{i}": q_rad[:, i - 1] for i in range(1, 7)}
        pq.write_table(pa.table(table), tmp_path / f"{name}.parquet")
    columns = "t [s] = time, one: J1..J6 [rad] = q, two: J1..J6 [rad] = enc"
    sources = [tmp_path / "one.parquet", tmp_path / "two.parquet"]
    recording = imported(tmp_path / "log.mcap", *sources, more=("--columns", columns))
    assert "actual_q_rad" in recording.streams["one"].values
    assert "position_rad" in recording.streams["two"].values


@pytest.mark.parametrize(
    ("columns", "shift_s", "says"),
    [
        ("t [s] = time, J1..J6 [rad] = q", 0.0, "both hold joint angles understood as q"),
        (
            "t [s] = time, one: J1..J6 [rad] = q, two: J1..J6 [rad] = enc",
            1e4,
            "logs of one session count from one moment",
        ),
        ("one: J1..J6 [rad] = q, two: J1..J6 [rad] = enc", 0.0, "no unit stands there"),
        ("t [s] = time, U1..U6 [rad] = q, J1..J6 [rad] = enc", 0.0, "no log has the headings of 'U1..U6 [rad] = q'"),
    ],
)
def test_logs_that_do_not_fit_together(tmp_path, way, capsys, columns, shift_s, says):
    stamp_s, q_rad = joints(way)
    for name, later_s in (("one", 0.0), ("two", shift_s)):
        table = {"t": stamp_s + later_s} | {f"J{i}": q_rad[:, i - 1] for i in range(1, 7)}
        pq.write_table(pa.table(table), tmp_path / f"{name}.parquet")
    sources = [str(tmp_path / "one.parquet"), str(tmp_path / "two.parquet")]
    more = ["--columns", columns, "--yes", "--rig", str(RIG), "--out", str(tmp_path / "log.mcap")]
    assert run(["import", *sources, "--streams", *more]) == 1
    assert says in capsys.readouterr().err
    assert not (tmp_path / "log.mcap").exists()


UR_ORDER = (
    "elbow_joint",
    "shoulder_lift_joint",
    "shoulder_pan_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
UR_PLACES = (2, 1, 0, 3, 4, 5)


def write_bag(path, storage, stamp_s, q_rad, names, places):
    """Joint states on the robot's clock, received 3 ms later, and poses of a tracker. Without `storage` of ROS 1."""
    old = storage is None
    store = get_typestore(Stores.ROS1_NOETIC if old else Stores.ROS2_HUMBLE)
    types, serialized = store.types, store.serialize_ros1 if old else store.serialize_cdr
    writer = OldWriter(path) if old else Writer(path, version=9, storage_plugin=storage)
    header, stamp = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    turns = Rotation.random(len(stamp_s), random_state=3)
    with writer as bag:
        kinds = {"/joint_states": "sensor_msgs/msg/JointState", "/tracker/pose": "geometry_msgs/msg/PoseStamped"}
        topics = {topic: bag.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}
        for number, (t, q, xyzw) in enumerate(zip(stamp_s, q_rad, turns.as_quat(), strict=True)):
            ns = round((EPOCH_S + t) * 1e9)
            now = header(*([number] if old else []), stamp(*divmod(ns, 10**9)), "base")
            empty = np.empty(0)
            state = types[kinds["/joint_states"]](now, list(names), q[list(places)], empty, empty)
            pose = types["geometry_msgs/msg/Pose"](
                types["geometry_msgs/msg/Point"](1.0, 2.0, t), types["geometry_msgs/msg/Quaternion"](*xyzw)
            )
            stamped = types[kinds["/tracker/pose"]](now, pose)
            for topic, message in (("/joint_states", state), ("/tracker/pose", stamped)):
                data = serialized(message, kinds[topic])
                bag.write(topics[topic], ns + 3_000_000, data)
    return turns


@pytest.mark.parametrize("storage", [*StoragePlugin, None], ids=lambda one: one.value if one else "ros1")
def test_bags_bring_joints_in_the_order_of_the_arm_and_poses(tmp_path, way, storage):
    stamp_s, q_rad = (values[:200] for values in joints(way))
    path = tmp_path / ("bag" if storage else "robot.bag")
    turns = write_bag(path, storage, stamp_s, q_rad, UR_ORDER, UR_PLACES)
    recording = imported(tmp_path / "bag.mcap", path)
    robot, tracker = recording.streams["joint_states"], recording.streams["tracker-pose"]
    np.testing.assert_allclose(robot.values["actual_q_rad"], q_rad, rtol=1e-12)
    np.testing.assert_allclose(robot.host_s - robot.device_s, 3e-3, atol=1e-6)
    np.testing.assert_allclose(np.diff(robot.host_s), np.diff(stamp_s), atol=2e-9)
    np.testing.assert_allclose(tracker.values["position_m"][:, 2], stamp_s, rtol=1e-12)
    back = Rotation.from_rotvec(tracker.values["rotation_rad"])
    assert np.max((back * turns.inv()).magnitude()) < 1e-12
    assert recording.started_utc.startswith("2026-01-31T12:00:00")


def test_joints_whose_names_show_no_order_are_ordered_by_a_person(tmp_path, way, capsys):
    stamp_s, q_rad = (values[:50] for values in joints(way))
    names = ("waist", "arm", "fore", "roll", "bend", "twist")
    write_bag(tmp_path / "bag", StoragePlugin.SQLITE3, stamp_s, q_rad, names, range(6))
    (file,) = (tmp_path / "bag").glob("*.db3")
    assert run(["identify", str(file)]) == 1
    assert "calibeam import" in capsys.readouterr().err
    out = tmp_path / "bag.mcap"
    stated = "waist arm fore roll bend twist = q"
    recording = imported(out, tmp_path / "bag", more=("--columns", stated))
    np.testing.assert_allclose(recording.streams["joint_states"].values["actual_q_rad"], q_rad, rtol=1e-12)
    assert "actual_q_rad" not in imported(tmp_path / "raw.mcap", tmp_path / "bag").streams["joint_states"].values


@pytest.fixture
def dbc_rig(tmp_path):
    """The lab's rig with encoders that send by themselves."""
    signals = ", ".join(f'"ENCODER{i}.Angle"' for i in range(1, 7))
    text = RIG.read_text() + (
        '\n[devices.encoders]\ndriver = "can-dbc"\ninterface = "virtual"\nchannel = "bus"\n'
        f'dbc = "{ROOT / "rigs" / "encoders-plain.dbc"}"\nsignals = [{signals}]\n'
    )
    path = tmp_path / "rig.toml"
    path.write_text(text)
    return path


COUNT_RAD = math.radians(0.00034332275390625)


def write_can(path, stamp_s, q_rad):
    """Six encoders one after the other, 100 µs apart, every fifth row with frames of another device between."""
    with can.Logger(path) as log:
        for number, (t, q) in enumerate(zip(stamp_s, q_rad, strict=True)):
            for joint, angle_rad in enumerate(q):
                counts = round(angle_rad / COUNT_RAD)
                data = counts.to_bytes(4, "little", signed=True) + bytes([number % 256, 0])
                frame = can.Message(EPOCH_S + t + 1e-4 * joint, 257 + joint, is_extended_id=False, data=data, channel=0)
                log.on_message_received(frame)
            if number % 5 == 0:
                other = can.Message(EPOCH_S + t + 1e-3, 0x700, is_extended_id=False, data=b"\x05", channel=0)
                log.on_message_received(other)


@pytest.mark.parametrize("suffix", ["blf", "asc"])
def test_encoders_are_read_from_a_can_log_by_their_dbc_file(tmp_path, way, dbc_rig, suffix):
    stamp_s, q_rad = (values[:150] for values in joints(way, rate_hz=100.0))
    log = tmp_path / f"bus.{suffix}"
    write_can(log, stamp_s, q_rad)
    out = tmp_path / "bus.mcap"
    assert run(["import", str(log), "--rig", str(dbc_rig), "--out", str(out)]) == 0
    recording = read(out)
    encoders = recording.streams["encoders"]
    assert len(encoders.host_s) == 150
    np.testing.assert_allclose(encoders.values["position_rad"], q_rad, atol=0.51 * COUNT_RAD)
    np.testing.assert_allclose(np.diff(encoders.host_s), np.diff(stamp_s), atol=3e-6)
    frames = next(stream for name, stream in recording.streams.items() if name.startswith("can"))
    assert len(frames.host_s) == 6 * 150 + 30


def test_a_can_log_next_to_a_robots_log_shows_the_delay_between_them(tmp_path, way, dbc_rig):
    stamp_s, q_rad = joints(way)
    table = {"time [s]": EPOCH_S + stamp_s} | {f"q{i} [rad]": q_rad[:, i - 1] for i in range(1, 7)}
    pq.write_table(pa.table(table), tmp_path / "robot.parquet")
    write_can(tmp_path / "bus.blf", *joints(way, delay_s=0.012, rate_hz=100.0, seed=2))
    out = tmp_path / "log.mcap"
    recording = imported(out, tmp_path / "robot.parquet", tmp_path / "bus.blf", rig=dbc_rig)
    fit = examine(devices_of(recording)).clocks["encoders"]
    # the row is of the mean time of its six frames, 250 µs after the first; each joint's angle is of the row's begin
    assert fit.offset_s == pytest.approx(-0.01225, abs=FOUND_S)


def test_frames_of_other_encoders_are_named(tmp_path, way, dbc_rig, capsys):
    stamp_s, q_rad = (values[:5] for values in joints(way))
    write_can(tmp_path / "bus.blf", stamp_s, q_rad)
    dbc_rig.write_text(dbc_rig.read_text().replace("ENCODER6.Angle", "ENCODER9.Angle"))
    assert run(["import", str(tmp_path / "bus.blf"), "--rig", str(dbc_rig), "--out", str(tmp_path / "x.mcap")]) == 1
    assert "no signal 'ENCODER9.Angle'" in capsys.readouterr().err


def test_second_encoders_of_some_joints_and_motor_torques_show_a_soft_drive(tmp_path, way):
    """Motor torques become those of the joints by the gear ratios of the rig file."""
    soft, ratio = 1e-7, 120.0
    stamp_s, q_rad = joints(way, rate_hz=250.0)
    torque_nm = 800.0 * np.sin(2.1 * stamp_s)[:, None] + 500.0 * np.cos(q_rad[:, 1:3])
    second = q_rad[:, 1:3] - soft * torque_nm
    headings = ["t_s", *(f"a{i}_deg" for i in range(1, 7)), "e2_deg", "e3_deg", "m2", "m3"]
    values = np.column_stack([stamp_s, np.degrees(q_rad), np.degrees(second), torque_nm / ratio])
    lines = [",".join(headings), *(",".join(map(repr, row.tolist())) for row in values)]
    (tmp_path / "arm.csv").write_text("\n".join(lines), encoding="utf-8")
    text = re.sub(r"gear_ratio = .*\n", "", RIG.read_text(encoding="utf-8"))
    (tmp_path / "rig.toml").write_text(text.replace("lower_rad", f"gear_ratio = {ratio}\nlower_rad"), encoding="utf-8")
    columns = "a1_deg..a6_deg = q, e2_deg e3_deg = enc, m2 m3 [Nm] = motor_tau"
    imported(tmp_path / "log.mcap", tmp_path / "arm.csv", rig=tmp_path / "rig.toml", more=("--columns", columns))
    report = examine(devices_of(read(tmp_path / "log.mcap")))
    found = {one.name.where: one for one in report.findings if one.name.physics == "joint-compliance"}
    assert set(found) == {"joint2.angle", "joint3.angle"}
    for one in found.values():
        size = one.parameters["compliance_rad_per_nm"]
        assert size.value == pytest.approx(soft, abs=4.0 * size.sigma)


def test_columns_of_some_joints_need_the_numbers_of_these_joints(tmp_path, way, capsys):
    stamp_s, q_rad = joints(way)
    headings = ["t_s", *(f"q{i}_rad" for i in range(1, 7)), "left", "right"]
    lines = [",".join(headings)]
    lines += [",".join(map(repr, row)) for row in np.column_stack([stamp_s, q_rad, q_rad[:, :2]]).tolist()]
    (tmp_path / "arm.csv").write_text("\n".join(lines), encoding="utf-8")
    command = ["import", str(tmp_path / "arm.csv"), "--streams", "--rig", str(RIG), "--out", str(tmp_path / "log.mcap")]
    assert run([*command, "--yes", "--columns", "left right [rad] = enc"]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "enc of 2 of 6 joints" in said
    assert "left, right" in said


def test_a_bag_of_ros_1_is_read_and_its_stamps_are_what_the_user_states(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    header, time = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    with OldWriter(tmp_path / "arm.bag") as bag:
        kind = "sensor_msgs/msg/JointState"
        topic = bag.add_connection("/joint_states", kind, typestore=store)
        for row in range(20):
            at = header(seq=row, stamp=time(sec=1_700_000_000, nanosec=row * 10_000_000), frame_id="")
            message = store.types[kind](at, [f"joint_{k}" for k in range(1, 7)], *[np.full(6, 0.1 * row)] * 3)
            bag.write(topic, 1_700_000_000 * 10**9 + row * 10_000_000 + 3_000_000, store.serialize_ros1(message, kind))
    out = tmp_path / "arm.mcap"
    rig = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
    said = ["--rig", str(rig), "--stamps", "sent", "--yes", "--out", str(out)]
    assert run(["import", str(tmp_path / "arm.bag"), *said]) == 0
    stream = read(out).streams["joint_states"]
    np.testing.assert_allclose(stream.values["actual_q_rad"], 0.1 * np.arange(20.0)[:, None] * np.ones(6), atol=1e-12)
    np.testing.assert_allclose(stream.host_s - stream.device_s, 3e-3, atol=1e-6)
    assert stream.stamps == "sent"
    run(["check", str(out)])
    assert "time stamp: sent" in capsys.readouterr().out
    assert run(["export", str(out), "--streams", "--out", str(tmp_path / "folder")]) == 0
    assert read(tmp_path / "folder").streams["joint_states"].stamps == "sent"


def test_a_log_without_samples_is_judged_by_its_streams(tmp_path, way, capsys):
    imported(tmp_path / "log.mcap", *logs(tmp_path, way, 0.01))
    assert run(["check", str(tmp_path / "log.mcap")]) == 0
    assert "no-samples" not in capsys.readouterr().out
