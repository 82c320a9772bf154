"""From the records of a file to streams, samples, events: decodes with the descriptors that the file itself holds."""

import math
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import msgspec
import numpy as np
from google.protobuf.message import DecodeError
from mcap.records import Channel as McapChannel
from mcap.records import Message, Metadata, Schema

from acquisition.recording.files.bounds import TIME_S, Label, Name, Statistic
from acquisition.recording.layout import (
    CHECKSUM,
    EVENTS_TOPIC,
    GAPS_TOPIC,
    SAMPLES_TOPIC,
    STREAM_METADATA,
    STREAM_TOPIC,
    checksum,
)
from acquisition.recording.mcap.layout import MessageType, embedded_type
from acquisition.recording.samples import Cell
from acquisition.recording.stream import Channel, Event, Gap, Stream

_CLOCKS = ("host_s", "device_s", "sequence")


class _ChannelRow(msgspec.Struct):
    """A channel as it is declared in the file."""

    name: Name
    unit: Label
    shape: tuple[Annotated[int, msgspec.Meta(ge=1, le=1_000_000)], ...]
    resolution: Statistic
    full_scale: Statistic = float("inf")


class Content:
    """Collects what a file holds, record by record; the owner of the reading."""

    def __init__(self) -> None:
        self.metadata: dict[str, Mapping[str, str]] = {}
        self.rows: list[Mapping[str, Cell]] = []
        self.columns: dict[str, None] = {}  # in the order of their first appearance
        self.events: list[Event] = []
        self.undecodable = 0
        self._types: dict[int, MessageType] = {}
        self._channels: dict[int, tuple[McapChannel, Callable[[McapChannel, Any], None] | None]] = {}
        self._declared: dict[str, tuple[Channel, ...]] = {}
        self._pieces: dict[str, list[dict[str, np.ndarray[Any, Any]]]] = {}
        self._gaps: dict[str, list[Gap]] = {}

    def take(self, record: object) -> None:
        """One record of the file; a message that its own descriptor does not fit is counted and left out."""
        try:
            if isinstance(record, Metadata):
                self._take_metadata(record)
            elif isinstance(record, Schema):
                self._types[record.id] = embedded_type(record.name, record.data)
            elif isinstance(record, McapChannel):
                self._take_channel(record)
            elif isinstance(record, Message):
                self._take_message(record)
        except (DecodeError, TypeError, KeyError, ValueError, AttributeError):
            self.undecodable += 1

    def streams(self) -> dict[str, Stream]:
        """Every declared stream, also those that stayed silent."""
        return {name: self._stream(name, channels) for name, channels in self._declared.items()}

    def _take_metadata(self, record: Metadata) -> None:
        values = dict(record.metadata)
        if values.pop(CHECKSUM, None) not in (None, checksum(values)):  # None: of an older version, which wrote none
            raise ValueError(f"the record '{record.name}' does not fit its checksum")
        self.metadata[record.name] = values
        if record.name.startswith(STREAM_METADATA):
            self._declare(record.name.removeprefix(STREAM_METADATA), record.metadata["channels"])

    def _declare(self, name: str, channels_json: str) -> None:
        rows = msgspec.json.decode(channels_json, type=list[_ChannelRow])
        channels = (Channel(row.name, row.unit, row.shape, row.full_scale, row.resolution) for row in rows)
        self._declared[name] = tuple(channels)

    def _take_channel(self, record: McapChannel) -> None:
        self._channels[record.id] = record, self._taker(record.topic)
        if record.topic.startswith(STREAM_TOPIC):  # stands under a checksum, unlike the metadata record
            self._declare(record.topic.removeprefix(STREAM_TOPIC), record.metadata["channels"])

    def _taker(self, topic: str) -> Callable[[McapChannel, Any], None] | None:
        if topic.startswith(STREAM_TOPIC):
            return self._take_batch
        return {SAMPLES_TOPIC: self._take_sample, EVENTS_TOPIC: self._take_event, GAPS_TOPIC: self._take_gap}.get(topic)

    def _take_message(self, record: Message) -> None:
        channel, take = self._channels[record.channel_id]
        if take is not None:
            take(channel, self._types[channel.schema_id].new.FromString(record.data))

    def _take_batch(self, channel: McapChannel, batch: Any) -> None:
        name = channel.topic.removeprefix(STREAM_TOPIC)
        sizes = dict.fromkeys(_CLOCKS, 1) | {
            declared.name: math.prod(declared.shape) for declared in self._declared[name]
        }
        piece = {field: np.array(getattr(batch, field)) for field in sizes}
        if any(piece[field].size != size * len(batch.host_s) for field, size in sizes.items()):
            raise ValueError("the arrays of one batch are of different lengths")
        if not np.all(np.abs(piece["host_s"]) <= TIME_S) or np.any(np.abs(piece["device_s"]) > TIME_S):
            raise ValueError("a time stamp of the batch is beyond what 64 bits of nanoseconds hold")
        self._pieces.setdefault(name, []).append(piece)

    def _take_sample(self, channel: McapChannel, sample: Any) -> None:
        fields = msgspec.json.decode(channel.metadata["columns"], type=dict[str, str])
        self.columns |= dict.fromkeys(fields)
        self.rows.append(
            {column: getattr(sample, field) if sample.HasField(field) else None for column, field in fields.items()}
        )

    def _take_event(self, channel: McapChannel, event: Any) -> None:
        self.events.append(Event(event.host_s, event.kind, msgspec.json.decode(event.detail_json, type=dict[str, Any])))

    def _take_gap(self, channel: McapChannel, gap: Any) -> None:
        self._gaps.setdefault(gap.stream, []).append(Gap(gap.from_s, gap.to_s, gap.missing, gap.reason))

    def _stream(self, name: str, channels: tuple[Channel, ...]) -> Stream:
        pieces = self._pieces.get(name, [])
        joined = {
            field: np.concatenate([piece[field] for piece in pieces]) if pieces else np.empty(0)
            for field in (*_CLOCKS, *(channel.name for channel in channels))
        }
        return Stream(
            name,
            channels,
            joined["host_s"],
            joined["device_s"],
            joined["sequence"].astype(np.int64),
            {channel.name: joined[channel.name].reshape(-1, *channel.shape) for channel in channels},
            tuple(self._gaps.get(name, ())),
        )
