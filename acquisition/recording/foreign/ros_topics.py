"""Topics of a bag of ROS as tables: joint states, points, poses and transforms, a row a message.

A topic on which several frames or bodies are sent becomes one table for each of them: positions in two frames are no
stream. Topics of other types, and the speeds and efforts of a joint state, are named as not taken.

The fields of the messages: common_interfaces, sensor_msgs and geometry_msgs of ROS 2 Humble and ROS 1 Noetic.
"""

import importlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from acquisition.recording.errors import RecordingError, shown
from acquisition.recording.foreign.column_meanings import UR_JOINTS, last_number
from acquisition.recording.foreign.sheet import NotTaken, Raw, Sheet
from acquisition.recording.mcap.scan import check_batches

JOINT_STATE = "sensor_msgs/msg/JointState"
POSE_STAMPED, POINT_STAMPED, TRANSFORM_STAMPED = (
    f"geometry_msgs/msg/{name}Stamped" for name in ("Pose", "Point", "Transform")
)
ROS_1 = ".bag"
OBJECT_BYTES, MESSAGE_BYTES = 400_000_000, 1500  # of all messages of a bag in memory, of a short one
FRAMES = 100  # frames or bodies of one topic, at most
_XYZ, _XYZW = ("x [m]", "y [m]", "z [m]"), ("qx", "qy", "qz", "qw")

Messages = Sequence[tuple[int, Any]]  # when each was received, in ns, and itself


def read_bag(path: Path) -> list[Sheet]:
    """Each topic of a type in READERS as one table or several: of a bag of ROS 2, or a file of ROS 1.

    The first table names what was not taken. RecordingError for a bag that cannot be read, and one of other types.
    """
    if not path.exists():
        raise RecordingError(f"{path}: no such bag; check the path")
    messages, kinds, others = _messages(path)
    held = "; ".join(one.says for one in others)
    if not kinds:
        known, there = ", ".join(READERS), shown(held, 400) or "none"
        raise RecordingError(f"{path}: no topic of {known}; there are {there}; record such a topic")
    made = [sheet for topic, kind in kinds.items() for sheet in READERS[kind](path, topic, messages[topic])]
    filled = [sheet for sheet in made if sheet.rows]
    if not filled:
        more = f", and not taken are {shown(held, 400)}" if held else ""
        raise RecordingError(
            f"{path}: no message on {shown(', '.join(messages))}{more}; record the topics, or check the bag"
        )
    empty = [NotTaken("topic", topic, kinds[topic], 0) for topic, rows in messages.items() if not rows]
    return [replace(filled[0], not_taken=(*others, *empty, *filled[0].not_taken)), *filled[1:]]


def _messages(path: Path) -> tuple[dict[str, list[tuple[int, Any]]], dict[str, str], list[NotTaken]]:
    """Messages and types of the topics of a known type, and the other topics."""
    old = path.suffix.lower() == ROS_1
    reader = importlib.import_module("rosbags.rosbag1" if old else "rosbags.rosbag2")
    types = importlib.import_module("rosbags.typesys")
    rows: dict[str, list[tuple[int, Any]]] = {}
    kinds: dict[str, str] = {}
    try:
        store = types.get_typestore(types.Stores.ROS1_NOETIC if old else types.Stores.ROS2_HUMBLE)
        message_of = store.deserialize_ros1 if old else store.deserialize_cdr
        files = [one for one in path.rglob("*") if one.is_file()] if path.is_dir() else [path]
        for file in (one for one in files if one.suffix == ".mcap"):
            check_batches(file)
        left = max(OBJECT_BYTES, 16 * sum(one.stat().st_size for one in files))
        with reader.Reader(path) as bag:
            for connection in bag.connections:
                if connection.msgtype in READERS and connection.topic not in kinds:
                    kinds[connection.topic], rows[connection.topic] = connection.msgtype, []
            wanted = [c for c in bag.connections if kinds.get(c.topic) == c.msgtype]
            others = _other_topics([c for c in bag.connections if c not in wanted])
            for connection, received_ns, raw in bag.messages(connections=wanted) if wanted else ():
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
    return rows, kinds, others


def _other_topics(connections: Sequence[Any]) -> list[NotTaken]:
    """One entry for each topic and type, with its messages."""
    counts: dict[tuple[str, str], int] = {}
    for one in connections:
        place = (str(one.topic), str(one.msgtype))
        counts[place] = counts.get(place, 0) + int(one.msgcount)
    return [NotTaken("topic", topic, kind, count) for (topic, kind), count in sorted(counts.items())]


