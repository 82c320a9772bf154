"""Names and messages inside the file: topics, metadata records, keys (docs/formats.md lists them for other readers).

The fields of the protobuf messages are known only at run time. Descriptor and message name are embedded in the MCAP
schema (encoding "protobuf", a serialized FileDescriptorSet: https://mcap.dev/spec/registry), so any reader decodes the
recording without this program.
"""

import enum
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.descriptor_pb2 import FieldDescriptorProto
from google.protobuf.message import Message

from acquisition.recording.recording import Channel, scalar_names


class FieldType(enum.Enum):
    """What one field holds; the values are protobuf's own."""

    DOUBLE = FieldDescriptorProto.TYPE_DOUBLE
    INT64 = FieldDescriptorProto.TYPE_INT64
    STRING = FieldDescriptorProto.TYPE_STRING


class Presence(enum.Enum):
    """How often a field stands in one message."""

    ONCE = "once"
    OPTIONAL = "optional"  # absence is distinguished from zero
    REPEATED = "repeated"  # packed


@dataclass(frozen=True)
class Field:
    """One field of a message; its number is its place in the list."""

    name: str
    type: FieldType
    presence: Presence = Presence.ONCE


@dataclass(frozen=True)
class MessageType:
    """A message that can be made, written and read back."""

    name: str  # "calibeam.psd_batch"
    descriptor_set: bytes
    new: type[Message]


@lru_cache(maxsize=64)
def message_type(name: str, fields: tuple[Field, ...]) -> MessageType:
    """The message `calibeam.<name>` with these fields, numbered from 1; the same one when asked again.

    A log of days has the same messages in every segment, and protobuf never frees the classes of its messages at once.
    """
    file = descriptor_pb2.FileDescriptorProto(name=f"calibeam/{name}.proto", package="calibeam", syntax="proto3")
    message = file.message_type.add(name=name)
    for number, field in enumerate(fields, start=1):
        declared = message.field.add(name=field.name, number=number, type=field.type.value)
        declared.label = FieldDescriptorProto.LABEL_OPTIONAL
        if field.presence is Presence.REPEATED:
            declared.label = FieldDescriptorProto.LABEL_REPEATED  # proto3 packs numbers by default
        elif field.presence is Presence.OPTIONAL:
            declared.proto3_optional = True
            declared.oneof_index = len(message.oneof_decl)
            message.oneof_decl.add(name=f"_{field.name}")
    descriptor_set = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
    return embedded_type(f"calibeam.{name}", descriptor_set)


def embedded_type(name: str, descriptor_set: bytes) -> MessageType:
    """The message of a descriptor set as found in a file. DecodeError, TypeError or KeyError if it is none."""
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(descriptor_set).file:
        pool.Add(file)
    return MessageType(name, descriptor_set, message_factory.GetMessageClass(pool.FindMessageTypeByName(name)))


def packed(kind: MessageType, values: dict[str, Any]) -> bytes:
    """One message as bytes; a missing name leaves its field out."""
    return kind.new(**values).SerializeToString()


EVENT = message_type(
    "event",
    (Field("host_s", FieldType.DOUBLE), Field("kind", FieldType.STRING), Field("detail_json", FieldType.STRING)),
)
GAP = message_type(
    "gap",
    (
        Field("stream", FieldType.STRING),
        Field("from_s", FieldType.DOUBLE),
        Field("to_s", FieldType.DOUBLE),
        Field("missing", FieldType.INT64),
        Field("reason", FieldType.STRING),
    ),
)


FORMAT_VERSION = "1"
PROFILE = "calibeam"

STREAM_TOPIC = "stream/"  # + name of the stream: batches of samples
VIEW_TOPIC = "view/"  # + name of the stream: single samples for viewers
VIEW_S = 0.05  # 20 Hz: as fast as an eye follows a curve
SAMPLES_TOPIC = "samples"
EVENTS_TOPIC = "events"
GAPS_TOPIC = "gaps"

RECORDING_METADATA = "calibeam.recording"  # format_version, software, host, host_s0, started_utc
RIG_METADATA = "calibeam.rig"  # text, sha256
NOTES_METADATA = "calibeam.notes"  # whatever the caller wants kept: seeds, plan, operator
STREAM_METADATA = "calibeam.stream."  # + name of the stream: channels
RECOVERY_METADATA = "calibeam.recovery"  # source, damage (JSON list): of a file made by `recover`
END_METADATA = "calibeam.end"  # complete: "true" or "false"

MOTION_NOTE = "motion_plan"  # note of a motion that was run for its torques, with its text: no samples either
STREAMS_NOTE = "imported_streams"  # note of an import of logs: there are no samples in it
READINGS_NOTE = "encoder_readings"  # note of an import of CAN frames: what is wrong with the angles, a line each
SEGMENT_NOTE, BEFORE_NOTE = "segment", "segment_before"  # notes of a log: its number, the file that it goes on after
CHECKSUM = "crc32"  # key in every metadata record: of its other keys and values, eight hexadecimal digits


def checksum(values: Mapping[str, str]) -> str:
    """Of a metadata record: CRC-32 of "key=value" and a line feed each, sorted by key, UTF-8."""
    text = "".join(f"{key}={value}\n" for key, value in sorted(values.items()) if key != CHECKSUM)
    return f"{zlib.crc32(text.encode()):08x}"


def view_type(stream: str, names: tuple[str, ...]) -> MessageType:
    """The message of a stream's view: one number a name, `host_s` among them."""
    return message_type(f"{stream.replace('-', '_')}_view", tuple(Field(name, FieldType.DOUBLE) for name in names))


def element_names(name: str, shape: tuple[int, ...]) -> tuple[str, ...]:
    """Names in a view of the elements of a channel."""
    return scalar_names(Channel(name, "", shape))


def log_ns(host_s: float) -> int:
    """Host time in the file's unit; MCAP has no negative times."""
    return max(0, round(host_s * 1e9))
