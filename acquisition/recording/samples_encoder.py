"""Settled samples to messages: one per sample, one field per column; absent means missing.

A sample with a column that was not there before gets a new message kind under the same topic that has all columns so
far: nothing has to be declared in advance and nothing is dropped.
"""

import re
from collections.abc import Mapping

import msgspec

from acquisition.recording.columns import Kind, kind_of
from acquisition.recording.layout import SAMPLES_TOPIC
from acquisition.recording.mcap.layout import Field, FieldType, MessageType, Presence, message_type, packed
from acquisition.recording.mcap.mcap_file import McapFile
from acquisition.recording.samples import Cell

_FIELD_TYPE = {Kind.NUMBER: FieldType.DOUBLE, Kind.INTEGER: FieldType.INT64, Kind.TEXT: FieldType.STRING}
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


class SamplesEncoder:
    """Owned by the writing thread."""

    def __init__(self) -> None:
        self._fields: dict[str, str] = {}  # column -> field
        self._declared: tuple[int, MessageType] | None = None

    def write(self, file: McapFile, row: Mapping[str, Cell], log_ns: int) -> None:
        """One sample; `row` has been checked."""
        if self._declared is None or any(column not in self._fields for column in row):
            self._declared = self._declare(
                file, (*self._fields, *(column for column in row if column not in self._fields))
            )
        topic, kind = self._declared
        values = {self._fields[column]: _value(column, cell) for column, cell in row.items() if cell is not None}
        file.write(topic, log_ns, packed(kind, values))

    def _declare(self, file: McapFile, columns: tuple[str, ...]) -> tuple[int, MessageType]:
        self._fields = field_names(columns)
        fields = (Field(field, _FIELD_TYPE[kind_of(name)], Presence.OPTIONAL) for name, field in self._fields.items())
        kind = message_type("sample", tuple(fields))
        return file.topic(SAMPLES_TOPIC, kind, {"columns": msgspec.json.encode(self._fields).decode()}), kind


def field_names(columns: tuple[str, ...]) -> dict[str, str]:
    """Column -> field of the message: the column's own name where protobuf allows it, else "column_<number>".

    Protobuf refuses two fields that differ only in case and underscores (their JSON names would be the same).
    """
    taken: set[str] = set()
    fields: dict[str, str] = {}
    for number, column in enumerate(columns, start=1):
        folded = column.replace("_", "").lower()
        if _IDENTIFIER.fullmatch(column) and folded not in taken:
            fields[column] = column
        else:
            fields[column] = f"column_{number}"
            folded = f"column{number}"
        taken.add(folded)
    return fields


def _value(column: str, cell: float | int | str) -> float | int | str:
    kind = kind_of(column)
    return str(cell) if kind is Kind.TEXT else int(cell) if kind is Kind.INTEGER else float(cell)
