"""diagnosis.json: writing and reading."""

from pathlib import Path

import msgspec

from calibrate.diagnose.schema import SCHEMA, DiagnosisFile
from calibrate.errors import DataError


def write_diagnosis(path: Path, diagnosis: DiagnosisFile) -> None:
    """Write diagnosis.json, whole or not at all. OSError where the folder cannot be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(path.name + ".partial")
    partial.write_bytes(msgspec.json.format(msgspec.json.encode(diagnosis), indent=1) + b"\n")
    partial.replace(path)


def read_diagnosis(path: Path) -> DiagnosisFile:
    """Read diagnosis.json. DataError naming file, place and remedy where it is none or of another version."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}); give the diagnosis.json of a diagnosis") from error
    try:
        version = msgspec.json.decode(data, type=_Version)
    except msgspec.DecodeError as error:
        raise DataError(f"{path}: not a diagnosis.json ({error}); diagnose the recording again") from error
    if version.schema != SCHEMA:
        raise DataError(f"{path}: schema {version.schema}; this version reads {SCHEMA}")
    try:
        return msgspec.json.decode(data, type=DiagnosisFile)
    except msgspec.DecodeError as error:
        raise DataError(f"{path}: damaged diagnosis.json ({error}); diagnose the recording again") from error


class _Version(msgspec.Struct, frozen=True):
    """The field that every version has."""

    schema: int
