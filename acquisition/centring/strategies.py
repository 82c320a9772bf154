"""The centring strategies by name; a new one is a class with `learn` and `propose`, and one line here."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from acquisition.centring.believed import BelievedArm, FixtureOptics
from acquisition.centring.loop import Centring, Strategy
from acquisition.centring.measured import MeasuredStrategy
from acquisition.centring.registered import FIRST_GAIN, FixedGuess, Registered
from acquisition.errors import AcquisitionError

Floats = NDArray[np.float64]

KNOWN_GAIN = 1.0  # of the first step, after a lit pose: the fixture pose is known there, not guessed


class CentringBy(Enum):
    """By the word of the command line."""

    REGISTERED = "registered"  # law (8), the fixture pose corrected from every reading
    MEASURED = "measured"  # the Jacobian from four probing moves, the fixture pose not trusted at all
    LAW8 = "law8"  # the source's own law, with the fixture pose as it was guessed


@dataclass(frozen=True)
class CentringChoice:
    """How the beam is centred; `gain` is k of law (8), and without meaning for the other two."""

    by: CentringBy = CentringBy.REGISTERED
    gain: float = 0.5

    @classmethod
    def asked(cls, by: CentringBy, gain: float) -> "CentringChoice":
        """AcquisitionError for a gain that cannot be, or of a strategy that has none."""
        if not 0.0 < gain <= 1.0:
            raise AcquisitionError(f"--gain {gain:g}: the share of a correction, above 0 and up to 1")
        if gain != cls.gain and by is not CentringBy.LAW8:
            raise AcquisitionError(f"--gain {gain:g} with --centring {by.value}: only law8 has a gain")
        return cls(by, gain)

    def strategy(
        self, arm: BelievedArm, optics: FixtureOptics, T_base_fixture: Floats, first: int, *, known: bool
    ) -> Strategy:
        """A strategy for one run; `known`: T_base_fixture is right where the arm stands, from an earlier lit pose."""
        make: Mapping[CentringBy, Callable[[], Strategy]] = {
            CentringBy.REGISTERED: lambda: Registered(
                arm, optics, T_base_fixture, first, KNOWN_GAIN if known else FIRST_GAIN
            ),
            CentringBy.MEASURED: lambda: MeasuredStrategy(arm, optics, T_base_fixture, first),
            CentringBy.LAW8: lambda: FixedGuess(arm, optics, T_base_fixture, first, self.gain),
        }
        return make[self.by]()


def fixture_after(
    run: Centring, strategy: Strategy, arm: BelievedArm, optics: FixtureOptics, T_base_fixture: Floats, first: int
) -> Floats:
    """T_base_fixture (4, 4) as the readings of a run have it, whatever strategy made them; for the next pose."""
    if isinstance(strategy, Registered):
        return strategy.T_base_fixture
    registered = Registered(arm, optics, T_base_fixture, first)
    for step in run.trace:
        if np.isfinite(step.spots_m).all():
            registered.learn(step.q_rad, step.spots_m)
    return registered.T_base_fixture


REGISTERED = CentringChoice()  # what sessions use
