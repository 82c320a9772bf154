"""Quantities written as text, "0.2 mm", become SI numbers; what the type check reports of a file becomes one line for
a person: file, place, value, remedy.

The suffix of a key states which quantity is meant. Symbols and factors: SI Brochure, 9th edition (BIPM 2019), tables 2,
4, 7 and 8. `root` is the record of the whole file: that of the rig, or of another file that is read in the same way.
"""

import difflib
import enum
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from types import UnionType
from typing import Annotated, Any, Union, cast, get_args, get_origin

import msgspec
from msgspec.structs import fields

from acquisition.recording.errors import shown

_LENGTH = {"m": "1", "cm": "1e-2", "mm": "1e-3", "um": "1e-6", "µm": "1e-6", "μm": "1e-6", "nm": "1e-9"}
_ANGLE = {"rad": "1", "mrad": "1e-3", "urad": "1e-6", "µrad": "1e-6", "μrad": "1e-6"}
_DEGREES = {"deg": "1", "°": "1", "arcmin": "60", "arcsec": "3600"}  # parts of a degree
_TIME = {"s": "1", "ms": "1e-3", "us": "1e-6", "µs": "1e-6", "μs": "1e-6", "min": "60", "h": "3600"}

# Suffix of a key -> unit symbol -> factor to SI, kept as text so that "0.3 mm" becomes exactly 3e-4.
UNITS: Mapping[str, Mapping[str, str]] = {
    "m": _LENGTH,
    "rad": _ANGLE,
    "s": _TIME,
    "kg": {"kg": "1", "g": "1e-3"},
    "hz": {"Hz": "1", "kHz": "1e3", "MHz": "1e6"},
    "v": {"V": "1", "mV": "1e-3"},
    "w": {"W": "1", "mW": "1e-3", "uW": "1e-6", "µW": "1e-6", "μW": "1e-6"},
    "m_s": {"m/s": "1", "mm/s": "1e-3"},
    "m_s2": {"m/s2": "1", "m/s^2": "1", "m/s²": "1", "mm/s2": "1e-3", "mm/s^2": "1e-3", "mm/s²": "1e-3"},
    "rad_s": {"rad/s": "1", "mrad/s": "1e-3"},
    "rad_s2": {"rad/s2": "1", "rad/s^2": "1", "rad/s²": "1"},
}
# Suffix -> unit symbol -> how many of it make one degree (per second, ...): these factors have no finite decimal.
_BY_DEGREE: Mapping[str, Mapping[str, str]] = {
    "rad": _DEGREES,
    "rad_s": {"deg/s": "1", "°/s": "1"},
    "rad_s2": {"deg/s2": "1", "deg/s^2": "1", "deg/s²": "1"},
}
_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\S*)\s*", re.ASCII)
_BY_LENGTH = sorted(UNITS, key=len, reverse=True)


def suffix_of(key: str) -> str | None:
    """The unit suffix of a key: "m" of "origin_m", "rad_s" of "speed_rad_s"; None where the key has no unit."""
    return next((suffix for suffix in _BY_LENGTH if key.endswith("_" + suffix)), None)


def si_value(key: str, text: str) -> float:
    """The SI number for a text such as "0.2 mm" under a key with a unit suffix. ValueError states what does not fit."""
    suffix = suffix_of(key)
    if suffix is None:
        raise ValueError(f"'{shown(text)}' stands where a number is expected")
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise ValueError(
            f"'{shown(text)}' is no quantity; write a number in {spelt(suffix)}, or text such as {_example(suffix)}"
        )
    number, unit = match.groups()
    if unit in UNITS[suffix]:
        return float(Decimal(number) * Decimal(UNITS[suffix][unit]))
    if unit in _BY_DEGREE.get(suffix, {}):
        return math.radians(float(number)) / float(_BY_DEGREE[suffix][unit])
    raise ValueError(_misfit(key, text, unit, suffix))


def si_name(key: str) -> str | None:
    """The SI spelling of a key that was written with another unit: "a_m" for "a_mm", "lower_rad" for "lower_deg"."""
    stem, _, unit = key.rpartition("_")
    for suffix in UNITS:
        symbols = {*UNITS[suffix], *_BY_DEGREE.get(suffix, {})} - {suffix}
        if stem and (unit in symbols or unit.lower() in {symbol.lower() for symbol in symbols} - {suffix}):
            return f"{stem}_{suffix}"
    return None


