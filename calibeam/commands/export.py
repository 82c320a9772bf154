"""`calibeam export` and `calibeam import`: session folders, tables and CAN logs out of and into recordings."""

from pathlib import Path

from acquisition.recording import RecordingError, read
from acquisition.recording.can_log import SUFFIXES, export_can, import_can
from acquisition.recording.rig import rig_text
from acquisition.recording.session_folder import TableFormat, export, write_streams
from acquisition.recording.session_folder.folder_import import import_folder
from calibeam.outcome import PartialResult
from calibeam.software import SOFTWARE


def export_command(recording: Path, *, out: Path, table: TableFormat = TableFormat.CSV, streams: bool = False) -> None:
    """Write a recording as tables, or its CAN frames as a CAN log.

    Example: calibeam export out/demo/recording.mcap --out session

    Example: calibeam export out/demo/recording.mcap --out tables --streams --table parquet

    Example: calibeam export encoder-log/segment-0001.mcap --out bus.blf

    Parameters
    ----------
    recording
        A recording, or a session folder.
    out
        The folder to make; or a file that ends with .blf, .asc, .csv or .log (candump), for the CAN frames.
    table
        Kind of the tables: samples and, with --streams, streams.
    streams
        Also every stream, events and gaps, one table each, in the folder "streams".

    """
    source = read(recording)
    if out.suffix.lower() in SUFFIXES:
        print(f"{out}: {export_can(source, out)} CAN frames")
        return
    export(source, out, table)
    print(f"{out}: rig.toml and samples.{table.value} with {len(source.samples)} samples")
    if streams:
        for path in write_streams(source, out, table):
            print(f"{path}: {path.stat().st_size} bytes")


def import_command(source: Path, *, out: Path, rig: Path | None = None) -> None:
    """Make a recording of a session folder or of a CAN log.

    Example: calibeam import session --out session.mcap

    Example: calibeam import bus.blf --rig rigs/ur5e-dual-psd.toml --out bus.mcap

    Parameters
    ----------
    source
        The session folder, with its folder "streams" if it has one; or a CAN log: .blf, .asc, .csv or .log (candump).
    out
        The recording to make.
    rig
        The rig that a CAN log was heard on; a session folder has its own.

    """
    if source.suffix.lower() not in SUFFIXES or source.is_dir():
        if rig is not None:
            raise RecordingError(f"--rig {rig}: a session folder has its own rig.toml; leave --rig out")
        import_folder(source, out, software=SOFTWARE)
        print(f"{out}: {len(read(out).samples)} samples")
        return
    if rig is None:
        raise RecordingError(f"{source}: a CAN log does not say of which rig it is; give --rig RIG.toml")
    done = import_can(source, out, rig_text=rig_text(rig), software=SOFTWARE)
    print(f"{out}: {done.frames} CAN frames in {', '.join(done.streams)}")
    if done.damage is not None:
        raise PartialResult(f"{source}: {done.damage}; everything before it is in {out}")
