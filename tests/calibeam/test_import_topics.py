"""Topics of a bag by their type: points, transforms and joints with a prefix are taken, and the others are named."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as OldWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from acquisition.recording import Recording, read
from calibeam.cli import run

RIG = Path(__file__).parents[2] / "docs" / "examples" / "lab" / "rig.toml"
STORE = get_typestore(Stores.ROS2_HUMBLE)
TYPES = STORE.types
ROWS = 40
RNG = np.random.default_rng(4)
POINTS_M = RNG.uniform(0.5, 2.0, (ROWS, 3))
TURNS = Rotation.random(ROWS, random_state=5)
ANGLES_RAD = RNG.uniform(-1.5, 1.5, (ROWS, 7))
EMPTY = np.empty(0)
SEVENTH = """
[[arm.joint]]
a_m = 0.0
alpha_rad = 0.0
d_m = 0.05
lower_rad = -6.28
upper_rad = 6.28
"""

Message = tuple[str, Any]  # topic and message


def header(row: int, frame: str = "tracker") -> Any:
    return TYPES["std_msgs/msg/Header"](TYPES["builtin_interfaces/msg/Time"](1_700_000_000, 10_000_000 * row), frame)


def point(row: int, frame: str = "tracker") -> Any:
    xyz = TYPES["geometry_msgs/msg/Point"](*POINTS_M[row])
    return TYPES["geometry_msgs/msg/PointStamped"](header(row, frame), xyz)


def transform(row: int, child: str = "flange", parent: str = "tracker") -> Any:
    moved = TYPES["geometry_msgs/msg/Vector3"](*POINTS_M[row])
    turned = TYPES["geometry_msgs/msg/Quaternion"](*TURNS[row].as_quat())
    both = TYPES["geometry_msgs/msg/Transform"](moved, turned)
    return TYPES["geometry_msgs/msg/TransformStamped"](header(row, parent), child, both)


def joint_state(row: int, names: Sequence[str], angles_rad: Sequence[float]) -> Any:
    angles = np.array(angles_rad, dtype=np.float64)
    return TYPES["sensor_msgs/msg/JointState"](header(row), list(names), angles, EMPTY, EMPTY)


def write_bag(path: Path, messages: Sequence[Message]) -> Path:
    """10 ms from row to row; a row is every message of one topic in its order."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3) as bag:
        topics: dict[str, Any] = {}
        counts: dict[str, int] = {}
        for topic, message in messages:
            kind = message.__msgtype__
            if topic not in topics:
                topics[topic] = bag.add_connection(topic, kind, typestore=STORE)
            row = counts[topic] = counts.get(topic, -1) + 1
            stamp_ns = 1_700_000_000 * 10**9 + row * 10_000_000
            bag.write(topics[topic], stamp_ns, STORE.serialize_cdr(message, kind))
    return path


def seven_axes(tmp_path: Path) -> Path:
    rig = tmp_path / "rig.toml"
    text = RIG.read_text(encoding="utf-8")
    place = text.index("\n[", text.rindex("[[arm.joint]]"))
    rig.write_text(text[:place] + SEVENTH + text[place:], encoding="utf-8")
    return rig


def import_bag(bag: Path, rig: Path, *more: str) -> int:
    return run(["import", str(bag), "--rig", str(rig), "--out", str(bag.parent / "log.mcap"), "--yes", *more])


def imported(bag: Path, rig: Path, *more: str) -> Recording:
    assert import_bag(bag, rig, *more) == 0
    return read(bag.parent / "log.mcap")


def columns_of(bag: Path) -> list[dict[str, Any]]:
    content = json.loads((bag.parent / "log.mcap.columns.json").read_text(encoding="utf-8"))
    return content if isinstance(content, list) else [content]


