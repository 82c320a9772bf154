"""Tables of files within their bounds: what a file holds is asked before it is unpacked, since little may become much.

A larger file may hold more: a byte a cell is what no table of measurements comes near.
"""

import importlib
import re
from pathlib import Path
from typing import Any

from acquisition.recording.errors import shown
from acquisition.recording.files.bounds import TABLE_BYTES, TABLE_CELLS, TABLE_COLUMNS, TABLE_TEXT, UNPACKED_BYTES

REMEDY = "give a part of it"


def table_bytes(path: Path | str, what: str, fault: type[Exception]) -> bytes:
    """A table as text, at most TABLE_BYTES of it. `fault` where it is larger, or cannot be read."""
    try:
        with Path(path).open("rb") as file:
            data = file.read(TABLE_BYTES + 1)
    except OSError as error:
        raise fault(f"{path}: cannot read the {what} ({error.strerror}); check the path") from error
    if len(data) > TABLE_BYTES:
        raise fault(f"{path}: larger than {TABLE_BYTES / 1e6:g} MB, the most of a table as text; {REMEDY}")
    return data


def check_cells(place: str, columns: int, cells: int, fault: type[Exception], most: int = TABLE_CELLS) -> None:
    """`fault` for a table of too many columns or cells; `place` for a person: file, and row where one is meant."""
    if columns > TABLE_COLUMNS:
        raise fault(f"{place}: {columns} columns; at most {TABLE_COLUMNS} are read, remove those that are not needed")
    if cells > most:
        raise fault(f"{place}: {cells} cells up to here; at most {most} of a table are read, {REMEDY}")


def parquet_table(path: Path, fault: type[Exception], *, plain: bool = True) -> Any:
    """The pyarrow table of a Parquet file. `fault` where it cannot be read, or holds more than the bounds.

    `plain`: its cells become objects, of which far fewer fit into the memory than of numbers.
    """
    try:
        parquet: Any = importlib.import_module("pyarrow.parquet")
        with parquet.ParquetFile(path) as file:
            about, schema = file.metadata, file.schema_arrow
        check_cells(str(path), about.num_columns, 0, fault)
        groups = [about.row_group(k) for k in range(about.num_row_groups)]
        cells = sum(g.column(j).num_values for g in groups for j in range(about.num_columns))
        cells = max(cells, about.num_rows * about.num_columns)
        most = TABLE_CELLS if plain else max(8 * TABLE_CELLS, path.stat().st_size)
        check_cells(str(path), about.num_columns, cells, fault, most)
        if (size := sum(group.total_byte_size for group in groups)) > max(UNPACKED_BYTES, 8 * most):
            raise fault(f"{path}: {size / 1e6:.0f} MB when unpacked; {REMEDY}")
        # As dictionaries, equal texts take the place of one
        texts = [f.name for f in schema if re.search("string|binary", str(f.type)) and not f.type.num_fields]
        table = parquet.read_table(path, read_dictionary=texts)
        return _plain_texts(table, texts, str(path), fault)
    except (OSError, ValueError, NotImplementedError) as error:  # pyarrow.ArrowInvalid is a ValueError
        raise fault(f"{path}: cannot read the Parquet file ({shown(str(error))}); write it again") from error


def _plain_texts(table: Any, texts: list[str], path: str, fault: type[Exception]) -> Any:
    compute: Any = importlib.import_module("pyarrow.compute")
    for name in texts:
        at = table.column_names.index(name)
        column = table.column(at)
        if str(column.type).startswith("dictionary"):
            for chunk in column.chunks:
                longest = compute.max(compute.binary_length(chunk.dictionary)).as_py() or 0
                if longest > TABLE_TEXT or longest * len(column) > UNPACKED_BYTES:
                    raise fault(f"{path}, column '{shown(name, 40)}': a text of {longest} bytes; shorten it")
            column = column.cast(column.type.value_type)
        table = table.set_column(at, table.schema.field(at).with_type(column.type), column)
    return table
