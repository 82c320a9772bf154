"""Whether a session holds any length at all: without one the size of the arm is not measured, whatever the fit says."""

from collections.abc import Iterable

from calibrate.sensors.catalogue import names_with
from calibrate.sensors.kind import Trait

SCALELESS = set(names_with(Trait.SCALELESS))  # cones: an arm half as large would sit in cones half as far apart


def scale_alarms(instruments: Iterable[str]) -> tuple[str, ...]:
    """A sentence for a session of cones alone; none where any instrument measures a length.

    A factor on all lengths of arm and seats leaves tip less seat at zero: a point-only fit cannot fix scale.
    """
    if set(instruments) != SCALELESS:
        return ()
    return (
        "cones alone show no length: the size of the arm is that of the drawing, and every length that it measures is "
        "as uncertain as that; measure a bar of known length ([[bar]], columns bar and bar_end) as well",
    )
