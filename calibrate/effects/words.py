"""Sizes as an engineer reads them: "68 ± 2 µrad per Nm". The unit comes from the end of the name."""

import math

from calibrate.effects.term import Size

NOT_TOLD = "(not determined by these data)"

# Ending of a name, with (from this size on, factor, unit), largest first. The first ending that fits is taken.
Steps = tuple[tuple[float, float, str], ...]
UNITS: tuple[tuple[str, Steps], ...] = (
    ("phase_rad", ((0.0, 57.29577951308232, "°"),)),
    ("_rad_per_rad", ((1e-2, 1e3, "mrad per rad"), (0.0, 1e6, "µrad per rad"))),
    ("_rad_nm", ((1e-2, 1e3, "mrad per Nm"), (0.0, 1e6, "µrad per Nm"))),
    ("_rad_n", ((0.0, 1e6, "µrad per N"),)),
    ("_rad_per_k", ((0.0, 1e6, "µrad per K"),)),
    ("_m_per_k", ((1e-3, 1e3, "mm per K"), (0.0, 1e6, "µm per K"))),
    ("_share_per_k", ((0.0, 1e6, "ppm per K"),)),
    ("_per_k", ((0.0, 1e6, "µm per m and K"),)),
    ("waves_x_per_m", ((0.0, 1e-3, "a mm"),)),
    ("waves_y_per_m", ((0.0, 1e-3, "a mm"),)),
    ("_per_m_per_m", ((0.0, 1e6, "ppm per m²"),)),
    ("_per_m", ((0.0, 1e6, "ppm per m"),)),
    ("_nm", ((0.0, 1.0, "Nm"),)),
    ("_rad", ((1e-2, 1e3, "mrad"), (0.0, 1e6, "µrad"))),
    ("_m", ((1.0, 1.0, "m"), (1e-3, 1e3, "mm"), (0.0, 1e6, "µm"))),
    ("_s", ((60.0, 1.0, "s"), (1.0, 1.0, "s"), (0.0, 1e3, "ms"))),
    ("_share", ((1e-3, 1e2, "%"), (0.0, 1e6, "ppm"))),
    ("_per_turn", ((0.0, 1.0, "a turn"),)),
)


def plain(name: str, size: Size) -> str:
    """Value, doubt and unit of a size with its unit in its name: 68 ± 2 µrad per Nm. No number without a doubt."""
    if not math.isfinite(size.sigma):
        return NOT_TOLD
    for ending, steps in UNITS:
        if name.endswith(ending):
            scale, unit = next((s, u) for least, s, u in steps if abs(size.value) >= least)
            space = "" if unit in ("°", "%") else " "
            return f"{_digits(scale * size.value, 4)} ± {_digits(scale * size.sigma, 2)}{space}{unit}"
    return f"{_digits(size.value, 4)} ± {_digits(size.sigma, 2)}"


def _digits(value: float, count: int) -> str:
    """So many significant ones, and the whole number where it has more: 409, not 4.1e+02."""
    return f"{value:.{count}g}" if abs(value) < 10.0**count - 0.5 else f"{value:.0f}"
