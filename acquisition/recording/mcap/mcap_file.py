"""One MCAP file being written by one thread: metadata, topics, messages, flush. Knows nothing of what they mean.

The MCAP writer wraps raw files in a buffer of its own that cannot be cut back to what is known to be good, so it is
given a `DiskFile`, which can.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Self

from mcap.data_stream import RecordBuilder
from mcap.records import ChunkIndex
from mcap.writer import Writer

from acquisition.recording.errors import RecordingError
from acquisition.recording.mcap.layout import CHECKSUM, PROFILE, MessageType, checksum


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


class DiskFile:
    """Buffers what is written until `flush`; `flush` puts it on the disk or raises OSError.

    `write` is the operating system's: (descriptor, bytes) to the number of bytes taken. FileExistsError if it exists.
    """

    def __init__(self, path: Path, write: Callable[[int, memoryview], int] = os.write) -> None:
        self._write = write
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o644)
        self._waiting: list[bytes] = []
        self._size = 0  # written and waiting
        self._good = 0  # on the disk for certain

    def write(self, data: bytes) -> int:
        if data:
            self._waiting.append(bytes(data))
            self._size += len(data)
        return len(data)

    def tell(self) -> int:
        return self._size

    def flush(self) -> None:
        """Everything so far to the disk, also through the operating system's cache. OSError leaves `cut_back` to do."""
        rest = memoryview(b"".join(self._waiting))
        if not rest:
            return
        while rest:
            rest = rest[self._write(self._descriptor, rest) :]
        os.fsync(self._descriptor)
        self._waiting.clear()
        self._good = self._size

    def cut_back(self) -> None:
        """After a failed flush: forget what was not written, and remove the torn piece from the file."""
        self._waiting.clear()
        self._size = self._good
        os.ftruncate(self._descriptor, self._good)

    def close(self) -> None:
        os.close(self._descriptor)


def create_file(path: Path) -> DiskFile:
    """A new, empty file. RecordingError if it exists already, or cannot be made."""
    try:
        return DiskFile(path)
    except FileExistsError as error:
        raise RecordingError(
            f"{path}: the file exists; a recording is never overwritten, choose another name"
        ) from error
    except OSError as error:
        raise RecordingError(f"{path}: cannot create the recording ({error.strerror}); choose another place") from error
