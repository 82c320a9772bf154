"""What the search sees: a session around one fitted state, whitened, as plain rows; and the seam to the fit itself.

`State` is calibrate/diagnose/state/fitted.py on real sessions; tests may bring a linear one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose import limits
from calibrate.fit.noise import sigma_about_zero
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.term import Accepted, Term

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class WhitenedRows:
    """Whitened rows: first those of the data, then one for every prior. Unit noise where the model holds."""

    residual: Floats  # (row,) observed minus expected, robust weights included
    geometry: Floats  # (row, param) derivative of expected by everything already fitted, in plausible units
    sample: Ints  # (row,) of the data rows: index of the sample, -1 of prior rows
    group: Ints  # (row,) data rows of one observation (the k values read at one pose) share a number; -1 prior rows
    instrument: Ints  # (row,) index of the instrument, -1 prior rows
    owner: Ints  # (param,) of geometry: index in State.accepted whose value it is, -1: geometry proper
    stated: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.intp))  # rows of what a known model states
    earlier: Ints | None = (
        None  # (row,) sample of the reading that was taken out of this row, -1: none; None: of no row
    )
    kept: Floats | None = None  # (row,) share in which it was

    @property
    def data(self) -> NDArray[np.bool_]:
        return self.sample >= 0


@dataclass(frozen=True)
class UnseenMisfits:
    """One instrument's observations that the fit has not seen."""

    instrument: str
    sample: Ints  # (observation,)
    misfit: Floats  # (observation, k) observed minus expected, in the instrument's unit
    whitened: Floats  # (observation, k) by the noise of the fit, without robust weights


def tame(misfit: Floats, least: float) -> NDArray[np.bool_]:
    """(observation,) that are not wild by the spread of all (observation, k), `least` at least: a gross error no model
    is to blame for. Where each would be wild, the spread shows nothing, and none is.
    """
    spread = max(float(sigma_about_zero(misfit)), least)
    near = np.max(np.abs(misfit), axis=1) <= limits.OUTLYING_SIGMAS * spread
    return near | ~np.any(near)


class State(Protocol):
    """A session with geometry and terms fitted. Immutable: every verb gives another state."""

    @property
    def accepted(self) -> tuple[Accepted, ...]: ...

    @property
    def rows(self) -> WhitenedRows:
        """Linearised at this state; `geometry` holds geometry and the coefficients and inner values of `accepted`."""
        ...

    @property
    def minus_two_log_likelihood(self) -> float:
        """Of the data under Student-t noise of the size that this state estimated, priors included; compares states
        of one session through BIC.
        """
        ...

    @property
    def samples(self) -> int: ...

    @property
    def most_search_rows(self) -> int:
        """Data rows that a search works on at most; of more, samples are drawn."""
        ...

    @property
    def distrusted(self) -> int:
        """Observations that robust weights have all but taken out."""
        ...

    def trusting(self) -> Self:
        """The same values, every observation with its full weight."""
        ...

    @property
    def drivers(self) -> Drivers:
        """Of all samples of the session, as this state predicts them."""
        ...

    def columns(self, term: Term, inner: Floats) -> Floats:
        """(row, coefficient) whitened derivative of expected by a term's coefficients at zero; zero in prior rows."""
        ...

    def columns_at(self, term: Term, inner: Sequence[Floats]) -> Floats:
        """(inner, coefficient, row) the same at several values of the inner parameters."""
        ...

    def candidates(self) -> Sequence[Term]:
        """All terms that the session allows, drivers refreshed from this state."""
        ...

    def refitted(self, accepted: Sequence[Accepted]) -> Self:
        """Joint non-linear refit of geometry and these terms from the values given; noise and weights follow."""
        ...

    def renewed(self) -> Self:
        """Fitted again, with drivers at its own values: on the way they may be those of a state before."""
        ...

    def select(self, samples: Ints) -> Self:
        """The same model over some of the samples, not refitted."""
        ...

    def held_out(self, samples: Ints) -> tuple["UnseenMisfits", ...]:
        """What this state, fitted on other samples, predicts of these. Where a place or seat occurs in these samples
        only, its own frame or point is found from them first, everything else being held.
        """
        ...
