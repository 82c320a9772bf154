"""Makes a recording of a session folder.

Apart from `folder`, because writing loads what reading does without: a fit must not load socket libraries.
"""

from datetime import UTC, datetime
from pathlib import Path

from acquisition.recording.folder import read_folder
from acquisition.recording.writer import RecordingWriter


def import_folder(folder: Path | str, path: Path | str, *, software: str, started_utc: datetime | None = None) -> None:
    """Make a recording of a session folder: rig and samples, no streams; session time 0 is host time 0.

    RecordingError if `path` exists or `folder` is no session folder, RigFileError, SamplesError.
    """
    source = read_folder(Path(folder))
    with RecordingWriter(
        path,
        rig_text=source.rig_text,
        software=software,
        clock=_SessionStart(),
        notes={"imported_from": Path(folder).name},
        started_utc=datetime.now(UTC) if started_utc is None else started_utc,
    ) as writer:
        for row in source.samples.rows():
            writer.sample(row)


class _SessionStart:
    """The clock of a session that is over: its times count from its start."""

    def now_s(self) -> float:
        return 0.0