def test_points_become_positions(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", [("/smr", point(row)) for row in range(ROWS)])
    stream = imported(bag, RIG).streams["smr"]
    np.testing.assert_allclose(stream.values["position_m"], POINTS_M)
    assert "rotation_rad" not in stream.values
    assert "position in frame 'tracker'" in columns_of(bag)[0]["notes"]


def test_transforms_become_poses_of_the_child_in_the_parent(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", [("/vicon", transform(row)) for row in range(ROWS)])
    stream = imported(bag, RIG).streams["vicon"]
    np.testing.assert_allclose(stream.values["position_m"], POINTS_M)
    back = Rotation.from_rotvec(stream.values["rotation_rad"])
    assert np.max((back * TURNS.inv()).magnitude()) < 1e-12
    assert "pose of 'flange' in frame 'tracker'" in columns_of(bag)[0]["notes"]


def test_transforms_of_two_bodies_on_one_topic_are_two_streams(tmp_path: Path) -> None:
    bodies = ("flange", "table")
    bag = write_bag(tmp_path / "bag", [("/vicon", transform(row, bodies[row % 2])) for row in range(ROWS)])
    streams = imported(bag, RIG).streams
    np.testing.assert_allclose(streams["vicon-tracker-flange"].values["position_m"], POINTS_M[::2])
    np.testing.assert_allclose(streams["vicon-tracker-table"].values["position_m"], POINTS_M[1::2])


def test_points_of_two_frames_are_not_one_stream(tmp_path: Path) -> None:
    frames = ("tracker", "base")
    bag = write_bag(tmp_path / "bag", [("/smr", point(row, frames[row % 2])) for row in range(ROWS)])
    streams = imported(bag, RIG).streams
    np.testing.assert_allclose(streams["smr-base"].values["position_m"], POINTS_M[1::2])


LEFT = tuple(f"left_joint_a{k}" for k in range(1, 8))
RIGHT = tuple(f"right_joint_a{k}" for k in range(1, 8))
PANDA = tuple(f"panda_joint{k}" for k in range(1, 8))
IIWA = tuple(f"lbr7_A{k}_axis" for k in range(7))  # counted from 0, with a number in the prefix
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")


@pytest.mark.parametrize(
    ("names", "others"),
    [(LEFT, ()), (LEFT, ("left_gripper",)), (PANDA, FINGERS), (IIWA, ()), (IIWA, ("lbr7_lift",))],
    ids=["alone", "gripper", "fingers", "from 0", "from 0 and a lift"],
)
def test_joints_with_a_prefix_are_taken_by_their_number(
    tmp_path: Path, names: Sequence[str], others: Sequence[str]
) -> None:
    order = RNG.permutation(7 + len(others))
    every = [*names, *others]
    angles_rad = np.column_stack([ANGLES_RAD, *[np.full(ROWS, 0.02)] * len(others)])
    states = [
        ("/joint_states", joint_state(row, [every[k] for k in order], angles_rad[row, order])) for row in range(ROWS)
    ]
    bag = write_bag(tmp_path / "bag", states)
    stream = imported(bag, seven_axes(tmp_path)).streams["joint_states"]
    np.testing.assert_allclose(stream.values["actual_q_rad"], ANGLES_RAD)
    for name in others:
        assert f"{name}_rad" in stream.values


UR = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")


def test_joints_of_universal_robots_with_a_prefix_are_ordered(tmp_path: Path) -> None:
    names = [f"left_{name}_joint" for name in UR]
    order = (2, 1, 0, 3, 4, 5)
    states = [("/joint_states", joint_state(r, [names[k] for k in order], ANGLES_RAD[r, order])) for r in range(ROWS)]
    bag = write_bag(tmp_path / "bag", states)
    stream = imported(bag, RIG).streams["joint_states"]
    np.testing.assert_allclose(stream.values["actual_q_rad"], ANGLES_RAD[:, :6])


def two_arms(tmp_path: Path) -> Path:
    both = np.column_stack([ANGLES_RAD, -ANGLES_RAD])
    states = [("/joint_states", joint_state(row, (*LEFT, *RIGHT), both[row])) for row in range(ROWS)]
    return write_bag(tmp_path / "bag", states)


def test_two_arms_in_one_message_need_a_statement(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert import_bag(two_arms(tmp_path), seven_axes(tmp_path)) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "q may be left_joint_a1 … left_joint_a7 or right_joint_a1 … right_joint_a7" in said
    assert '--columns "left_joint_a1..left_joint_a7 = q"' in said
    assert not (tmp_path / "log.mcap").exists()


def test_one_of_two_arms_is_stated(tmp_path: Path) -> None:
    bag = two_arms(tmp_path)
    stream = imported(bag, seven_axes(tmp_path), "--columns", "right_joint_a1..right_joint_a7 = q").streams
    np.testing.assert_allclose(stream["joint_states"].values["actual_q_rad"], -ANGLES_RAD)


def test_topics_that_are_not_taken_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = TYPES["std_msgs/msg/String"]
    messages: list[Message] = [("/smr", point(row)) for row in range(ROWS)]
    messages += [("/diagnostics", text("all is well")) for _ in range(7)]
    bag = write_bag(tmp_path / "bag", messages)
    imported(bag, RIG)
    assert "topic /diagnostics (std_msgs/msg/String), 7 messages" in " ".join(capsys.readouterr().out.split())
    kept = {"kind": "topic", "name": "/diagnostics", "type": "std_msgs/msg/String", "count": 7}
    assert kept in columns_of(bag)[0]["not_taken"]


def test_speeds_of_a_joint_state_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kind = TYPES["sensor_msgs/msg/JointState"]
    states = [
        ("/joint_states", kind(header(r), [f"joint_{k}" for k in range(1, 7)], ANGLES_RAD[r, :6], np.ones(6), EMPTY))
        for r in range(ROWS)
    ]
    bag = write_bag(tmp_path / "bag", states)
    imported(bag, RIG)
    said = " ".join(capsys.readouterr().out.split())
    assert f"field velocity of /joint_states (sensor_msgs/msg/JointState), {ROWS} messages" in said
    assert "field effort" not in said


def test_a_bag_without_a_known_topic_names_what_it_holds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = TYPES["std_msgs/msg/String"]
    bag = write_bag(tmp_path / "bag", [("/diagnostics", text("all is well"))] * 3)
    assert import_bag(bag, RIG) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "/diagnostics (std_msgs/msg/String), 3 messages" in said
    assert "PointStamped" in said


def test_a_bag_of_joints_without_an_order_alone_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ("waist", "arm", "fore", "roll", "bend", "twist")
    bag = write_bag(tmp_path / "bag", [("/js", joint_state(r, names, ANGLES_RAD[r, :6])) for r in range(ROWS)])
    assert import_bag(bag, RIG) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "waist [rad], arm [rad], fore [rad]" in said
    assert "--columns" in said
    assert not (tmp_path / "log.mcap").exists()
    stated = imported(bag, RIG, "--columns", "waist arm fore roll bend twist = q").streams["js"]
    np.testing.assert_allclose(stated.values["actual_q_rad"], ANGLES_RAD[:, :6])


def test_transforms_and_points_of_a_bag_of_ros_1_are_taken(tmp_path: Path) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    kinds = {"/vicon": "geometry_msgs/msg/TransformStamped", "/smr": "geometry_msgs/msg/PointStamped"}
    with OldWriter(tmp_path / "robot.bag") as bag:
        topics = {topic: bag.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}
        for row in range(ROWS):
            now = types["builtin_interfaces/msg/Time"](1_700_000_000, 10_000_000 * row)
            at = types["std_msgs/msg/Header"](row, now, "tracker")
            turned = types["geometry_msgs/msg/Quaternion"](*TURNS[row].as_quat())
            both = types["geometry_msgs/msg/Transform"](types["geometry_msgs/msg/Vector3"](*POINTS_M[row]), turned)
            messages = {
                "/vicon": types[kinds["/vicon"]](at, "flange", both),
                "/smr": types[kinds["/smr"]](at, types["geometry_msgs/msg/Point"](*POINTS_M[row])),
            }
            for topic, message in messages.items():
                data = store.serialize_ros1(message, kinds[topic])
                bag.write(topics[topic], 1_700_000_000 * 10**9 + row * 10_000_000, data)
    streams = imported(tmp_path / "robot.bag", RIG).streams
    np.testing.assert_allclose(streams["vicon"].values["position_m"], POINTS_M)
    np.testing.assert_allclose(streams["smr"].values["position_m"], POINTS_M)


def test_an_arm_and_its_gripper_on_two_topics(tmp_path: Path) -> None:
    fingers = [("/gripper/joint_states", joint_state(r, ("finger_1", "finger_2"), (0.01, 0.01))) for r in range(ROWS)]
    arm = [
        ("/joint_states", joint_state(r, [f"joint_{k}" for k in range(1, 7)], ANGLES_RAD[r, :6])) for r in range(ROWS)
    ]
    bag = write_bag(tmp_path / "bag", [*arm, *fingers])
    streams = imported(bag, RIG).streams
    np.testing.assert_allclose(streams["joint_states"].values["actual_q_rad"], ANGLES_RAD[:, :6])
    assert "finger_1_rad" in streams["gripper-joint_states"].values


@pytest.mark.parametrize("stated", ["q1..q6 [rad] = q", "'q1 [rad]' 'q2 [rad]' 'q3 [rad]' q4 q5 q6 [rad] = q"])
def test_statements_with_the_headings_of_earlier_versions_stay_valid(tmp_path: Path, stated: str) -> None:
    names = ("base_1", "shoulder_2", "elbow_3", "roll_4", "bend_5", "twist_6")
    states = [("/joint_states", joint_state(row, names[::-1], ANGLES_RAD[row, 5::-1])) for row in range(ROWS)]
    bag = write_bag(tmp_path / "bag", states)
    for more in ((), ("--columns", stated)):
        stream = imported(bag, RIG, *more).streams["joint_states"]
        np.testing.assert_allclose(stream.values["actual_q_rad"], ANGLES_RAD[:, :6])
        (tmp_path / "log.mcap").unlink()
    assert "base_1 [rad]" in columns_of(bag)[0]["columns"][0]["headings"]


def test_joints_of_a_larger_arm_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    states = [("/joint_states", joint_state(row, PANDA, ANGLES_RAD[row])) for row in range(ROWS)]
    points = [("/smr", point(row)) for row in range(ROWS)]
    bag = write_bag(tmp_path / "bag", [*states, *points])
    assert import_bag(bag, RIG) == 1
    assert "7 joint angles (panda_joint1 [rad] … panda_joint7 [rad]) for an arm of 6" in " ".join(
        capsys.readouterr().err.split()
    )
