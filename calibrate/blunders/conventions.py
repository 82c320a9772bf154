"""Files written by another convention: every known one is tried against the arm as drawn, and the winner is named.

A hypothesis wins where it alone brings the strain between arm and readings down to a fraction. A real arm lies a few
millimetres beside its drawing, a wrong convention decimetres, so the two are never mixed up. What drawn things would
have to move counts too: half a turn of a wrist joint can look like a target on the other side. Two mistakes at once
are tried where one leaves a gross strain. What the readings cannot tell apart from the file as written is not named.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.blunders import coupling, degrees, offsets, signs
from calibrate.blunders.finding import Blunder
from calibrate.blunders.hypothesis import Hypothesis
from calibrate.blunders.witness import Otherwise, Strain, Witness

Floats = NDArray[np.float64]
Flange = Callable[[Floats], Floats]

KNOWN = (degrees.hypotheses, signs.hypotheses, offsets.hypotheses, coupling.hypotheses)

GAIN = 4.0  # by which the strain must fall
RIVAL = 1.5  # times the winner's strain: as good an explanation
NOTHING_M = 2e-5  # no instrument says less: perfect data must not tell conventions apart by their rounding
GROSS = 0.05  # of the reach: more than joint zeros 2 deg off explain, so that something else is wrong, or two things
CARRIED_M = 0.3  # from the flange, along each of its axes: a beam's usual travel, a long probe


@dataclass(frozen=True)
class _Account:
    """No, one or two conventions, the strain that is left then, and how far the arm reaches by them."""

    said: tuple[Hypothesis | Otherwise, ...]
    strain: Strain
    reach_m: float

    @property
    def gross(self) -> bool:
        """Whether more than an arm beside its drawing is left; one that would hardly move satisfies cones, too."""
        return self.strain.typical_m > GROSS * self.reach_m


def wrong_convention(flange: Flange, witnesses: Sequence[Witness]) -> Blunder | None:
    """The convention (or two) that explains the readings when those of the rig do not; None if they do.

    `flange` maps angles (pose, joint) to (pose, 4, 4) of the arm as drawn.
    """
    if not witnesses:
        return None
    search = _Search(flange, tuple(witnesses))
    before = search.account(witnesses)
    found, tried = before, [before]
    for family in (search.singles, search.doubles):
        if family == search.doubles and not found.gross:
            break
        accounts = [account for account in family() if not account.gross]
        best = min(accounts, key=_compared, default=found)
        if _explains(best, found):
            found, tried = best, accounts
    return None if found is before else _named(found, tried, before)


def strain_of(flange: Flange, witnesses: Sequence[Witness]) -> Strain:
    """Of all instruments together, the file being right as it is written."""
    return _Search(flange, tuple(witnesses)).account(witnesses).strain


@dataclass(frozen=True)
class _Search:
    flange: Flange
    witnesses: tuple[Witness, ...]

    def account(
        self, witnesses: Sequence[Witness], *hypotheses: Hypothesis, besides: tuple[Otherwise, ...] = ()
    ) -> _Account:
        """Of all instruments together, their angles read by these conventions one after the other."""
        strain, reach_m = Strain(0.0, 0.0), 0.0
        for witness in witnesses:
            q = witness.q_rad
            for hypothesis in hypotheses:
                q = hypothesis.angles(q)
            T_base_flange = self.flange(q)
            strain = strain + witness.strain(T_base_flange)
            reach_m = max(reach_m, _reach_m(T_base_flange))
        return _Account((*hypotheses, *besides), strain, reach_m)

    def singles(self) -> Iterator[_Account]:
        for hypothesis in self._of_angles():
            yield self.account(self.witnesses, hypothesis)
        for other, witnesses in _of_readings(self.witnesses):
            yield self.account(witnesses, besides=(other,))

    def doubles(self) -> Iterator[_Account]:
        """Degrees are undone first, then signs, then zeros, then couplings."""
        angles = list(self._of_angles())
        for i, first in enumerate(angles):
            for second in angles[i + 1 :]:
                if (first.kind, first.column) != (second.kind, second.column):
                    yield self.account(self.witnesses, first, second)
        for other, witnesses in _of_readings(self.witnesses):
            for hypothesis in angles:
                yield self.account(witnesses, hypothesis, besides=(other,))
            for second, both in _of_readings(witnesses):
                if second.kind is not other.kind:
                    yield self.account(both, besides=(other, second))

    def _of_angles(self) -> Iterator[Hypothesis]:
        for family in KNOWN:
            yield from family(self.witnesses[0].q_rad.shape[1])


def _of_readings(witnesses: tuple[Witness, ...]) -> Iterator[tuple[Otherwise, tuple[Witness, ...]]]:
    for i, witness in enumerate(witnesses):
        for other in witness.otherwise():
            yield other, (*witnesses[:i], other.witness, *witnesses[i + 1 :])


def _reach_m(T_base_flange: Floats) -> float:
    """How far what the flange carries usually is from the middle of where it goes: turning on the spot counts, too."""
    carried = T_base_flange[:, None, :3, 3] + CARRIED_M * np.swapaxes(T_base_flange[:, :3, :3], 1, 2)
    return float(np.median(np.linalg.norm(carried - np.median(carried, axis=0), axis=2)))


def _compared(account: _Account) -> float:
    return account.strain.compared_m


def _explains(account: _Account, known: _Account) -> bool:
    """Whether a fraction is left of the distance, or of it with what drawn things must move, which never grows."""
    after, before = account.strain, known.strain
    falls = _ratio(before.compared_m, after.compared_m), _ratio(before.typical_m, after.typical_m)
    return max(falls) > GAIN and after.compared_m < before.compared_m


def _ratio(before_m: float, after_m: float) -> float:
    return (before_m + NOTHING_M) / (after_m + NOTHING_M)


def _named(best: _Account, tried: list[_Account], before: _Account) -> Blunder:
    """The winner; others that explain the file as well are told in the same breath."""
    winners = [a for a in tried if _ratio(a.strain.compared_m, best.strain.compared_m) < RIVAL and a is not best]
    others = "".join(f"; or {_in_words(a)}" for a in winners)
    after_mm, before_mm = 1e3 * best.strain.typical_m, 1e3 * before.strain.typical_m
    figures = f"(arm and readings agree to {after_mm:.2g} mm then, to {before_mm:.3g} mm as written)"
    if _ratio(before_mm, after_mm) < GAIN:
        figures = "(only then is what the rig draws where it is drawn)"
    first = best.said[0]
    besides = "".join(f"; and {other.column}: {other.what}" for other in best.said[1:])
    remedy = "; and ".join(one.remedy for one in best.said)
    return Blunder(first.kind, (), first.column, f"{first.what}{besides} {figures}{others}", remedy)


def _in_words(account: _Account) -> str:
    return " and ".join(f"{one.column}: {one.what}" for one in account.said)
