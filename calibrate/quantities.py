"""Numbers for a person: a unit that fits, as many digits as the sigma leaves, columns that line up at the point."""

import math
from collections.abc import Sequence

MINUS = "\N{MINUS SIGN}"
DIGIT_SPACE = "\N{FIGURE SPACE}"  # as wide as a digit
POINT_SPACE = "\N{PUNCTUATION SPACE}"  # as wide as a point
DASH = "\N{EN DASH}"
TIED = "\N{NO-BREAK SPACE}"  # a number and its unit stay on one line

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
LENGTHS = ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm"))
ANGLES = ((1.0, "rad"), (1e-3, "mrad"), (1e-6, "µrad"), (1e-9, "nrad"))


def decimals_of(sigma: float) -> int:
    """Decimals that show two digits of the uncertainty."""
    if not (math.isfinite(sigma) and sigma > 0.0):
        return 3
    return max(0, 1 - math.floor(math.log10(sigma)))


def fixed(value: float, decimals: int) -> str:
    """A number with so many decimals and a real minus sign; a dash where there is no number."""
    if not math.isfinite(value):
        return DASH
    return f"{value:z.{decimals}f}".replace("-", MINUS)


def significant(value: float, digits: int = 3) -> str:
    """A number with so many significant digits; '1.8 × 10⁻¹⁰' outside 1e-4 to 1e5."""
    if not math.isfinite(value) or value == 0.0:
        return DASH if not math.isfinite(value) else "0"
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    size = int(exponent)
    if not -5 < size < 5:
        return f"{mantissa}{TIED}×{TIED}{power_of_ten(size)}".replace("-", MINUS)
    return fixed(round(value, digits - 1 - size), max(0, digits - 1 - size))


def power_of_ten(exponent: int) -> str:
    """'10⁵', in plain text."""
    return "10" + str(exponent).translate(RAISED)


def counted(number: int, thing: str) -> str:
    """'1 row', '12 rows': a number of things whose plural takes an s."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def length(value_m: float, digits: int = 3) -> str:
    """A length in the unit that gives 1 to 1000 of it: '1.92 µm'."""
    return _in_unit(value_m, digits, LENGTHS)


def angle(value_rad: float, digits: int = 3) -> str:
    """An angle in the unit that gives 1 to 1000 of it: '3.66 µrad'."""
    return _in_unit(value_rad, digits, ANGLES)


def _in_unit(value: float, digits: int, units: Sequence[tuple[float, str]]) -> str:
    if not math.isfinite(value):
        return DASH
    size, name = _fitting(value, units)
    return f"{significant(value / size, digits)}{TIED}{name}"


def stated(value_m: float) -> str:
    """A length that somebody chose, without digits that nobody chose: '5 µm'."""
    size, name = _fitting(value_m, LENGTHS)
    return f"{value_m / size:.6g}{TIED}{name}"


def length_with_sigma(value_m: float, sigma_m: float) -> str:
    """A length with its uncertainty in one unit: '136 ± 17 nm'."""
    return _with_sigma(value_m, sigma_m, LENGTHS)


def angle_with_sigma(value_rad: float, sigma_rad: float) -> str:
    """An angle with its uncertainty in one unit: '3.12 ± 0.16 µrad'."""
    return _with_sigma(value_rad, sigma_rad, ANGLES)


def _with_sigma(value: float, sigma: float, units: Sequence[tuple[float, str]]) -> str:
    size, name = _fitting(value, units)
    decimals = decimals_of(sigma / size)
    return f"{fixed(value / size, decimals)}{TIED}±{TIED}{fixed(sigma / size, decimals)}{TIED}{name}"


def _fitting(value: float, units: Sequence[tuple[float, str]]) -> tuple[float, str]:
    """The largest unit of which there is at least one; rounding 999.7 nm up to 1000 nm is allowed for."""
    return next(((s, n) for s, n in units if abs(value) >= 0.9995 * s), units[-1])


def aligned(numbers: Sequence[str]) -> list[str]:
    """The same numbers with spaces behind, so that right-aligned they line up at the decimal point."""
    most = max((_behind(n) for n in numbers), default=0)
    return [n + _space(most, _behind(n)) for n in numbers]


def _behind(number: str) -> int:
    return len(number.partition(".")[2])


def _space(most: int, own: int) -> str:
    return DIGIT_SPACE * (most - own) + (POINT_SPACE if own == 0 and most > 0 else "")
