"""One entry of the catalogue as a record: what it is, and where a session allows it."""

from collections.abc import Callable
from dataclasses import dataclass

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.term import Holds, Missing, Term


def nothing_missing(drivers: Drivers) -> tuple[Missing, ...]:
    """Of effects whose drivers every session holds."""
    return ()


@dataclass(frozen=True)
class Kind:
    """Implements effects.term.Effect."""

    physics: str
    explains: str
    mistaken_for: tuple[str, ...]
    source: str
    terms: Callable[[Drivers], tuple[Term, ...]]
    missing: Callable[[Drivers], tuple[Missing, ...]] = nothing_missing
    holds: Holds = Holds.ALWAYS
