"""Files that people and programs write, TOML and JSON, read into records with one clear error for the first fault.

`parse_toml` reads every kind of TOML file (rig, pose plan, fit plan, error plan, task), `read_json` every kind of JSON
file; both name file, place, value and remedy. A new kind of file is a record of `msgspec` whose fields are the types of
`bounds`, and a call of one of the two.
"""

from acquisition.recording.errors import brief, cleaned, shown
from acquisition.recording.files.explain import KeyPath, si_value
from acquisition.recording.files.json_file import JsonKind, read_json, write_json
from acquisition.recording.files.toml_file import parse_toml, read_text

__all__ = [
    "JsonKind", "KeyPath", "brief", "cleaned", "parse_toml", "read_json", "read_text", "shown", "si_value",
    "write_json",
]  # fmt: skip
