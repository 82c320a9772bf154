"""The observability indices of a fit as a table, with what a bad condition means."""

from collections.abc import Iterator

from calibrate.model_file import ObservabilityRecord
from calibrate.observability import WELL_CONDITIONED
from calibrate.report.elements import Html, table, tag
from calibrate.report.quantities import DASH, significant


def observability(seen: ObservabilityRecord) -> Iterator[Html]:
    """O1 to O5 and the condition of what the data tell."""
    values = (seen.o1, seen.o2, seen.o3, seen.o4, seen.o5, seen.condition)
    row = tuple(DASH if value is None else significant(value) for value in values)
    caption = f"Observability of the {seen.parameters} parameters that the data determine"
    head = (*(f"O{k}" for k in range(1, 6)), "condition")
    yield table(head, [row], numeric=range(6), caption=caption)
    if seen.condition is not None and seen.condition > WELL_CONDITIONED:
        says = (
            f"A condition above {WELL_CONDITIONED:g} means that other poses would determine some parameters far better."
        )
        yield tag("p", says, cls="lead")
