"""Opens a recording: one file, whole or torn off at any byte, a session of several parts, or a session folder.

`Content` turns the records of a file into streams, samples and events with the descriptors that the file itself holds.
"""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from google.protobuf.message import DecodeError
from mcap.records import Channel as McapChannel
from mcap.records import Header, Message, Metadata, Schema

from acquisition.recording.errors import RecordingError
from acquisition.recording.files.bounds import FEW, TABLE_CELLS, TIME_S, Label, Name, Statistic
from acquisition.recording.mcap.layout import (
    CHECKSUM,
    END_METADATA,
    EVENTS_TOPIC,
    FORMAT_VERSION,
    GAPS_TOPIC,
    NOTES_METADATA,
    PROFILE,
    RECORDING_METADATA,
    RECOVERY_METADATA,
    RIG_METADATA,
    SAMPLES_TOPIC,
    STREAM_METADATA,
    STREAM_TOPIC,
    MessageType,
    checksum,
    embedded_type,
)
from acquisition.recording.mcap.scan import Scan
from acquisition.recording.mcap.session_parts import joined, parts
from acquisition.recording.recording import STAMPS, Channel, Event, Gap, Recording, Stamps, Stream
from acquisition.recording.rig import Rig, parse_rig, rig_sha256
from acquisition.recording.sample_rules import checked_samples, no_samples
from acquisition.recording.samples import Cell, Samples
from acquisition.recording.session_folder import CSV, PARQUET, RIG, read_folder

# Suffixes of what another program wrote, which `calibeam import` takes
FOREIGN = {
    **dict.fromkeys((".xlsx", ".xlsm", ".csv", ".tsv", ".txt", ".parquet"), "table"),
    **dict.fromkeys((".blf", ".asc", ".log"), "CAN log"),
    ".db3": "ROS 2 bag",
    ".bag": "ROS 1 bag",
}
_CLOCKS = ("host_s", "device_s", "sequence")


class _ChannelRow(msgspec.Struct):
    """A channel as it is declared in the file."""

    name: Name
    unit: Label
    shape: tuple[Annotated[int, msgspec.Meta(ge=1, le=1_000_000)], ...]
    resolution: Statistic
    full_scale: Statistic = float("inf")


