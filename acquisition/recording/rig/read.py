"""Reads a rig file: TOML text to frozen records, with one clear error that names file, line, key and remedy."""

import hashlib
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, cast

import msgspec

from acquisition.recording.errors import RigFileError, shown
from acquisition.recording.files.bounds import most_of
from acquisition.recording.files.explain import KeyPath, si_value, spelled, suffix_of, unknown_key
from acquisition.recording.files.toml_file import TomlFile, parse_toml, read_text
from acquisition.recording.rig.rules import faults
from acquisition.recording.rig.schema import EMULATION_KEYS, ArmModel, Rig
from acquisition.recording.rig.senses import arm_as_counted


def load_rig(path: Path | str, *, needs_arm: bool = True) -> Rig:
    """The rig of a file. RigFileError naming file, line, key, value and remedy; also for a rig of encoders alone where
    an arm is needed.

    Files that it names for its devices (`dbc`, `error_maps`) are looked for from its own folder on.
    """
    rig = parse_rig(rig_text(path), str(path))
    if needs_arm and rig.n_joints == 0:
        raise RigFileError(
            f"{path}: this command needs an arm, and the file has none; add [arm] with its joints, as "
            "`calibeam rig new` writes it"
        )
    return _with_files_from(Path(path).parent, rig)


def rig_text(path: Path | str) -> str:
    """The text of a rig file to the letter, line ends included. RigFileError if it cannot be read as UTF-8."""
    return read_text(path, "rig file", RigFileError)


def rig_sha256(text: str) -> str:
    """What identifies a rig in results: the SHA-256 of its text, hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()


def parse_rig(text: str, name: str) -> Rig:
    """The rig of a text; `name` stands for the file in errors. RigFileError naming line, key, value and remedy."""
    file = parse_toml(text, name, RigFileError)
    rig = file.checked(Rig, _converted(file))
    for path, says in faults(rig):
        raise file.error(path, says)
    return _completed(rig)


def plain_rig(text: str, name: str) -> dict[str, Any]:
    """The rig as `tomllib` gives it, but with quantities such as "0.2 mm" in SI; what emulators are built from.

    RigFileError for bad TOML, a quantity that does not fit its key, a number that is not finite, and in [emulation].
    All else is checked by `parse_rig`.
    """
    return _converted(parse_toml(text, name, RigFileError))


def _converted(file: TomlFile) -> dict[str, Any]:
    try:
        converted = cast("dict[str, Any]", _in_si(file.document, (), ""))
    except _MisfitError as misfit:
        raise file.error(misfit.path, misfit.says) from misfit
    for path, says in _emulation_faults(converted.get("emulation")):
        raise file.error(path, says)
    return converted


class _MisfitError(ValueError):
    """A value that cannot be taken as an SI number, on its way up to where file and line are known."""

    def __init__(self, path: KeyPath, says: str) -> None:
        super().__init__(says)
        self.path, self.says = path, says


def _in_si(value: Any, path: KeyPath, key: str) -> Any:
    """The same tree; texts under keys with a unit suffix become numbers."""
    if isinstance(value, dict):
        items = cast("dict[str, Any]", value).items()
        return {name: _in_si(inner, (*path, name), name) for name, inner in items}
    if isinstance(value, list):
        return [_in_si(inner, (*path, index), key) for index, inner in enumerate(cast("list[Any]", value))]
    if isinstance(value, str) and suffix_of(key) is not None:
        try:
            value = si_value(key, value)
        except ValueError as error:
            raise _MisfitError(path, f"{shown(key)}: {error}") from error
    if isinstance(value, float) and not math.isfinite(value):
        raise _MisfitError(path, f"{shown(key)} = {value} is not a finite number; correct it or leave the key out")
    return value


def _emulation_faults(section: Any) -> Iterator[tuple[KeyPath, str]]:
    if not isinstance(section, Mapping):  # absent, or no table: the type check reports that
        return
    for key, value in cast("Mapping[str, object]", section).items():
        path = ("emulation", key)
        if key not in EMULATION_KEYS:
            yield path, unknown_key(key, ("emulation",), EMULATION_KEYS)
        elif isinstance(value, bool) or not isinstance(value, int | float):
            yield path, f"{key} = {spelled(value)} in [emulation]: expected a number; correct it"
        elif abs(value) > (most := most_of(key)):
            yield path, f"{key} = {spelled(value)} in [emulation]: expected at most {most:g} either way; correct it"


def _completed(rig: Rig) -> Rig:
    """What the rest of the program may rely on: theta offsets filled in, joints counted as the controller counts them,
    the beam's direction of length 1.
    """
    replace = msgspec.structs.replace
    if rig.arm.model is not ArmModel.LOCAL_POE:
        joints = tuple(replace(joint, theta_offset_rad=joint.theta_offset_rad or 0.0) for joint in rig.arm.joints)
        rig = replace(rig, arm=replace(rig.arm, joints=joints))
    rig = replace(rig, arm=arm_as_counted(rig.arm))
    if (beam := rig.tool.laser_direction) is not None:
        length = math.hypot(*beam)
        unit = beam if length == 1.0 else tuple(component / length for component in beam)
        rig = replace(rig, tool=replace(rig.tool, laser_direction=unit))
    return rig


def _with_files_from(folder: Path, rig: Rig) -> Rig:
    replace = msgspec.structs.replace
    psd, encoders = rig.devices.psd, rig.devices.encoders
    if psd is not None and psd.error_maps is not None:
        one, other = (str(folder / file) if file else "" for file in psd.error_maps)
        psd = replace(psd, error_maps=(one, other))
    if encoders is not None and encoders.dbc is not None:
        encoders = replace(encoders, dbc=str(folder / encoders.dbc))
    return replace(rig, devices=replace(rig.devices, psd=psd, encoders=encoders))
