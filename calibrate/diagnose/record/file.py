"""diagnosis.json: writing and reading."""

from pathlib import Path
from typing import Any

from acquisition.recording.files import JsonKind, read_json, shown, write_json
from acquisition.recording.output import json_output
from calibrate.diagnose.record.schema import SCHEMA, DiagnosisFile
from calibrate.errors import DataError

DIAGNOSIS = json_output("calibeam-diagnosis", "diagnosis.json")
KIND = JsonKind("diagnosis.json", "give the diagnosis.json of a diagnosis", "diagnose the recording again", DataError)


def write_diagnosis(path: Path, diagnosis: DiagnosisFile) -> None:
    """Write diagnosis.json, whole or not at all. OSError where the folder cannot be written."""
    write_json(path, diagnosis)


def read_diagnosis(path: Path) -> DiagnosisFile:
    """Read diagnosis.json. DataError naming file, place and remedy where it is none or of another version."""
    return read_json(path, KIND, DiagnosisFile, _other)


def _other(content: dict[str, Any]) -> str | None:
    schema = content.get("schema")
    return None if schema == SCHEMA else f"schema {shown(schema)}; this version reads {SCHEMA}"
