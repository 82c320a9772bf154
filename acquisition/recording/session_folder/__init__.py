"""The session folder: rig.toml with samples.csv or samples.parquet, and the streams as tables; docs/formats.md.

`read_folder` reads one, `export` makes one of a recording, without loss for samples; `folder_import` makes a recording
of one (apart, because writing loads sockets). A new kind of table is a member of `TableFormat` and a branch in
`tables`.
"""

from acquisition.recording.session_folder.folder import CSV, PARQUET, RIG, export, read_folder
from acquisition.recording.session_folder.stream_tables import write_streams
from acquisition.recording.session_folder.tables import (
    TableFormat,
    check_header,
    parse_csv,
    read_csv,
    read_parquet,
    write_csv,
)

__all__ = [
    "CSV",
    "PARQUET",
    "RIG",
    "TableFormat",
    "check_header",
    "export",
    "parse_csv",
    "read_csv",
    "read_folder",
    "read_parquet",
    "write_csv",
    "write_streams",
]
