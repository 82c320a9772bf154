"""Bytes of a line-based measuring instrument to readings; no input or output. Its lines are as a rig file declares.

    1523.2,2104.51832,-310.00417,812.77310,0                    columns of text
    {"t": 1523.2, "p": {"x": 2.10451832, "y": -0.31, "z": 0.8127731}, "ok": true}     members of a JSON object

Nothing is guessed: the unit of length has no default, and a line of other columns is refused. Line ends may be LF, CR
or both.
"""

import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

AXES = ("x", "y", "z")
TIME, STATUS, TEMPERATURE, IGNORED = "time", "status", "temperature", "-"
KNOWN = (*AXES, TIME, STATUS, TEMPERATURE)
LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
FARTHEST_M = 200.0  # the longest laser trackers measure 160 m; millimetres taken for metres lie beyond it
TEMPERATURES_DEGC = (-100.0, 200.0)
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?")  # no "nan", "inf" or "1_000", which float() takes


class LineRefusedError(ValueError):
    """A line that is not of this layout; why."""


@dataclass(frozen=True)
class TargetReading:
    """One line. A reading whose status is not among the good ones has no position: NaN."""

    position_m: tuple[float, float, float]
    good: bool
    device_s: float = math.nan  # the instrument's own clock; NaN: the line has no time
    temperature_degC: float = math.nan


@dataclass(frozen=True)
class Units:
    """How the numbers of a line read, and which words of a status are good; none: there is no status."""

    length_m: float
    time_s: float = 1.0
    good: tuple[str, ...] = ()


Parse = Callable[[str], TargetReading]
NOWHERE = (math.nan, math.nan, math.nan)


def ascii_lines(columns: tuple[str, ...], separator: str, decimal: str, units: Units) -> Parse:
    """Reads lines of these columns. `separator`: one character; a blank stands for any run of blanks and tabs.

    ValueError for columns that are no layout.
    """
    _check_names(columns, units)
    if not (separator == " " or (len(separator) == 1 and separator.isprintable()) or separator == "\t"):
        raise ValueError(f'separator = {separator!r}; give one character, " " for any run of blanks')
    if separator == decimal or separator in "+-.eE0123456789":
        raise ValueError(f"separator = {separator!r} and decimal = {decimal!r} cannot be distinguished in numbers")

    def parse(line: str) -> TargetReading:
        cells = line.split() if separator == " " else [cell.strip() for cell in line.split(separator)]
        if len(cells) == len(columns) + 1 and cells[-1] == "":
            cells.pop()  # many exporters end a line with a separator
        if len(cells) != len(columns):
            raise LineRefusedError(f"{len(cells)} columns, {len(columns)} are declared")
        held = {name: cell for name, cell in zip(columns, cells, strict=True) if name != IGNORED}
        return _reading(held, units, lambda cell: _number(cell, decimal))

    return parse


def json_lines(members: Mapping[str, str], units: Units) -> Parse:
    """Reads lines of one JSON object each; `members`: by name, the path to it, such as "position.x" or "p.0".

    ValueError for members that are no layout.
    """
    _check_names(tuple(members), units)

    def parse(line: str) -> TargetReading:
        try:
            whole = json.loads(line, parse_constant=_no_constant)
        except (ValueError, RecursionError) as cause:
            raise LineRefusedError("no JSON") from cause
        return _reading({name: _at(whole, path) for name, path in members.items()}, units, _json_number)

    return parse


def _check_names(names: tuple[str, ...], units: Units) -> None:
    named = [name for name in names if name != IGNORED]
    unknown = next((name for name in named if name not in KNOWN), None)
    if unknown is not None:
        raise ValueError(f"column {unknown!r} is not known; there are {', '.join(KNOWN)}, and '-' for one to ignore")
    if missing := [axis for axis in AXES if axis not in named]:
        raise ValueError(f"column {missing[0]!r} is missing; a position has x, y and z")
    if len(set(named)) != len(named):
        raise ValueError(f"columns {', '.join(named)}: one stands twice; keep one")
    if (STATUS in named) != bool(units.good):
        raise ValueError(
            "a status column needs 'good', the words that mean a valid reading, and 'good' a status column"
        )