def spelt(suffix: str) -> str:
    """The SI unit behind a suffix as a person writes it: "rad/s" for "rad_s"."""
    return next(symbol for symbol, factor in UNITS[suffix].items() if factor == "1")


def _misfit(key: str, text: str, unit: str, suffix: str) -> str:
    text, unit = shown(text), shown(unit)
    if not unit:
        return f"'{text}' has no unit; write it as a number in {spelt(suffix)}, or with its unit: {_example(suffix)}"
    fitting = [*UNITS[suffix], *_BY_DEGREE.get(suffix, {})]
    known = {symbol for symbols in (*UNITS.values(), *_BY_DEGREE.values()) for symbol in symbols}
    if unit in known:
        return (
            f"the unit '{unit}' of '{text}' does not fit '{key}', which is in {spelt(suffix)}; use {', '.join(fitting)}"
        )
    near = difflib.get_close_matches(unit, fitting, n=1)
    hint = f"; did you mean '{near[0]}'?" if near else ""
    return f"the unit '{unit}' of '{text}' is unknown; '{key}' takes {', '.join(fitting)}{hint}"


def _example(suffix: str) -> str:
    symbols = [*_BY_DEGREE.get(suffix, {}), *list(UNITS[suffix])[1:], spelt(suffix)]
    return f"'0.2 {symbols[0]}'"


KeyPath = tuple[str | int, ...]  # ("arm", "joint", 0, "a_m"): elements of arrays are counted from 0

_PLACE = re.compile(r"^(?P<says>.*?)(?: - at (?P<key>`key` in )?`\$(?P<path>[^`]*)`)?$", re.DOTALL)
_STEP = re.compile(r"\.([A-Za-z0-9_-]+)|\[([0-9]+)\]|\[(\.\.\.)\]")
_UNKNOWN = re.compile(r"unknown field `(.*)`", re.DOTALL)
_MISSING = re.compile(r"missing required field `(.*)`")
_BOUND = re.compile(r"[<>]= ?(-?[0-9.e+-]+)")
MILLIMETRES = 1000  # in a metre
LONGEST_KEY = 100  # characters that are compared with known words


def explain(error: msgspec.ValidationError, document: Mapping[str, Any], root: Any) -> tuple[KeyPath, str]:
    """The key at fault and a sentence about it, from the message of msgspec (0.22: "what - at `$.path[0].to`")."""
    path, says, value = located(error, document, root)
    if unknown := _UNKNOWN.search(says):
        return (*path, unknown[1]), unknown_key(unknown[1], path, known_keys(path, document, root))
    if missing := _MISSING.search(says):
        return path, f"{section(path)} needs the key '{missing[1]}'; add it"
    return path, _wrong_value(path, says, value, _type_at(path, document, root))


def located(error: msgspec.ValidationError, document: Mapping[str, Any], root: Any) -> tuple[KeyPath, str, Any]:
    """The place of an error, what is wrong there, and the value: of a table without fixed keys also which entry."""
    match = _PLACE.fullmatch(str(error))
    says, steps = (match["says"], _STEP.findall(match["path"] or "")) if match else (str(error), [])
    path: KeyPath = ()
    declared, value = root, document
    for name, index, other in steps:
        step: Any = _entry(_child(declared, value, ...), value) if other else name or int(index)
        if step is None:
            break
        declared, value, path = _child(declared, value, step), value[step], (*path, step)
    if match and match["key"]:
        key = next((name for name in value if not _fits(name, _key_type(declared))), "")
        return (*path, key), f"{says} as a key", key
    return path, says, value


def unknown_key(key: str, path: KeyPath, known: Sequence[str]) -> str:
    """What an unknown key was probably meant to be."""
    says = f"unknown key '{shown(key, 60)}' in {section(path)}"
    if (in_si := si_name(key)) in known:
        return f"{says}; the file is in SI units: write '{in_si}' in {spelt(suffix_of(str(in_si)) or '')}"
    near = difflib.get_close_matches(key[:LONGEST_KEY], known, n=1)
    return f"{says}; did you mean '{near[0]}'?" if near else f"{says}; known are {shown(', '.join(known))}"


def known_keys(path: KeyPath, document: Mapping[str, Any], root: Any) -> tuple[str, ...]:
    """The keys that the file may have at this place."""
    found = _type_at(path, document, root)
    return tuple(field.encode_name for field in fields(found)) if _is_struct(found) else ()


