"""The catalogue at one set of drivers: states of a search share it as long as their drivers are the same."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.effects.catalogue import terms_of
from calibrate.effects.drivers import Drivers
from calibrate.effects.form import Form, Functions
from calibrate.effects.term import Term

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Listed:
    """What is asked for at every state, once."""

    drivers: Drivers
    values: dict[tuple[Functions, bytes], Floats] = field(default_factory=dict[tuple[Functions, bytes], Floats])

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """All that the session allows."""
        return terms_of(self.drivers)

    def function(self, term: Form, inner: Floats) -> Floats:
        """(sample, m) along each direction of a term; kept where a menu asks for it and it costs more than to keep it."""
        if term.open or not all(value in spec.grid for value, spec in zip(inner, term.inner, strict=False)):
            return term.function(self.drivers, inner)
        key = (term.function, inner.tobytes())
        if key not in self.values:
            self.values[key] = term.function(self.drivers, inner)
        return self.values[key]
