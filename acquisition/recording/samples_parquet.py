"""samples.parquet: the same table as samples.csv, for whoever has pyarrow installed."""

import importlib
from pathlib import Path
from typing import Any

from acquisition.recording.errors import SamplesError, shown
from acquisition.recording.rig.schema import Rig
from acquisition.recording.sample_rules import checked_samples
from acquisition.recording.samples import Samples, cells_of
from acquisition.recording.samples_csv import check_header
from acquisition.recording.session_folder.tables import TableFormat, write_table


def read_parquet(path: Path, rig: Rig) -> Samples:
    """The samples of a Parquet file; null is a missing cell. SamplesError naming file, row, column and remedy."""
    parquet = _pyarrow_parquet(path)
    try:
        table = parquet.read_table(path)
    except (OSError, ValueError) as error:  # pyarrow.ArrowInvalid is a ValueError
        raise SamplesError(f"{path}: cannot read the Parquet file ({shown(str(error))}); write it again") from error
    check_header(table.column_names, str(path))
    columns = {name: table.column(name).to_pylist() for name in table.column_names}
    return checked_samples(columns, rig, lambda row: str(path) if row is None else f"{path} row {row + 1}")


def write_parquet(samples: Samples, path: Path) -> None:
    """Every cell so that it reads back bit for bit, null for a missing one. RecordingError when the disk refuses."""
    columns = {name: cells_of(name, values) for name, values in samples.columns.items()}
    write_table(columns, path, TableFormat.PARQUET)


def _pyarrow_parquet(path: Path) -> Any:
    try:
        return importlib.import_module("pyarrow.parquet")
    except ImportError as error:
        raise SamplesError(
            f"{path}: reading Parquet needs pyarrow; pip install pyarrow, or give samples.csv"
        ) from error
