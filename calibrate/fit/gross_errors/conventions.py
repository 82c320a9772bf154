"""Files written by another convention: every known one is tried against the nominal arm, and the winner is named.

A hypothesis wins where it alone brings the strain between arm and readings down to a fraction. A real arm lies a few
millimetres beside its drawing, a wrong convention decimetres, so the two are never mixed up. What drawn things would
have to move counts too: half a turn of a wrist joint can resemble a target on the other side. Two mistakes at once
are tried where one leaves a gross strain. What the readings cannot separate from the file as written is not named.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.gross_errors import joint_hypotheses
from calibrate.fit.gross_errors.joint_hypotheses import Hypothesis
from calibrate.model.checks.gross_error import GrossError, GrossErrorKind
from calibrate.model.checks.rough_fit import median
from calibrate.model.checks.witness import Otherwise, Strain, Witness

Floats = NDArray[np.float64]
Flange = Callable[[Floats], Floats]
_Trial = tuple[Hypothesis, ...]  # by which the angles are read, one after the other

KNOWN = (joint_hypotheses.in_degrees, joint_hypotheses.turned, joint_hypotheses.shifted, joint_hypotheses.coupled)

GAIN = 4.0  # by which the strain must fall
RIVAL = 1.5  # times the winner's strain: as good an explanation
SMALL_M = 1e-4  # misfit of a file as written that no convention is needed for
NOTHING_M = 2e-5  # no instrument shows less: rounding of perfect data must not separate conventions
GROSS = 0.05  # of the reach: more than joint zeros 2 deg off explain, so that something else is wrong, or two things
SIDE_BY_SIDE = 16  # trials evaluated at once: a hundred poses of so many stay in the processor's cache
CARRIED_M = 0.3  # from the flange, along each of its axes: a beam's usual travel, a long probe
NAMED = 3  # other explanations in a message; the rest is counted


@dataclass(frozen=True)
class _Account:
    """No, one or two conventions, the strain that is left then, and how far the arm reaches by them."""

    said: tuple[Hypothesis | Otherwise, ...]
    strain: Strain
    reach_m: float

    @property
    def gross(self) -> bool:
        """Whether more than an arm beside its drawing is left; one that would hardly move satisfies cones, too."""
        return bool(self.strain.typical_m > GROSS * self.reach_m)

    @property
    def reflected(self) -> bool:
        """Whether the readings of a device are mirrored."""
        return any(one.kind is GrossErrorKind.MIRRORED_AXIS for one in self.said)

    @property
    def signs(self) -> tuple[int, ...]:
        """Joints whose sign it changes."""
        return tuple(j for one in self.said if isinstance(one, Hypothesis) for j in one.signs)

    @property
    def besides(self) -> tuple[str, ...]:
        """Its conventions apart from joint signs and reflection."""
        return tuple(
            f"{one.column}: {one.what}"
            for one in self.said
            if one.kind not in (GrossErrorKind.JOINT_SIGN, GrossErrorKind.MIRRORED_AXIS)
        )

    @property
    def mistakes(self) -> int:
        """How many things are otherwise than written; every sign is one."""
        return sum(max(len(one.signs), 1) if isinstance(one, Hypothesis) else 1 for one in self.said)


def wrong_convention(flange: Flange, witnesses: Sequence[Witness]) -> GrossError | None:
    """The convention (or two) that explains the readings when those of the rig do not; None if they do.

    `flange` maps angles (pose, joint) to (pose, 4, 4) of the nominal arm.
    """
    if not witnesses:
        return None
    search = _Search(flange, tuple(witnesses))
    before = search.account(witnesses)
    found, tried = before, [before]
    for family in (search.singles, search.doubles):
        if family == search.doubles and not found.gross:
            break
        accounts = [account for account in family(before) if not account.gross]
        best = min(accounts, key=_compared, default=found)
        if _explains(best, found):
            found, tried = _simplest(best, accounts), accounts
    if found is before:
        return None
    if found.reflected:
        found, tried = _signs_first(search, found, tried)
    return _named(found, tried, before)


def wrong_table(flange: Flange, other: Flange, model: str, witnesses: Sequence[Witness]) -> GrossError | None:
    """The table of the arm read as `model`, which `other` follows, where that explains the readings and the rig's own
    reading of it does not; None otherwise. Flanges as in `wrong_convention`.
    """
    if not witnesses:
        return None
    before, after = (_Search(one, tuple(witnesses)).account(witnesses) for one in (flange, other))
    if after.gross or not _explains(after, before):
        return None
    figures = f"(misfit {1e3 * after.strain.typical_m:.2g} mm, as written {1e3 * before.strain.typical_m:.3g} mm)"
    what = f"the table follows the other convention of Denavit and Hartenberg, model '{model}' {figures}"
    remedy = f'state model = "{model}" in [arm] of the rig file'
    return GrossError(GrossErrorKind.TABLE_CONVENTION, (), "rig file, arm.model", what, remedy)


@dataclass(frozen=True)
class _Search:
    flange: Flange
    witnesses: tuple[Witness, ...]

    def account(self, witnesses: Sequence[Witness], besides: tuple[Otherwise, ...] = ()) -> _Account:
        """Of all instruments together, their angles as written."""
        (account,) = self.accounts(witnesses, [()], besides)
        return account

    def accounts(
        self, witnesses: Sequence[Witness], trials: Sequence[_Trial], besides: tuple[Otherwise, ...] = ()
    ) -> Iterator[_Account]:
        """Of all instruments together for every trial, their angles read by its conventions one after the other."""
        for first in range(0, len(trials), SIDE_BY_SIDE):
            some = trials[first : first + SIDE_BY_SIDE]
            strain, reach_m = Strain(np.zeros(len(some)), np.zeros(len(some))), np.zeros(len(some))
            for witness in witnesses:
                T_base_flange = self._poses(witness.q_rad, some)
                strain = strain + witness.strain(T_base_flange)
                reach_m = np.maximum(reach_m, _reach_m(T_base_flange))
            for case, hypotheses in enumerate(some):
                yield _Account((*hypotheses, *besides), strain.of_case(case), float(reach_m[case]))

    def _poses(self, q_rad: Floats, trials: Sequence[_Trial]) -> Floats:
        """(trial, pose, 4, 4) of the flange."""
        read: list[Floats] = []
        for hypotheses in trials:
            q = q_rad
            for hypothesis in hypotheses:
                q = hypothesis.angles(q)
            read.append(q)
        return self.flange(np.concatenate(read)).reshape(len(trials), len(q_rad), 4, 4)

    def singles(self, before: _Account) -> Iterator[_Account]:
        """One mistake; several joint signs are one where the file as written is far off, or its mirror image fits."""
        mirrored = False
        for other, witnesses in _of_readings(self.witnesses):
            account = self.account(witnesses, (other,))
            mirrored |= account.reflected and _explains(account, before)
            yield account
        trials = [(hypothesis,) for hypothesis in self._of_angles()]
        if before.gross or mirrored:
            trials += [(hypothesis,) for hypothesis in joint_hypotheses.sets(self._joints)]
        yield from self.accounts(self.witnesses, trials)

    def doubles(self, before: _Account) -> Iterator[_Account]:
        """Degrees are undone first, then signs, then zeros, then couplings."""
        del before
        angles = list(self._of_angles())
        pairs = [
            (first, second)
            for first, second in combinations(angles, 2)
            if (first.kind, first.column) != (second.kind, second.column) and not (first.signs and second.signs)
        ]
        yield from self.accounts(self.witnesses, pairs)
        for other, witnesses in _of_readings(self.witnesses):
            yield from self.accounts(witnesses, [(hypothesis,) for hypothesis in angles], (other,))
            for second, both in _of_readings(witnesses):
                if second.kind is not other.kind:
                    yield self.account(both, (other, second))

    def unreflected(self, account: _Account) -> Iterator[_Account]:
        """The same with one sign or several in place of its reflection."""
        angles = tuple(one for one in account.said if isinstance(one, Hypothesis))
        kept = [one for one in account.said if isinstance(one, Otherwise) and not _mirrors(one)]
        witnesses = self.witnesses
        for wanted in kept:
            witnesses = next(w for other, w in _of_readings(witnesses) if _same(other, wanted))
        turned = (*joint_hypotheses.turned(self._joints), *joint_hypotheses.sets(self._joints))
        yield from self.accounts(witnesses, [(*angles, hypothesis) for hypothesis in turned], tuple(kept))

    @property
    def _joints(self) -> int:
        return self.witnesses[0].q_rad.shape[1]

    def _of_angles(self) -> Iterator[Hypothesis]:
        for family in KNOWN:
            yield from family(self._joints)


def _of_readings(witnesses: tuple[Witness, ...]) -> Iterator[tuple[Otherwise, tuple[Witness, ...]]]:
    for i, witness in enumerate(witnesses):
        for other in witness.otherwise():
            yield other, (*witnesses[:i], other.witness, *witnesses[i + 1 :])


def _mirrors(other: Otherwise) -> bool:
    return other.kind is GrossErrorKind.MIRRORED_AXIS


def _same(one: Otherwise, other: Otherwise) -> bool:
    return (one.kind, one.column) == (other.kind, other.column)


def _reach_m(T_base_flange: Floats) -> Floats:
    """How far what the flange carries usually is from the middle of where it goes: turning on the spot counts, too.

    (trial,) of poses (trial, pose, 4, 4).
    """
    carried = T_base_flange[..., None, :3, 3] + CARRIED_M * np.swapaxes(T_base_flange[..., :3, :3], -1, -2)
    away = np.linalg.norm(carried - np.median(carried, axis=1, keepdims=True), axis=-1)
    return median(away.reshape(len(away), -1))


def _compared(account: _Account) -> float:
    """To a nanometre: of two that leave the same, the earlier is taken, whatever way the processor rounds."""
    return round(float(account.strain.compared_m), 9)


def _explains(account: _Account, known: _Account) -> bool:
    """Whether a fraction is left of the distance, or of it with what drawn things must move, which never grows.

    Where hardly any distance was there to begin with, the file is as the rig states, wherever the target sits.
    """
    after, before = account.strain, known.strain
    falls = _ratio(before.typical_m, after.typical_m)
    if before.typical_m > SMALL_M:  # else only drawn things move, and a drawing of a bracket decides nothing
        falls = max(falls, _ratio(before.compared_m, after.compared_m))
    return falls > GAIN and bool(after.compared_m < before.compared_m)


def _ratio(before_m: Floats, after_m: Floats) -> float:
    return float((before_m + NOTHING_M) / (after_m + NOTHING_M))


def _as_good(account: _Account, best: _Account) -> bool:
    """Whether arm and readings agree as well, with drawn things as near to where they are drawn."""
    return _ratio(account.strain.compared_m, best.strain.compared_m) < RIVAL


def _fits_as_well(account: _Account, best: _Account) -> bool:
    """Whether arm and readings agree as well, wherever the target then sits: a mirrored arm mirrors it, too."""
    return _ratio(account.strain.typical_m, best.strain.typical_m) < RIVAL


def _simplest(best: _Account, accounts: list[_Account]) -> _Account:
    """Of those that explain as much the one with the fewest mistakes: the sign of a joint that nobody sees is none."""
    return min((a for a in accounts if _as_good(a, best)), key=lambda a: (a.mistakes, _compared(a)))


def _signs_first(search: _Search, found: _Account, tried: list[_Account]) -> tuple[_Account, list[_Account]]:
    """The joint signs that do what a reflection does, and all that fits as well; the reflection where there are none.

    A target drawn beside the plane of the arm may have to move for it, which the message gives.
    """
    equal = [a for a in search.unreflected(found) if not a.gross and _fits_as_well(a, found)]
    if not equal:
        return found, tried
    return _simplest(min(equal, key=_compared), equal), [*equal, found]


def _named(best: _Account, tried: list[_Account], before: _Account) -> GrossError:
    """The winner; others that explain the file as well are named in the same message."""
    after_mm, before_mm = 1e3 * best.strain.typical_m, 1e3 * before.strain.typical_m
    figures = f"(misfit {after_mm:.2g} mm, as written {before_mm:.3g} mm)"
    if _ratio(before_mm, after_mm) < GAIN:
        figures = "(only then is what the rig draws where it is drawn)"
    figures += "; no set of joint signs explains it" if best.reflected else ""
    first = best.said[0]
    besides = "".join(f"; and {other.column}: {other.what}" for other in best.said[1:])
    what = f"{first.what}{besides} {figures}{_others(best, tried)}{_mirror_image(best, tried)}"
    remedy = "; and ".join(one.remedy for one in best.said)
    return GrossError(first.kind, (), first.column, what, remedy)


def _others(best: _Account, tried: list[_Account]) -> str:
    """What explains the file as well, joints whose sign changes nothing put together."""
    as_good = [a for a in tried if a is not best and not a.reflected and _as_good(a, best)]
    wider = [a for a in as_good if best.signs and set(best.signs) < set(a.signs) and a.besides == best.besides]
    unseen = sorted({j for a in wider for j in a.signs} - set(best.signs))
    out = f"; these readings leave the sign of {joint_hypotheses.in_words(tuple(unseen))} open" if unseen else ""
    rest = [a for a in as_good if a not in wider]
    out += "".join(f"; or {_in_words(a)}" for a in sorted(rest, key=_compared)[:NAMED])
    return out + (f"; or {len(rest) - NAMED} other explanations" if len(rest) > NAMED else "")


def _mirror_image(best: _Account, tried: list[_Account]) -> str:
    """The second explanation of a mirrored arm: the device's columns. Mended wrongly, they give a mirrored model."""
    if not best.signs:
        return ""
    twin = next((a for a in tried if a.reflected and a.besides == best.besides and _fits_as_well(a, best)), None)
    if twin is None:
        return ""
    column = next(one.column for one in twin.said if one.kind is GrossErrorKind.MIRRORED_AXIS).removeprefix("columns ")
    moved_mm, instead_mm = 1e3 * best.strain.moved_m, 1e3 * twin.strain.moved_m
    target = f" (target {instead_mm:.2g} mm off its drawing then, {moved_mm:.2g} mm by the signs)"
    target_text = "" if _as_good(best, twin) else target
    return f"; less likely: one of {column} is negated, or two are exchanged{target_text}"


def _in_words(account: _Account) -> str:
    return " and ".join(f"{one.column}: {one.what}" for one in account.said)
