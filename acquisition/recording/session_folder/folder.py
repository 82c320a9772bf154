"""Session folders, rig.toml and samples.csv: read one, make one of a recording."""

from pathlib import Path

from acquisition.recording.errors import RecordingError
from acquisition.recording.recording import Recording
from acquisition.recording.rig import Rig, parse_rig, rig_text
from acquisition.recording.samples import Samples
from acquisition.recording.session_folder.stream_tables import with_streams
from acquisition.recording.session_folder.tables import TableFormat, read_csv, read_parquet, write_csv, write_parquet

RIG = "rig.toml"
CSV = "samples.csv"
PARQUET = "samples.parquet"


def read_folder(folder: Path) -> Recording:
    """A session folder as a recording. RecordingError, RigFileError, SamplesError for what is wrong."""
    if not (folder / RIG).is_file():
        raise RecordingError(f"{folder}: no {RIG} in the folder; a session folder holds {RIG} and {CSV}")
    text = rig_text(folder / RIG)
    rig = parse_rig(text, str(folder / RIG))
    recording = Recording(path=folder, rig_text=text, rig=rig, samples=_read_samples(folder, rig), complete=True)
    return with_streams(recording, folder)


def export(recording: Recording, folder: Path | str, table: TableFormat = TableFormat.CSV) -> None:
    """Write rig.toml to the letter and the samples without loss. RecordingError if the folder is not empty."""
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise RecordingError(f"{folder}: the folder is not empty; nothing is overwritten, choose another one")
        (folder / RIG).write_bytes(recording.rig_text.encode())
    except OSError as error:
        raise RecordingError(
            f"{folder}: cannot write the session folder ({error.strerror}); choose another place"
        ) from error
    if table is TableFormat.CSV:
        write_csv(recording.samples, folder / CSV)
    else:
        write_parquet(recording.samples, folder / PARQUET)


def _read_samples(folder: Path, rig: Rig) -> Samples:
    csv, parquet = folder / CSV, folder / PARQUET
    if csv.is_file() and parquet.is_file():
        raise RecordingError(f"{folder}: both {CSV} and {PARQUET} are there; remove the one that is not meant")
    if parquet.is_file():
        return read_parquet(parquet, rig)
    if not csv.is_file():
        raise RecordingError(
            f"{folder}: no {CSV} or {PARQUET} in the folder; a session folder holds {RIG} and one of them"
        )
    return read_csv(csv, rig)
