"""Numbers for a person: a unit that fits, as many digits as the doubt leaves, columns that line up at the point."""

import math
from collections.abc import Sequence

MINUS = "\N{MINUS SIGN}"
DIGIT_SPACE = "\N{FIGURE SPACE}"  # as wide as a digit
POINT_SPACE = "\N{PUNCTUATION SPACE}"  # as wide as a point
DASH = "\N{EN DASH}"

LENGTHS = ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm"))
ANGLES = ((1.0, "rad"), (1e-3, "mrad"), (1e-6, "µrad"), (1e-9, "nrad"))


def fixed(value: float, decimals: int) -> str:
    """A number with so many decimals and a real minus sign; a dash where there is no number."""
    if not math.isfinite(value):
        return DASH
    return f"{value:.{decimals}f}".replace("-", MINUS)


def significant(value: float, digits: int = 3) -> str:
    """A number with so many significant digits, not in powers of ten between 1e-4 and 1e6."""
    if not math.isfinite(value) or value == 0.0:
        return DASH if not math.isfinite(value) else "0"
    size = math.floor(math.log10(abs(value)))
    if not -5 < size < 6:
        return f"{value:.{digits - 1}e}".replace("-", MINUS)
    return fixed(round(value, digits - 1 - size), max(0, digits - 1 - size))


def length(value_m: float, digits: int = 3) -> str:
    """A length in the unit that gives 1 to 1000 of it: '1.92 µm'."""
    return _in_unit(value_m, digits, LENGTHS)


def angle(value_rad: float, digits: int = 3) -> str:
    """An angle in the unit that gives 1 to 1000 of it: '3.66 µrad'."""
    return _in_unit(value_rad, digits, ANGLES)


def _in_unit(value: float, digits: int, units: Sequence[tuple[float, str]]) -> str:
    if not math.isfinite(value):
        return DASH
    size, name = next(((s, n) for s, n in units if abs(value) >= s), units[-1])
    return f"{significant(value / size, digits)} {name}"


def decimals_of(sigma: float) -> int:
    """Decimals that show two digits of the doubt."""
    if not (math.isfinite(sigma) and sigma > 0.0):
        return 3
    return max(0, 1 - math.floor(math.log10(sigma)))


def aligned(numbers: Sequence[str]) -> list[str]:
    """The same numbers with spaces behind, so that right-aligned they line up at the decimal point."""
    most = max((_behind(n) for n in numbers), default=0)
    return [n + _space(most, _behind(n)) for n in numbers]


def _behind(number: str) -> int:
    return len(number.partition(".")[2])


def _space(most: int, own: int) -> str:
    return DIGIT_SPACE * (most - own) + (POINT_SPACE if own == 0 and most > 0 else "")
