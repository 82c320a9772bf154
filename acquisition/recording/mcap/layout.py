"""Protobuf messages whose fields are known only at run time: descriptor, class and the bytes that go into the file.

Descriptor and message name are embedded in the MCAP schema (encoding "protobuf", a serialized FileDescriptorSet:
https://mcap.dev/spec/registry), so any reader decodes the recording without this program.
"""

import enum
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.descriptor_pb2 import FieldDescriptorProto
from google.protobuf.message import Message


class FieldType(enum.Enum):
    """What one field holds; the values are protobuf's own."""

    DOUBLE = FieldDescriptorProto.TYPE_DOUBLE
    INT64 = FieldDescriptorProto.TYPE_INT64
    STRING = FieldDescriptorProto.TYPE_STRING


class Presence(enum.Enum):
    """How often a field stands in one message."""

    ONCE = "once"
    OPTIONAL = "optional"  # absence is told from zero
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