def section(path: KeyPath) -> str:
    """A place as it is written in the file: "[arm]", "[[arm.joint]]"."""
    if not path:
        return "the file"
    dotted = ".".join(shown(name) for name in path if isinstance(name, str))
    return f"[[{dotted}]]" if isinstance(path[-1], int) else f"[{dotted}]"


def _type_at(path: KeyPath, document: Any, root: Any) -> Any:
    """The record or the enumeration at a place; else what is declared there."""
    declared: Any = root
    value: Any = document
    for step in path:
        declared = _child(declared, value, step)
        try:
            value = value[step]
        except (KeyError, IndexError, TypeError):
            value = ()
    named = (one for one in _choices(declared, value) if isinstance(one, type))
    return next((one for one in named if issubclass(one, msgspec.Struct | enum.Enum)), declared)


def _choices(declared: Any, value: Any) -> Iterator[Any]:
    """The types behind `X | None` and `Annotated[X, ...]`; of tagged records only the one that the value names."""
    origin = get_origin(declared)
    if origin is Annotated:
        yield from _choices(get_args(declared)[0], value)
    elif origin in (Union, UnionType):
        for one in get_args(declared):
            yield from _choices(one, value)
    elif not _is_struct(declared) or declared.__struct_config__.tag is None or _is_named(declared, value):
        yield declared


def _is_named(declared: Any, value: Any) -> bool:
    config = declared.__struct_config__
    return isinstance(value, Mapping) and cast("Any", value).get(config.tag_field) == config.tag


def _child(declared: Any, value: Any, step: Any) -> Any:
    """What is declared for a key, an element, or (...) any entry of a table without fixed keys; None: nothing."""
    for one in _choices(declared, value):
        inner = get_args(one)
        if _is_struct(one):
            found = next((field.type for field in fields(one) if field.encode_name == step), None)
            if found is not None:
                return found
        elif inner and isinstance(step, int):
            return inner[min(step, len(inner) - 1)] if inner[-1] is not ... else inner[0]
        elif len(inner) == 2:
            return inner[1]
    return None


def _key_type(declared: Any) -> Any:
    return next((get_args(one)[0] for one in _choices(declared, None) if len(get_args(one)) == 2), str)


def _entry(declared: Any, value: Any) -> Any:
    """The key of the first entry that does not fit; None where all do."""
    return next((key for key, inner in value.items() if not _fits(inner, declared)), None)


def _fits(value: Any, declared: Any) -> bool:
    try:
        msgspec.convert(value, type=declared)
    except msgspec.ValidationError:
        return False
    return True


def _is_struct(found: Any) -> bool:
    return isinstance(found, type) and issubclass(found, msgspec.Struct)


def _wrong_value(path: KeyPath, says: str, value: Any, found: Any) -> str:
    names = [name for name in path if isinstance(name, str)]
    key = names[-1] if names else "the file"
    written = f"{shown(key)} = {spelled(value)}" if not isinstance(value, Mapping) else f"'{shown(key)}'"
    where = section(path[: path.index(key)] if key in path else ())
    return f"{written} in {where}: {plain(says)}{_remedy(key, found, value, says)}"


def spelled(value: object) -> str:
    """A value as a file spells it, text with quotes."""
    return f"'{shown(value)}'" if isinstance(value, str) else shown(value)


def plain(says: str) -> str:
    """The words of msgspec without its marks."""
    return says.replace("`", "").replace("Expected", "expected").replace("Invalid enum value", "unknown value")


def in_metres(value: float, most_m: float) -> str:
    """The remedy for a length beyond a bound: millimetres, where they would make sense of it."""
    if most_m < abs(value) <= MILLIMETRES * most_m:
        return f"; probably in millimetres: divide by {MILLIMETRES} ({value / MILLIMETRES:g}), the file is in m"
    return "; write it in m"


def _remedy(key: str, found: Any, value: Any, says: str) -> str:
    if isinstance(found, type) and issubclass(found, enum.Enum):
        choices = [str(member.value) for member in found]
        near = difflib.get_close_matches(str(value)[:LONGEST_KEY], choices, n=1)
        hint = f"; did you mean '{near[0]}'?" if near else ""
        return f"; known are {', '.join(choices)}{hint}"
    if key == "schema":
        return "; this version reads schema 1"
    suffix = suffix_of(key)
    bound = _BOUND.search(says)
    if suffix == "m" and bound and isinstance(value, float | int):
        return in_metres(float(value), abs(float(bound[1])))
    return f"; write it in {spelt(suffix)}" if suffix else "; correct it"
