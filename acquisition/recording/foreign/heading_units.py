"""Units as other programs write them in headings, and their factors to SI; `q1 [deg]` as name and unit.

Symbols and factors: SI Brochure, 9th edition (BIPM 2019), tables 2, 4, 7 and 8; the inch: 25.4 mm exactly (ISO 31-1).
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

from acquisition.recording.files.bounds import TABLE_COLUMNS
from acquisition.recording.files.explain import UNITS, spelt


@dataclass(frozen=True)
class Unit:
    """SI value = given * factor + offset; `suffix` is what a column in SI ends with."""

    symbol: str
    suffix: str
    factor: float
    offset: float = 0.0


AMBIGUOUS = "grad"  # the degree in German, the gon in other languages and on calculators
_DEGREE = math.pi / 180.0
_FACTORS: Mapping[str, Mapping[str, float]] = {
    "rad": {
        **{symbol: float(factor) for symbol, factor in UNITS["rad"].items()},
        **dict.fromkeys(("deg", "°", "degree", "degrees", "degs"), _DEGREE),
        "gon": math.tau / 400.0,
        "arcmin": _DEGREE / 60.0,
        "arcsec": _DEGREE / 3600.0,
        "turn": math.tau,
        "turns": math.tau,
        "rev": math.tau,
    },
    "m": {**{symbol: float(factor) for symbol, factor in UNITS["m"].items()}, "in": 0.0254, "inch": 0.0254},
    "s": {**{symbol: float(factor) for symbol, factor in UNITS["s"].items()}, "sec": 1.0, "ns": 1e-9},
    "kg": {symbol: float(factor) for symbol, factor in UNITS["kg"].items()},
    "v": {symbol: float(factor) for symbol, factor in UNITS["v"].items()},
    "rad_s": {"rad/s": 1.0, "rad_s": 1.0, "mrad/s": 1e-3, "deg/s": _DEGREE, "°/s": _DEGREE, "deg_s": _DEGREE},
    "m_s": {symbol: float(factor) for symbol, factor in UNITS["m_s"].items()},
    "degC": dict.fromkeys(("degC", "°C", "C", "Celsius"), 1.0),
    AMBIGUOUS: {"grad": 1.0, "grd": 1.0},
}
_KELVIN, _FAHRENHEIT = ("K", "Kelvin"), ("degF", "°F", "F")

_BY_SYMBOL: Mapping[str, Unit] = MappingProxyType(
    {
        symbol.casefold(): Unit(symbol, suffix, factor)
        for suffix, factors in _FACTORS.items()
        for symbol, factor in factors.items()
    }
    | {symbol.casefold(): Unit(symbol, "degC", 1.0, -273.15) for symbol in _KELVIN}
    | {symbol.casefold(): Unit(symbol, "degC", 5.0 / 9.0, -160.0 / 9.0) for symbol in _FAHRENHEIT}
)
# Where the case tells: German nouns have a capital, and nm is a nanometre.
_AS_WRITTEN = {symbol: Unit(symbol, "rad", _DEGREE) for symbol in ("Grad", "Grd")} | {
    symbol: Unit(symbol, "nm", factor) for symbol, factor in {"Nm": 1.0, "N·m": 1.0, "kNm": 1e3, "Ncm": 1e-2}.items()
}
_PLAIN_NUMBER = ("", "1", "-", "—")  # what stands where a column has no unit

_BRACKETED = re.compile(r"(.*?)\s*\[([^\]]*)\]")
_IN_PARENTHESES = re.compile(r"(.*?)\s*\(([^)]*)\)")
_BEHIND_IN = re.compile(r"(.*\S)\s+in\s+(\S+)")
_BEHIND_SPACE = re.compile(r"(.*[^\s/])\s+(\S+)")  # before the stroke: `q1 deg/s`
_BEHIND_STROKE = re.compile(r"([^/]*[^\s/])\s*/\s*(\S+)")
# Behind an underscore only what names of SI columns and of usual exports end with: `bar_s` is no time of a bar.
_SUFFIXED = re.compile(r"(.+?)_(rad_s|deg_s|rad|mrad|deg|m|cm|mm|um|s|ms|us|ns|kg|g|v|mv|degC|K)", re.IGNORECASE)
_TORQUE = re.compile(r"((?:motor_)?tau\d+)_nm")  # a name of SI columns of its own: else it would be a nanometre


def unit_of(symbol: str) -> Unit | None:
    """The unit of this symbol, in whatever case; None where it is none that is known."""
    # µ (micro) and μ (mu) fold alike
    return _AS_WRITTEN.get(symbol.strip()) or _BY_SYMBOL.get(symbol.strip().casefold())


def si_symbol(suffix: str) -> str:
    """What a column in SI that ends with `suffix` counts in, as a person writes it; "" without a suffix."""
    return {"degC": "°C", "nm": "Nm"}.get(suffix) or (spelt(suffix) if suffix else "")


def symbols(suffix: str) -> tuple[str, ...]:
    """What may be written for a quantity whose SI columns end with `suffix`; the usual ones first."""
    usual = {
        "rad": ("deg", "rad"),
        "m": ("mm", "m"),
        "s": ("s", "ms", "us", "ns"),
        "degC": ("degC", "K", "degF"),
        "nm": ("Nm",),
    }
    usual[AMBIGUOUS] = ("deg", "gon")
    return usual.get(suffix, tuple(_FACTORS.get(suffix, ())))


@lru_cache(maxsize=TABLE_COLUMNS)
def split_heading(heading: str) -> tuple[str, str]:
    """Name and unit: `q1 [deg]`, `X/mm`, `X in mm`, `X (mm)`, `x_mm`. "" where none stands.

    What stands in square brackets is a unit, known or not; elsewhere only what is known as one.
    """
    if match := _BRACKETED.fullmatch(heading):
        return match[1].strip(), "" if match[2].strip() in _PLAIN_NUMBER else match[2].strip()
    if match := _TORQUE.fullmatch(heading):
        return match[1], "Nm"
    for form in (_IN_PARENTHESES, _BEHIND_IN, _BEHIND_SPACE, _BEHIND_STROKE, _SUFFIXED):
        match = form.fullmatch(heading)
        if match and match[1].strip() and unit_of(match[2]):
            return match[1].strip(), match[2].strip()
    return heading.strip(), ""


def folded(name: str) -> str:
    """A name as it is compared: without case, spaces and marks."""
    return re.sub(r"[\s_.\-:]+", "", name).casefold()
