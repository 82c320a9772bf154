"""Faults of wires go to a log, once for each place, so that a client that sends rubbish at full speed fills no disk."""

import sys
from collections.abc import Callable

Log = Callable[[str], None]


def log_to_stderr(line: str) -> None:
    """The standard log: one line on stderr, never on stdout, which belongs to the announcement."""
    print(line, file=sys.stderr, flush=True)


class Report:
    """Logs the first fault of every place and of every kind; counts them all."""

    def __init__(self, log: Log) -> None:
        self._log = log
        self._told: set[tuple[str, str]] = set()
        self.count = 0

    def fault(self, place: str, fault: Exception) -> None:
        self.count += 1
        kind = (place, type(fault).__name__)
        if kind not in self._told:
            self._told.add(kind)
            self._log(f"{place}: {type(fault).__name__}: {fault} (further ones of this kind are not logged)")