class _Growing:
    """One field of a stream, batch after batch, without an object for each."""

    def __init__(self) -> None:
        self._bytes, self._kind = bytearray(), np.dtype(np.float64)

    def append(self, values: np.ndarray[Any, Any]) -> None:
        if values.size:  # of an empty list the kind is not known
            self._kind = values.dtype
            self._bytes += values.tobytes()

    def takes(self, values: np.ndarray[Any, Any]) -> bool:
        """Whether they are numbers, and of the kind that is there."""
        known = values.dtype.kind in "fiu"
        return known and (not values.size or not self._bytes or values.dtype == self._kind)

    def array(self) -> np.ndarray[Any, Any]:
        return np.frombuffer(self._bytes, self._kind)


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
        self._stamps: dict[str, Stamps] = {}
        self._pieces: dict[str, dict[str, _Growing]] = {}
        self._cells = TABLE_CELLS  # of samples and events, that may still be taken
        self._gaps: dict[str, list[Gap]] = {}

    def take(self, record: object) -> None:
        """One record of the file; a message that its own descriptor does not fit is counted and left out."""
        try:
            if isinstance(record, Metadata):
                self._take_metadata(record)
            elif isinstance(record, Schema):
                self._take_type(record)
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
            self._declare(record.name.removeprefix(STREAM_METADATA), record.metadata)

    def _declare(self, name: str, about: Mapping[str, str]) -> None:
        rows = msgspec.json.decode(about["channels"], type=list[_ChannelRow])
        channels = (Channel(row.name, row.unit, row.shape, row.full_scale, row.resolution) for row in rows)
        self._declared[name] = tuple(channels)
        stated = about.get("stamps")  # older recordings state none
        self._stamps[name] = STAMPS[STAMPS.index(stated)] if stated in STAMPS else "unknown"

    def _take_type(self, record: Schema) -> None:
        """Other programs repeat a description in every batch."""
        known = self._types.get(record.id)
        if known is None or (known.name, known.descriptor_set) != (record.name, record.data):
            if len(self._types) >= FEW:
                raise ValueError(f"more than {FEW} descriptions of messages")
            self._types[record.id] = embedded_type(record.name, record.data)

    def _take_channel(self, record: McapChannel) -> None:
        self._channels[record.id] = record, self._taker(record.topic)
        if record.topic.startswith(STREAM_TOPIC):  # stands under a checksum, unlike the metadata record
            self._declare(record.topic.removeprefix(STREAM_TOPIC), record.metadata)

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
        pieces = self._pieces.setdefault(name, {})
        growing = {field: pieces.setdefault(field, _Growing()) for field in piece}
        if not all(growing[field].takes(values) for field, values in piece.items()):
            raise ValueError("the arrays of a field are of different kinds, or of none that are numbers")
        for field, values in piece.items():
            growing[field].append(values)

    def _take_sample(self, channel: McapChannel, sample: Any) -> None:
        fields = msgspec.json.decode(channel.metadata["columns"], type=dict[str, str])
        self._spend(max(len(fields), 8))
        self.columns |= dict.fromkeys(fields)
        self.rows.append(
            {column: getattr(sample, field) if sample.HasField(field) else None for column, field in fields.items()}
        )

    def _take_event(self, channel: McapChannel, event: Any) -> None:
        self._spend(8 + len(event.detail_json) // 2)
        self.events.append(Event(event.host_s, event.kind, msgspec.json.decode(event.detail_json, type=dict[str, Any])))

    def _take_gap(self, channel: McapChannel, gap: Any) -> None:
        self._spend(8)
        self._gaps.setdefault(gap.stream, []).append(Gap(gap.from_s, gap.to_s, gap.missing, gap.reason))

    def _spend(self, cells: int) -> None:
        """Objects take far more memory than bytes in a file. ValueError where there are too many."""
        if self._cells < cells:
            raise ValueError(f"more than {TABLE_CELLS} cells of samples, events and gaps")
        self._cells -= cells

    def _stream(self, name: str, channels: tuple[Channel, ...]) -> Stream:
        pieces = self._pieces.get(name, {})
        joined = {
            field: pieces[field].array() if field in pieces else np.empty(0)
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
            self._stamps[name],
        )


def read(path: Path | str) -> Recording:
    """A recording or a session folder. Of a torn or damaged file every complete batch, with `complete` False.

    A path to samples.csv or samples.parquet means its folder.

    A folder with recording.mcap and no rig.toml is all parts of that session together (session_parts.py).

    RecordingError when it is neither, or torn before the rig; RigFileError and SamplesError for what a folder holds.
    """
    path = Path(path)
    if path.name in (CSV, PARQUET):
        return read_folder(path.parent)
    if not path.is_dir():
        _refuse_foreign(path)
        return _read_mcap(path)
    files = [] if (path / RIG).is_file() else parts(path)
    return joined([_read_mcap(file) for file in files], path) if files else read_folder(path)


def _refuse_foreign(path: Path) -> None:
    """RecordingError naming the command that makes a session of what another program wrote."""
    kind = FOREIGN.get(path.suffix.lower())
    if kind is not None and path.is_file():
        out = path.with_suffix("" if kind == "table" else ".mcap")
        raise RecordingError(
            f"{path}: a {kind}, no recording; make a session of it first: calibeam import {path} --rig RIG.toml "
            f"--out {out}"
        )


def _read_mcap(path: Path) -> Recording:
    scan, content = Scan(path), Content()
    for record in scan.records():
        if isinstance(record, Header) and record.profile != PROFILE:
            raise RecordingError(
                f"{path}: an MCAP file of another program (profile '{record.profile}', library '{record.library}'); "
                "give a recording of calibeam, or make one of a ROS 2 bag: calibeam import"
            )
        content.take(record)
    about = _metadata(content, RECORDING_METADATA, path, scan)
    if about.get("format_version") != FORMAT_VERSION:
        raise RecordingError(
            f"{path}: format version {about.get('format_version')} is not known to this version, which reads "
            f"{FORMAT_VERSION}; use the calibeam that wrote it ({about.get('software')}) or a newer one"
        )
    rig_text = _rig_text(content, path, scan)
    rig = parse_rig(rig_text, f"{path} (rig)")
    damage = (*scan.damage, *_undecodable(content), *_before_recovery(content))
    ended = content.metadata.get(END_METADATA, {}).get("complete") == "true"
    return Recording(
        path=path,
        rig_text=rig_text,
        rig=rig,
        samples=_samples(content, rig, path),
        complete=ended and scan.whole and not damage,
        damage=damage,
        software=about.get("software", ""),
        host=about.get("host", ""),
        started_utc=about.get("started_utc", ""),
        host_s0=_host_s0(about, path),
        notes=dict(content.metadata.get(NOTES_METADATA, {})),
        streams=content.streams(),
        events=tuple(content.events),
    )


def _metadata(content: Content, name: str, path: Path, scan: Scan) -> Mapping[str, str]:
    if name not in content.metadata:
        why = scan.damage[0] if scan.damage else "the record was never written"
        raise RecordingError(
            f"{path}: '{name}' cannot be read ({why}), so nothing can be made of the rest; use a copy, "
            "or try `calibeam recover`"
        )
    return content.metadata[name]


def _host_s0(about: Mapping[str, str], path: Path) -> float:
    text = about.get("host_s0", "0")
    try:
        return float(text)
    except ValueError:
        raise RecordingError(f"{path}: host_s0 = '{text}' in the file is damaged; use a copy of the file") from None


def _rig_text(content: Content, path: Path, scan: Scan) -> str:
    record = _metadata(content, RIG_METADATA, path, scan)
    text = record.get("text", "")
    if rig_sha256(text) != record.get("sha256"):
        raise RecordingError(f"{path}: the rig in the file is damaged (its SHA-256 is another); use a copy of the file")
    return text


def _samples(content: Content, rig: Rig, path: Path) -> Samples:
    if not content.rows:
        return no_samples(rig)
    columns = {column: [row.get(column) for row in content.rows] for column in content.columns}
    return checked_samples(columns, rig, lambda row: str(path) if row is None else f"{path} sample {row + 1}")


def _before_recovery(content: Content) -> tuple[str, ...]:
    """What `recover` could not save, as the file that it made states it."""
    recovery = content.metadata.get(RECOVERY_METADATA, {})
    lost = msgspec.json.decode(recovery.get("damage", "[]"), type=list[str])
    return tuple(f"before its recovery from {recovery.get('source')}: {says}" for says in lost)


def _undecodable(content: Content) -> tuple[str, ...]:
    count = content.undecodable
    return (f"{count} records do not fit their own description and were left out",) if count else ()