def _reading(held: Mapping[str, Any], units: Units, number: Callable[[Any], float]) -> TargetReading:
    device_s = number(held[TIME]) * units.time_s if TIME in held else math.nan
    degC = number(held[TEMPERATURE]) if TEMPERATURE in held else math.nan
    if TEMPERATURE in held and not TEMPERATURES_DEGC[0] <= degC <= TEMPERATURES_DEGC[1]:
        raise LineRefusedError(f"temperature {degC:g} is not one in °C")
    if STATUS in held and _word(held[STATUS]) not in units.good:
        return TargetReading(NOWHERE, False, device_s, degC)
    x, y, z = (_length(axis, number(held[axis]), units.length_m) for axis in AXES)
    return TargetReading((x, y, z), True, device_s, degC)


def _length(axis: str, value: float, unit_m: float) -> float:
    length_m = value * unit_m
    if abs(length_m) > FARTHEST_M:
        raise LineRefusedError(f"{axis} = {length_m:g} m, beyond {FARTHEST_M:g} m: is length_unit right?")
    return length_m


def _number(cell: str, decimal: str) -> float:
    text = cell.replace(decimal, ".") if decimal != "." and "." not in cell else cell
    if NUMBER.fullmatch(text) is None or not math.isfinite(value := float(text)):
        raise LineRefusedError(f"{cell[:24]!r} is no number" + (" with a decimal comma" if decimal == "," else ""))
    return value


def _json_number(value: Any) -> float:
    try:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise LineRefusedError(f"{str(value)[:24]!r} is no number")
        return float(value)
    except OverflowError as cause:
        raise LineRefusedError("a number of hundreds of digits") from cause


def _word(value: Any) -> str:
    """A status as text; true and false as JSON writes them."""
    return value.strip() if isinstance(value, str) else json.dumps(value)


def _at(whole: Any, path: str) -> Any:
    value = whole
    for step in path.split("."):
        if isinstance(value, dict) and step in value:
            value = cast("dict[str, Any]", value)[step]
        elif isinstance(value, list) and step.isdecimal() and int(step) < len(cast("list[Any]", value)):
            value = cast("list[Any]", value)[int(step)]
        else:
            raise LineRefusedError(f"no member {path!r}")
    return value


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no JSON")


LONGEST = 2048  # bytes of a line: nothing that a stranger sends may grow without end
SHOWN = 48  # bytes of a refused line that are kept


@dataclass(frozen=True)
class BadLine:
    """A line that is none of the declared layout."""

    offset: int  # of its first byte, since the connection began
    reason: str
    first: bytes


class LineCodec:
    """Cuts lines out of any split of bytes. `midway`: it may have joined in the middle of a line, which is dropped.

    The rest of a line can read as a good one (of 1523.2 may be left 23.2), so that it must not be used.
    """

    def __init__(self, parse: Parse, *, midway: bool = False) -> None:
        self._parse = parse
        self._begun = b""
        self._dropping = midway
        self._offset = 0  # of the first byte of `_begun`

    def feed(self, data: bytes) -> list[TargetReading | BadLine]:
        """The lines that ended in these bytes; empty ones are left out."""
        *ended, rest = (self._begun + data).replace(b"\r", b"\n").split(b"\n")
        found: list[TargetReading | BadLine] = []
        for line in ended:
            if self._dropping:
                self._dropping = False
            elif line.strip():
                found.append(self._read(line))
            self._offset += len(line) + 1
        if len(rest) > LONGEST or self._dropping:
            if not self._dropping:
                found.append(BadLine(self._offset, f"no line end within {LONGEST} bytes", rest[:SHOWN]))
            self._offset += len(rest)
            self._dropping, rest = True, b""
        self._begun = rest
        return found

    def _read(self, line: bytes) -> TargetReading | BadLine:
        if len(line) > LONGEST:
            return BadLine(self._offset, f"a line of {len(line)} bytes", line[:SHOWN])
        try:
            return self._parse(line.decode("ascii"))
        except UnicodeDecodeError:
            return BadLine(self._offset, "not text", line[:SHOWN])
        except LineRefusedError as why:
            return BadLine(self._offset, str(why), line[:SHOWN])
