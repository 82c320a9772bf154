"""Which times a foreign table may have, in the unit of its column."""

from collections.abc import Sequence
from decimal import Decimal

import numpy as np

from acquisition.recording.errors import SamplesError
from acquisition.recording.files.plausible import time_fault
from acquisition.recording.foreign.heading_units import Unit
from acquisition.recording.foreign.sheet import Sheet


def check_times(sheet: Sheet, column: int, times: Sequence[int | float | Decimal], unit: Unit | None) -> None:
    """SamplesError for a time that cannot be, naming file, row, column, value and remedy. `unit`: None of dates."""
    try:
        times_s = np.array([float(t) for t in times]) * (1.0 if unit is None else unit.factor)
    except OverflowError as error:  # a whole number of hundreds of digits
        raise SamplesError(f"{sheet.place(None, column)}: a time has hundreds of digits; correct it") from error
    if (fault := time_fault(times_s)) is not None:
        raise SamplesError(f"{sheet.place(fault[0], column)}: {fault[1]}")
