"""Results as files: one way to write them, which never replaces a measurement, an input or a result of another kind.

`write_output` writes a whole file of an `OutputKind`, made by `json_output`, `toml_output`, `table_output` or
`text_output`; `command_files` states what a command reads, `refuse_output` asks before a long calculation.
"""

from acquisition.recording.output.result_file import (
    OutputError,
    OutputKind,
    command_files,
    csv_text,
    json_output,
    refuse_output,
    table_output,
    text_output,
    toml_output,
    write_output,
)

__all__ = [
    "OutputError", "OutputKind", "command_files", "csv_text", "json_output", "refuse_output", "table_output",
    "text_output", "toml_output", "write_output",
]  # fmt: skip
