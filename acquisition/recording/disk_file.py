"""A file that is written only at its end and can be cut back to what is known to be good.

The MCAP writer wraps raw files in a buffer of its own that cannot be cut back, so it is given this plain object.
"""

import os
from collections.abc import Callable
from pathlib import Path

from acquisition.recording.errors import RecordingError


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
