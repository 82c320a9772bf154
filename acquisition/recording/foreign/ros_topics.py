"""Topics of a bag of ROS as tables: one a topic, a row a message."""

import importlib
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from acquisition.recording.errors import RecordingError, shown
from acquisition.recording.foreign.sheet import Raw, Sheet
from acquisition.recording.mcap.scan import check_batches

JOINT_STATE, POSE_STAMPED = "sensor_msgs/msg/JointState", "geometry_msgs/msg/PoseStamped"
# Universal Robots' own names, which their driver does not send in this order: ur_description, urdf/ur_macro.xacro
UR_JOINTS = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
_NUMBERED = re.compile(r".*?(\d+)\D*")
OBJECT_BYTES, MESSAGE_BYTES = 400_000_000, 1500  # of all messages of a bag in memory, of a short one
ROS_1 = ".bag"


def read_bag(path: Path) -> list[Sheet]:
    """Each topic of joint states and stamped poses of a bag as a table: of ROS 2, or a file of ROS 1."""
    old = path.suffix.lower() == ROS_1
    reader = importlib.import_module("rosbags.rosbag1" if old else "rosbags.rosbag2")
    types = importlib.import_module("rosbags.typesys")
    if not path.exists():
        raise RecordingError(f"{path}: no such bag; check the path")
    try:
        store = types.get_typestore(types.Stores.ROS1_NOETIC if old else types.Stores.ROS2_HUMBLE)
        message_of = store.deserialize_ros1 if old else store.deserialize_cdr
        files = [one for one in path.rglob("*") if one.is_file()] if path.is_dir() else [path]
        for file in (one for one in files if one.suffix == ".mcap"):
            check_batches(file)
        with reader.Reader(path) as bag:
            there = sorted({f"{c.topic} ({c.msgtype})" for c in bag.connections})
            wanted = [c for c in bag.connections if c.msgtype in (JOINT_STATE, POSE_STAMPED)]
            rows: dict[str, list[tuple[int, Any]]] = {c.topic: [] for c in wanted}
            left = max(OBJECT_BYTES, 16 * sum(one.stat().st_size for one in files))
            for connection, received_ns, raw in bag.messages(connections=wanted):
                left -= MESSAGE_BYTES + 2 * len(raw)
                if left < 0:
                    raise ValueError(
                        f"more than {len(rows[connection.topic])} messages of '{connection.topic}': take a part of it"
                    )
                rows[connection.topic].append((received_ns, message_of(raw, connection.msgtype)))
    except Exception as error:  # of damaged bytes the libraries below raise whatever they stumble over
        raise RecordingError(
            f"{path}: no bag of ROS that can be read ({shown(str(error) or type(error).__name__, 80)}); check the path"
        ) from error
    if not wanted:
        raise RecordingError(
            f"{path}: no topic of {JOINT_STATE} or {POSE_STAMPED}; there are {shown(', '.join(there)) or 'none'}"
        )
    kinds = {c.topic: c.msgtype for c in wanted}
    made = [(_joint_table if kinds[topic] == JOINT_STATE else _pose_table)(path, topic, r) for topic, r in rows.items()]
    if not (filled := [sheet for sheet in made if sheet.rows]):
        raise RecordingError(f"{path}: no message on {shown(', '.join(rows))}; record the topics, or check the bag")
    return filled


def _joint_table(path: Path, topic: str, messages: Sequence[tuple[int, Any]]) -> Sheet:
    names = list(messages[0][1].name) if messages else []
    headings = [f"{heading} [rad]" for heading in _joint_headings(names)]
    rows: list[tuple[Raw, ...]] = []
    for row, (received_ns, message) in enumerate(messages, start=1):
        if list(message.name) != names or len(message.position) != len(names):
            raise RecordingError(
                f"{path} topic '{topic}' message {row}: joints {shown(', '.join(message.name))} with "
                f"{len(message.position)} positions, before {shown(', '.join(names))}; record one set of joints a topic"
            )
        rows.append((received_ns, _stamp_s(message), *map(float, message.position)))
    return _topic(path, topic, headings, rows)


def _joint_headings(names: list[str]) -> list[str]:
    """q1, q2, ... where the names show the order: numbers, or the maker's; else the names, for a person to order."""
    if set(names) == set(UR_JOINTS):
        return [f"q{UR_JOINTS.index(name) + 1}" for name in names]
    found = [match for name in names if (match := _NUMBERED.fullmatch(name))]
    numbers = [int(match[1]) for match in found]
    if sorted(numbers) == list(range(1, len(names) + 1)):
        return [f"q{number}" for number in numbers]
    return names


def _pose_table(path: Path, topic: str, messages: Sequence[tuple[int, Any]]) -> Sheet:
    headings = ["x [m]", "y [m]", "z [m]", "qx", "qy", "qz", "qw"]
    rows: list[tuple[Raw, ...]] = []
    for received_ns, message in messages:
        p, q = message.pose.position, message.pose.orientation
        rows.append((received_ns, _stamp_s(message), p.x, p.y, p.z, q.x, q.y, q.z, q.w))
    return _topic(path, topic, headings, rows)


def _topic(path: Path, topic: str, headings: Sequence[str], rows: Sequence[tuple[Raw, ...]]) -> Sheet:
    names = ("host [ns]", "device [s]", *headings)
    return Sheet(path, topic, names, ("",) * len(names), tuple(rows), tuple(range(1, len(rows) + 1)))


def _stamp_s(message: Any) -> float:
    """The stamp of the header; NaN where it was never set."""
    stamp = message.header.stamp
    return stamp.sec + 1e-9 * stamp.nanosec if stamp.sec or stamp.nanosec else math.nan
