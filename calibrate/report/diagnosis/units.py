"""The unit of a parameter as a person reads it, from the unit in its name and its size."""

from calibrate.effects.term import UNITS
from calibrate.report.quantities import TIED

# Of streams, beside those of the catalogue; the first ending that fits is taken.
OF_STREAMS = (("_s_per_s", 1e6, "µs per s"), ("_s2", 1e6, "ms²"), ("_hz", 1.0, "Hz"), ("_count", 1.0, ""))


def unit_of(name: str, value: float) -> tuple[float, str]:
    """Factor, and the unit with the space before it; one and nothing where the name says none."""
    for ending, factor, unit in OF_STREAMS:
        if name.endswith(ending):
            return factor, f"{TIED}{unit}" if unit else ""
    for ending, steps in UNITS:
        if name.endswith(ending):
            factor, unit = next((factor, unit) for least, factor, unit in steps if abs(value) >= least)
            return factor, f"{TIED}{unit}"
    return 1.0, ""
