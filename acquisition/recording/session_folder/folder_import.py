"""Makes a recording of a session folder.

Apart from `folder`, because writing loads what reading does without: a fit must not load socket libraries.
"""

import heapq
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from acquisition.recording.errors import RecordingError, shown
from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.recording import Recording, Stream, time_utc
from acquisition.recording.restored_stamps import restored_stamps
from acquisition.recording.session_folder.folder import read_folder

WAITING = 16 * 2**20  # bytes given to the writer before it is waited for: a quarter of what may wait (write_thread.py)
BLOCK = 1000  # rows of a stream at a time; a viewer loads little more than the time it shows


def import_folder(
    folder: Path | str,
    path: Path | str,
    *,
    software: str,
    started_utc: datetime | None = None,
    restore_stamps: bool = False,
) -> None:
    """Make a recording of a session folder: rig, samples, and the streams, events and gaps of its folder `streams`.

    Without streams.json there, session time 0 is host time 0. `restore_stamps`: as `restored_stamps`. RecordingError if
    `path` exists or `folder` is no session folder, RigFileError, SamplesError.
    """
    source = read_folder(Path(folder))
    if restore_stamps:
        source = restored_stamps(source)
    started_utc = _started(source, Path(folder)) or started_utc
    write_recording(source, path, software=software, imported_from=Path(folder).name, started_utc=started_utc)


def write_recording(
    source: Recording, path: Path | str, *, software: str, imported_from: str, started_utc: datetime | None
) -> None:
    """One file of a recording in memory: rig, samples, streams, events and gaps. RecordingError if `path` exists.

    `started_utc`: now, where it is not known.
    """
    with RecordingWriter(
        path,
        rig_text=source.rig_text,
        software=source.software or software,
        clock=_SessionStart(),
        notes={"imported_from": imported_from, **source.notes},
        host_s0=source.host_s0,
        started_utc=started_utc or datetime.now(UTC),
        host=source.host or None,
    ) as writer:
        for row in source.samples.rows():
            writer.sample(row)
        _write_streams(writer, source)
        for event in source.events:
            writer.event(event)
        writer.close(complete=source.complete)


def _write_streams(writer: RecordingWriter, source: Recording) -> None:
    """In blocks ordered by time over all streams, so that a viewer finds what belongs to one instant in one place."""
    inlets = {
        name: writer.stream(name, s.channels, find_gaps=False, stamps=s.stamps) for name, s in source.streams.items()
    }
    given = 0
    for _, name, rows in heapq.merge(*(_blocks(stream) for stream in source.streams.values())):
        stream = source.streams[name]
        block = slice(*rows)
        values = {channel: array[block] for channel, array in stream.values.items()}
        inlets[name].append(stream.host_s[block], stream.device_s[block], stream.sequence[block], values)
        given += sum(array.nbytes for array in values.values()) + 3 * stream.host_s[block].nbytes
        if given >= WAITING:
            writer.flush()
            given = 0
    for name, stream in source.streams.items():
        for gap in stream.gaps:
            inlets[name].gap(gap)


def _blocks(stream: Stream) -> Iterator[tuple[float, str, tuple[int, int]]]:
    for first in range(0, len(stream.host_s), BLOCK):
        yield float(stream.host_s[first]), stream.name, (first, min(first + BLOCK, len(stream.host_s)))


def _started(source: Recording, folder: Path) -> datetime | None:
    if not source.started_utc:
        return None
    try:
        return time_utc(source.started_utc)
    except ValueError as error:
        raise RecordingError(
            f"{folder}: streams.json: started_utc = {shown(source.started_utc)} is no ISO 8601 time; correct it"
        ) from error


class _SessionStart:
    """The clock of a session that is over: its times count from its start."""

    def now_s(self) -> float:
        return 0.0
