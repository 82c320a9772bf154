"""Quantities written as text, "0.2 mm", become SI numbers; the suffix of the key states which quantity is meant.

Symbols and factors: SI Brochure, 9th edition (BIPM 2019), tables 2, 4, 7 and 8.
"""

import difflib
import math
import re
from collections.abc import Mapping
from decimal import Decimal

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
