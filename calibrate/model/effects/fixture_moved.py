"""The fixture was bumped, or drifts, while it stood at one place."""

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects import time_laws
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.moved import in_use, motion
from calibrate.model.effects.term import Holds, Shape, Term
from calibrate.model.effects.time_laws import Law

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

CARRIED, TAKEN_AWAY = ", until carried", " until it was taken away"
ONE_BODY = "all stations"  # a fixture that holds its stations together moves them all
IN_TURNS = 3  # changes of station for each of them


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    spots = drivers.light
    if spots is None or spots.place is None:
        return ()
    out: list[Term] = []
    in_turns = _in_turns(drivers, spots.place, spots.seen)
    if in_turns and (inner := time_laws.step_inner(drivers, spots.seen)):
        there, what = in_use(spots.seen), "The fixture with all its stations"
        out.append(
            motion(
                "fixture.pose", "fixture-moved", "t", Shape.STEP, time_laws.step, what, inner, there, variant=ONE_BODY
            )
        )
    for place in np.unique(spots.place[spots.seen]).tolist():
        at_place = spots.seen & (spots.place == place)
        there, what, variant = in_use(at_place), f"The fixture at station {place}", f"place {place}"
        step = ("fixture.pose", "fixture-moved", "t", Shape.STEP)
        if inner := time_laws.step_inner(drivers, at_place):
            out.append(motion(*step, time_laws.step, what, inner, there, variant=variant))
        stay = _stays(drivers, spots.place, spots.seen)
        taken_away = at_place & (stay < stay[at_place].max())  # in the last stay both laws are one
        if not in_turns and (inner := time_laws.step_inner(drivers, taken_away)):
            carried = _until_carried(at_place, stay)
            out.append(motion(*step, carried, what, inner, there, variant=variant + CARRIED, ending=TAKEN_AWAY))
        steady = (Shape.LINEAR, time_laws.steadily, what)
        out.append(motion("fixture.pose", "fixture-moved", "t", *steady, (), there, variant=variant))
    return tuple(out)


def _until_carried(at_place: Bools, stay: Ints) -> Law:
    """(pose, 1) one after a time, while the fixture stays at its station: put there again, it stands as before."""

    def law(drivers: Drivers, inner: Floats) -> Floats:
        after = at_place & (drivers.t_s >= inner[0])
        if after.any() and np.isfinite(inner[0]):  # always there: every stay would have felt it
            after &= stay == stay[np.flatnonzero(after)[np.argmin(drivers.t_s[after])]]
        return after.astype(float)[:, None]

    return law


def _stays(drivers: Drivers, place: Ints, seen: Bools) -> Ints:
    """(pose,) how often the fixture had been carried to another station by then; -1 where no station was seen."""
    order = np.flatnonzero(seen)[np.argsort(drivers.t_s[seen], kind="stable")]
    out = np.full(len(seen), -1, dtype=np.int64)
    out[order] = np.concatenate([[0], np.cumsum(np.diff(place[order]) != 0)])
    return out


def _in_turns(drivers: Drivers, place: Ints, seen: Bools) -> bool:
    """Whether the arm goes to and fro between stations; one fixture that is carried stays at each for a while."""
    visited = place[seen][np.argsort(drivers.t_s[seen], kind="stable")]
    stations = len(np.unique(visited))
    return stations > 1 and int(np.sum(np.diff(visited) != 0)) >= IN_TURNS * stations


EFFECT = Kind(
    "fixture-moved",
    "Someone leans on the fixture, or its magnet creeps: from then on it stands elsewhere.",
    ("base-moved", "encoder-slip"),
    "mismatch catalogue: fixture k bump",
    _terms,
    holds=Holds.SESSION,
)
