"""Turns what the type check says about a rig file into one line for a person: file, line, key, value, remedy.

`root` is the record of the whole file: that of the rig, or of another file that is read in the same way.
"""

import difflib
import enum
import re
from collections.abc import Mapping, Sequence
from typing import Any, get_args

import msgspec
from msgspec.structs import fields

from acquisition.recording.rig_lines import KeyPath
from acquisition.recording.rig_quantity import si_name, spelt, suffix_of
from acquisition.recording.rig_schema import EMULATION_KEYS, Rig

_PLACE = re.compile(r"^(?P<says>.*?)(?: - at `\$(?P<path>.*)`)?$", re.DOTALL)
_STEP = re.compile(r"\.([A-Za-z0-9_-]+)|\[(\d+)\]")
_UNKNOWN = re.compile(r"unknown field `(.*)`")
_MISSING = re.compile(r"missing required field `(.*)`")


def explain(error: msgspec.ValidationError, document: Mapping[str, Any], root: Any = Rig) -> tuple[KeyPath, str]:
    """The key at fault and a sentence about it, from the message of msgspec (0.22: "what - at `$.path[0].to`")."""
    match = _PLACE.fullmatch(str(error))
    says, place = (match["says"], match["path"] or "") if match else (str(error), "")
    path: KeyPath = tuple(name or int(index) for name, index in _STEP.findall(place))
    if unknown := _UNKNOWN.search(says):
        return (*path, unknown[1]), unknown_key(unknown[1], path, known_keys(path, root))
    if missing := _MISSING.search(says):
        return path, f"{section(path)} needs the key '{missing[1]}'; add it"
    return path, _wrong_value(path, says, document, root)


def unknown_key(key: str, path: KeyPath, known: Sequence[str]) -> str:
    """Says what a key that nobody knows was probably meant to be."""
    says = f"unknown key '{key}' in {section(path)}"
    if (in_si := si_name(key)) in known:
        return f"{says}; the file is in SI units: write '{in_si}' in {spelt(suffix_of(str(in_si)) or '')}"
    near = difflib.get_close_matches(key, known, n=1)
    return f"{says}; did you mean '{near[0]}'?" if near else f"{says}; known are {', '.join(known)}"


def known_keys(path: KeyPath, root: Any = Rig) -> tuple[str, ...]:
    """The keys that the file may have at this place."""
    if path == ("emulation",):
        return EMULATION_KEYS
    found = _type_at(path, root)
    return tuple(field.encode_name for field in fields(found)) if _is_struct(found) else ()


def section(path: KeyPath) -> str:
    """A place as it is written in the file: "[arm]", "[[arm.joint]]"."""
    if not path:
        return "the file"
    dotted = ".".join(name for name in path if isinstance(name, str))
    return f"[[{dotted}]]" if isinstance(path[-1], int) else f"[{dotted}]"


def _type_at(path: KeyPath, root: Any) -> Any:
    found: Any = root
    for name in path:
        if isinstance(name, str):
            field = next((field for field in fields(found) if field.encode_name == name), None)
            found = _inner(field.type) if field else None
        if not _is_struct(found):
            break
    return found


def _inner(declared: Any) -> Any:
    """The record or the enumeration inside `X | None`, `tuple[X, ...]`, `Annotated[X, ...]`; else the type itself."""
    for candidate in (declared, *get_args(declared)):
        if isinstance(candidate, type) and issubclass(candidate, msgspec.Struct | enum.Enum):
            return candidate
    nested = [_inner(argument) for argument in get_args(declared) if get_args(argument)]
    return nested[0] if nested else declared


def _is_struct(found: Any) -> bool:
    return isinstance(found, type) and issubclass(found, msgspec.Struct)


def _wrong_value(path: KeyPath, says: str, document: Mapping[str, Any], root: Any) -> str:
    value: Any = document
    for step in path:
        value = value[step]
    names = [name for name in path if isinstance(name, str)]
    key = names[-1] if names else "the file"
    shown = f"{key} = {value!r}" if not isinstance(value, Mapping) else f"'{key}'"
    where = section(path[: path.index(key)] if key in path else ())
    return f"{shown} in {where}: {_plain(says)}{_remedy(key, _type_at(path, root), value)}"


def _plain(says: str) -> str:
    return says.replace("`", "").replace("Expected", "expected").replace("Invalid enum value", "unknown value")


def _remedy(key: str, found: Any, value: Any) -> str:
    if isinstance(found, type) and issubclass(found, enum.Enum):
        choices = [str(member.value) for member in found]
        near = difflib.get_close_matches(str(value), choices, n=1)
        hint = f"; did you mean '{near[0]}'?" if near else ""
        return f"; known are {', '.join(choices)}{hint}"
    if key == "schema":
        return "; this version reads schema 1"
    suffix = suffix_of(key)
    return f"; write it in {spelt(suffix)}" if suffix else "; correct it"
