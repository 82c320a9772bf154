"""A new, whole file of what is good in a torn or damaged one.

Every message that is read is copied to the letter, with the description that the old file holds. What was lost is
reported in the new file, which stays an incomplete session for ever.
"""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import msgspec
from google.protobuf.message import DecodeError
from mcap.records import Channel, Header, Message, Metadata, Schema

from acquisition.recording.errors import RecordingError
from acquisition.recording.mcap.layout import (
    CHECKSUM,
    END_METADATA,
    FORMAT_VERSION,
    PROFILE,
    RECORDING_METADATA,
    RECOVERY_METADATA,
    RIG_METADATA,
    MessageType,
    checksum,
    embedded_type,
)
from acquisition.recording.mcap.mcap_file import McapFile
from acquisition.recording.mcap.read import read
from acquisition.recording.mcap.scan import Scan
from acquisition.recording.rig import rig_sha256

FLUSH_BYTES = 4 * 2**20
MESSAGE_BYTES = 31  # of an empty one


@dataclass(frozen=True)
class Recovery:
    """What came of it. `whole`: nothing was wrong with the old file, and the new one holds all of it."""

    messages: int
    damage: tuple[str, ...]
    whole: bool


def recover(source: Path, path: Path, rig_text: str | None = None) -> Recovery:
    """Write `path` from what can be read of `source`, where the checksum of every batch and metadata record is proved.

    `rig_text` stands in for a rig that is damaged. RecordingError when nothing can be had, and then no file is left
    behind; when `path` exists; when the disk refuses.
    """
    scan = Scan(source)
    records = scan.records()
    first = next(records, None)
    if not isinstance(first, Header) or first.profile != PROFILE:
        raise RecordingError(f"{source}: does not begin as a recording of calibeam; nothing can be recovered")
    copy = _Copy(McapFile(path, first.library), rig_text)
    try:
        for record in records:
            copy.take(record)
        damage = (*scan.damage, *copy.faults(first.library))
        whole = scan.whole and copy.ended and not damage
        copy.finish(source.name, damage, whole=whole)
    except BaseException as error:
        with suppress(OSError):
            copy.file.give_up()
        path.unlink(missing_ok=True)
        if isinstance(error, OSError):  # of writing: what cannot be read is damage
            says = f"{path}: cannot write the recording ({error.strerror}); choose another place"
            raise RecordingError(says) from error
        raise
    _check_readable(source, path)
    return Recovery(copy.messages, damage, whole)


def _check_readable(source: Path, path: Path) -> None:
    try:
        read(path)
    except RecordingError as error:
        path.unlink()
        why = str(error).removeprefix(f"{path}: ")
        raise RecordingError(
            f"{source}: nothing can be recovered: {why}; where it is the rig that is lost, give it with --rig"
        ) from error


class _Copy:
    """The growing new file."""

    def __init__(self, file: McapFile, rig_text: str | None) -> None:
        self.file = file
        self.messages = 0
        self.ended = self._complete = False
        self._names: set[str] = set()  # metadata records written
        self._kinds: dict[int, MessageType] = {}
        self._topics: dict[int, int] = {}  # number in the old file -> in the new one
        self._lost_records = self._lost_descriptions = self._lost_messages = 0
        self._unsaved = 0
        if rig_text is not None:
            self._metadata(RIG_METADATA, {"text": rig_text, "sha256": rig_sha256(rig_text)})

    def take(self, record: object) -> None:
        if isinstance(record, Metadata):
            self._take_metadata(record)
        elif isinstance(record, Schema):
            self._take_description(record)
        elif isinstance(record, Channel) and record.schema_id in self._kinds:
            self._topics[record.id] = self.file.topic(record.topic, self._kinds[record.schema_id], record.metadata)
        elif isinstance(record, Message):
            self._take_message(record)

    def faults(self, software: str) -> Iterator[str]:
        """What is missing although every record that was there has been read."""
        if RECORDING_METADATA not in self._names:
            yield "what recorded it, where and when is lost: its times count from an unknown start"
            about = {"format_version": FORMAT_VERSION, "software": software, "host_s0": "nan"}
            self._metadata(RECORDING_METADATA, about)
        if self._lost_records:
            yield f"{self._lost_records} metadata records do not fit their checksum and were left out"
        if self._lost_descriptions:
            yield f"{self._lost_descriptions} descriptions of messages make no sense and were left out"
        if self._lost_messages:
            yield f"{self._lost_messages} messages of which the description is lost were left out"

    def finish(self, source: str, damage: tuple[str, ...], *, whole: bool) -> None:
        recovery = {"source": source, "damage": msgspec.json.encode(damage).decode()}
        self._metadata(RECOVERY_METADATA, recovery)
        self._metadata(END_METADATA, {"complete": "true" if whole and self._complete else "false"})
        self.file.finish()

    def _metadata(self, name: str, values: Mapping[str, str]) -> None:
        self._names.add(name)
        self.file.metadata(name, values)

    def _take_metadata(self, record: Metadata) -> None:
        values = dict(record.metadata)
        if values.pop(CHECKSUM, None) not in (None, checksum(values)):
            self._lost_records += 1
        elif record.name == END_METADATA:
            self.ended, self._complete = True, values.get("complete") == "true"
        elif record.name != RIG_METADATA or RIG_METADATA not in self._names:
            self._metadata(record.name, values)

    def _take_description(self, record: Schema) -> None:
        try:
            self._kinds[record.id] = embedded_type(record.name, record.data)
        except (DecodeError, TypeError, KeyError):
            self._lost_descriptions += 1

    def _take_message(self, record: Message) -> None:
        topic = self._topics.get(record.channel_id)
        if topic is None:
            self._lost_messages += 1
            return
        self.file.write(topic, record.log_time, record.data)
        self.messages += 1
        self._unsaved += len(record.data) + MESSAGE_BYTES
        if self._unsaved > FLUSH_BYTES:
            self.file.flush()
            self._unsaved = 0
