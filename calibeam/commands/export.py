"""`calibeam export` and `calibeam import`: session folders in and out of recordings."""

from pathlib import Path

from acquisition.recording.folder import export
from acquisition.recording.import_folder import import_folder
from acquisition.recording.read import read
from calibeam.software import SOFTWARE


def export_command(recording: Path, *, out: Path) -> None:
    """Write a recording's rig and settled samples as a session folder: rig.toml and samples.csv.

    Example: calibeam export out/demo/recording.mcap --out session

    Parameters
    ----------
    recording
        A recording, or a session folder.
    out
        The folder to make.

    """
    source = read(recording)
    export(source, out)
    print(f"{out}: rig.toml and samples.csv with {len(source.samples)} samples")


def import_command(folder: Path, *, out: Path) -> None:
    """Make a recording of a session folder (rig.toml and samples.csv or samples.parquet).

    Example: calibeam import session --out session.mcap

    Parameters
    ----------
    folder
        The session folder.
    out
        The recording to make.

    """
    import_folder(folder, out, software=SOFTWARE)
    print(f"{out}: {len(read(out).samples)} samples")