def _joint_tables(path: Path, topic: str, messages: Messages) -> Iterator[Sheet]:
    names = list(messages[0][1].name) if messages else []
    headings = [f"{name} [rad]" for name in names]
    rows: list[tuple[Raw, ...]] = []
    for row, (received_ns, message) in enumerate(messages, start=1):
        if list(message.name) != names or len(message.position) != len(names):
            raise RecordingError(
                f"{path} topic '{topic}' message {row}: joints {shown(', '.join(message.name))} with "
                f"{len(message.position)} positions, before {shown(', '.join(names))}; record one set of joints a topic"
            )
        rows.append((received_ns, _stamp_s(message), *map(float, message.position)))
    made = _topic(path, topic, headings, rows)
    fields = {name: sum(1 for _, one in messages if len(getattr(one, name))) for name in ("velocity", "effort")}
    left = tuple(NotTaken("field", f"{name} of {topic}", JOINT_STATE, count) for name, count in fields.items() if count)
    first = len(made.headings) - len(headings)
    earlier = _earlier_headings(names)
    yield replace(
        made,
        not_taken=left,
        joint_columns=tuple(range(first, len(made.headings))),
        aliases=(*made.headings[:first], *earlier) if earlier else (),
    )


def _earlier_headings(names: Sequence[str]) -> tuple[str, ...]:
    """q1 [rad], q2 [rad], ... of joints that their numbers or their maker order: the headings of earlier versions.

    Statements that were written with such a recording stay valid. Empty: the names show no order.
    """
    if set(names) == set(UR_JOINTS):
        return tuple(f"q{UR_JOINTS.index(name) + 1} [rad]" for name in names)
    numbers = [last_number(name) for name in names]
    if sorted(number or 0 for number in numbers) == list(range(1, len(names) + 1)):
        return tuple(f"q{number} [rad]" for number in numbers)
    return ()


def _point_tables(path: Path, topic: str, messages: Messages) -> Iterator[Sheet]:
    def cells(message: Any) -> tuple[float, ...]:
        return message.point.x, message.point.y, message.point.z

    yield from _tables_of_frames(path, topic, messages, _XYZ, cells)


def _pose_tables(path: Path, topic: str, messages: Messages) -> Iterator[Sheet]:
    def cells(message: Any) -> tuple[float, ...]:
        p, q = message.pose.position, message.pose.orientation
        return p.x, p.y, p.z, q.x, q.y, q.z, q.w

    yield from _tables_of_frames(path, topic, messages, (*_XYZ, *_XYZW), cells)


def _transform_tables(path: Path, topic: str, messages: Messages) -> Iterator[Sheet]:
    def cells(message: Any) -> tuple[float, ...]:
        p, q = message.transform.translation, message.transform.rotation
        return p.x, p.y, p.z, q.x, q.y, q.z, q.w

    yield from _tables_of_frames(path, topic, messages, (*_XYZ, *_XYZW), cells)


READERS: Mapping[str, Callable[[Path, str, Messages], Iterator[Sheet]]] = {
    JOINT_STATE: _joint_tables,
    POSE_STAMPED: _pose_tables,
    POINT_STAMPED: _point_tables,
    TRANSFORM_STAMPED: _transform_tables,
}


def _tables_of_frames(
    path: Path, topic: str, messages: Messages, headings: Sequence[str], cells: Callable[[Any], tuple[float, ...]]
) -> Iterator[Sheet]:
    """One table for each frame, of transforms for each frame and body. RecordingError for more than FRAMES."""
    of_frames: dict[tuple[str, str], list[tuple[Raw, ...]]] = {}
    for received_ns, message in messages:
        frames = (str(message.header.frame_id), str(getattr(message, "child_frame_id", "")))
        of_frames.setdefault(frames, []).append((received_ns, _stamp_s(message), *cells(message)))
        if len(of_frames) > FRAMES:
            raise RecordingError(
                f"{path} topic '{topic}': more than {FRAMES} frames or bodies; record those of the robot alone"
            )
    for (parent, child), rows in of_frames.items():
        name = topic if len(of_frames) == 1 else "/".join(part for part in (topic, parent, child) if part)
        what = "position" if len(headings) == len(_XYZ) else f"pose of '{shown(child, 60)}'" if child else "pose"
        note = f"{what} in frame '{shown(parent, 60)}'" if parent else f"{what}; its frame is not named"
        yield replace(_topic(path, name, headings, rows), notes=(note,))


def _topic(path: Path, topic: str, headings: Sequence[str], rows: Sequence[tuple[Raw, ...]]) -> Sheet:
    names = ("host [ns]", "device [s]", *headings)
    return Sheet(path, topic, names, ("",) * len(names), tuple(rows), tuple(range(1, len(rows) + 1)))


def _stamp_s(message: Any) -> float:
    """The stamp of the header; NaN where it was never set."""
    stamp = message.header.stamp
    return stamp.sec + 1e-9 * stamp.nanosec if stamp.sec or stamp.nanosec else math.nan
