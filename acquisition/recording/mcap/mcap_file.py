"""One MCAP file being written by one thread: metadata, topics, messages, flush. Knows nothing of what they mean."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Self

from mcap.data_stream import RecordBuilder
from mcap.records import ChunkIndex
from mcap.writer import Writer

from acquisition.recording.disk_file import DiskFile, create_file
from acquisition.recording.layout import CHECKSUM, PROFILE, checksum
from acquisition.recording.mcap.layout import MessageType


class _ChunkIndexes:
    """The index of an open file, as the bytes that will stand at its end.

    With 20 batches a second, mcap's own list of objects takes 70 MB in an hour, this one 8 MB.
    """

    def __init__(self) -> None:
        self._records = RecordBuilder()

    def append(self, index: ChunkIndex) -> None:
        index.write(self._records)

    def __iter__(self) -> Iterator[Self]:
        yield self

    def write(self, stream: RecordBuilder) -> None:
        stream.write(self._records.end())


class McapFile:
    """Only the owning thread may call it. Its methods raise OSError when the disk refuses."""

    def __init__(self, path: Path, software: str) -> None:
        self._disk: DiskFile = create_file(path)
        self._writer = Writer(self._disk, enable_data_crcs=True)  # pyright: ignore[reportArgumentType] - a file by its verbs
        writer: Any = self._writer
        writer._Writer__chunk_indices = _ChunkIndexes()  # noqa: SLF001 - mcap has no option for it
        self._writer.start(profile=PROFILE, library=software)
        self._sequence: dict[int, int] = {}
        self._latest_ns = self.safe_ns = 0

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """A named record that stands in the file where it is written, with its own checksum: MCAP gives it none."""
        self._writer.add_metadata(name, {**values, CHECKSUM: checksum(values)})

    def topic(self, topic: str, kind: MessageType, metadata: Mapping[str, str]) -> int:
        """Declares messages of one kind under a topic; returns the number to write them with."""
        schema = self._writer.register_schema(kind.name, "protobuf", kind.descriptor_set)
        return self._writer.register_channel(topic, "protobuf", schema, dict(metadata))

    def write(self, topic: int, log_ns: int, message: bytes, until_ns: int = 0) -> None:
        """One message of a declared topic; `until_ns` is the time of its last sample, where it holds several."""
        number = self._sequence.get(topic, 0)
        self._sequence[topic] = number + 1
        self._latest_ns = max(self._latest_ns, log_ns, until_ns)
        self._writer.add_message(topic, log_ns, message, publish_time=log_ns, sequence=number & 0xFFFFFFFF)

    def flush(self) -> None:
        """All that was written so far becomes a complete, compressed batch on the disk."""
        self._writer.flush()
        self.safe_ns = self._latest_ns

    def finish(self) -> None:
        """Adds the index and closes; after this the file is whole."""
        self._writer.finish()
        self._disk.flush()
        self._disk.close()

    def give_up(self) -> None:
        """After an OSError: remove the torn end, so that the file stops behind its last complete batch, and close."""
        try:
            self._disk.cut_back()
        finally:
            self._disk.close()
