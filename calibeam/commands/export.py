"""`calibeam export`: session folders, tables and CAN logs out of recordings."""

from pathlib import Path

from acquisition.recording import read
from acquisition.recording.can_log import SUFFIXES, export_can
from acquisition.recording.session_folder import TableFormat, export, write_streams
from calibeam.outcome import taken_back


def export_command(recording: Path, *, out: Path, table: TableFormat = TableFormat.CSV, streams: bool = False) -> None:
    """Write a recording as tables, or its CAN frames as a CAN log.

    For example:

    ```
    calibeam export out/demo/recording.mcap --out session
    calibeam export out/demo/recording.mcap --out tables --streams --table parquet
    calibeam export encoder-log/segment-0001.mcap --out bus.blf
    ```

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
        with taken_back(out):
            print(f"{out}: CAN frames: {export_can(source, out)}")
        return
    with taken_back(out):
        export(source, out, table)
        alone = source.rig.n_joints == 0  # of encoders alone the streams are all there is
        print(f"{out}: rig.toml" + ("" if alone else f" and samples.{table.value}, samples: {len(source.samples)}"))
        whole = streams or alone
        for path in write_streams(source, out, table) if whole else ():
            print(f"{path}: {path.stat().st_size} bytes")
