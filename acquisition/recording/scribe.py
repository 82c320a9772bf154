"""The one thread that owns the file: takes what waits, writes it, flushes; the first failure of the disk ends it."""

import contextlib
import errno
import threading
from collections.abc import Callable

from acquisition.recording.errors import RecordingError
from acquisition.recording.layout import END_METADATA
from acquisition.recording.mcap.mcap_file import McapFile
from acquisition.recording.mcap.write_thread import StreamEncoder
from acquisition.recording.spool import Spool

# A killed process loses what waits and what is being written, as long again: together 0.1 s. With an own thread the
# sync costs the others nothing.
FLUSH_S = 0.05

Entry = Callable[[McapFile], None]  # what is to be written, by whom it was left

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class Scribe:
    """Writes the entries of a spool until it is closed; `encoders` belong to its thread."""

    def __init__(self, file: McapFile, spool: Spool[Entry], name: str, host_s0: float) -> None:
        self._file, self._spool, self._name, self._host_s0 = file, spool, name, host_s0
        self.encoders: list[StreamEncoder] = []
        self._complete = self._ending = False
        self._thread = threading.Thread(target=self._run, name=f"write {name}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def end(self, complete: bool, timeout_s: float) -> None:
        """Write what waits and close the file. RecordingError if that fails or takes longer than `timeout_s`.

        Called again, after an interrupt for instance, it waits again; the first call decides about `complete`.
        """
        if not self._ending:
            self._ending, self._complete = True, complete
        self._spool.close()
        self._thread.join(timeout_s)
        if self._thread.is_alive():
            raise RecordingError(f"{self._name}: the disk has not answered for {timeout_s:.0f} s; check it")
        if self._spool.failure is not None:
            raise RecordingError(self._spool.failure)

    def _run(self) -> None:
        try:
            while (entries := self._spool.take(FLUSH_S)) is not None:
                self._write(entries)
            self._file.metadata(END_METADATA, {"complete": "true" if self._complete else "false"})
            self._file.finish()
        except Exception as error:  # whatever it was, nobody may wait for this thread in vain
            self._spool.fail(self._says(error))
            with contextlib.suppress(OSError):  # the failure itself has been told already
                self._file.give_up()

    def _write(self, entries: list[Entry]) -> None:
        for entry in entries:
            entry(self._file)
        for encoder in self.encoders:
            encoder.emit(self._file)
        if entries:
            self._file.flush()
            self._spool.confirm(len(entries))

    def _says(self, error: Exception) -> str:
        safe_s = max(0.0, self._file.safe_ns * 1e-9 - self._host_s0)
        safe = f"{safe_s:.1f} s recorded are safe in {self._name}"
        if isinstance(error, OSError) and error.errno in _FULL:
            return f"disk full ({error.strerror}): {safe}; free space and resume"
        if isinstance(error, OSError):
            return f"cannot write the recording ({error.strerror}): {safe}; check the disk and resume"
        return f"cannot write the recording ({type(error).__name__}: {error}): {safe}; please report this"
