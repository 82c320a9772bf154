"""The fixture was bumped, or drifts, while it stood at one place."""

import numpy as np
from numpy.typing import NDArray

from calibrate.effects import time_laws
from calibrate.effects.drivers import Drivers
from calibrate.effects.kind import Kind
from calibrate.effects.moved import in_use, motion
from calibrate.effects.term import Holds, Shape, Term

ONE_BODY = "all stations"  # a fixture that holds its stations together moves them all
IN_TURNS = 3  # changes of station for each of them


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    spots = drivers.light
    if spots is None or spots.place is None:
        return ()
    out: list[Term] = []
    if _in_turns(drivers, spots.place, spots.seen) and (inner := time_laws.step_inner(drivers, spots.seen)):
        there, what = in_use(spots.seen), "The fixture with all its stations"
        out.append(
            motion(
                "fixture.pose", "fixture-moved", "t", Shape.STEP, time_laws.step, what, inner, there, variant=ONE_BODY
            )
        )
    for place in np.unique(spots.place[spots.seen]).tolist():
        at_place = spots.seen & (spots.place == place)

        there = in_use(at_place)

        what = f"The fixture at station {place}"
        if inner := time_laws.step_inner(drivers, at_place):
            out.append(
                motion(
                    "fixture.pose",
                    "fixture-moved",
                    "t",
                    Shape.STEP,
                    time_laws.step,
                    what,
                    inner,
                    there,
                    variant=f"place {place}",
                )
            )
        out.append(
            motion(
                "fixture.pose",
                "fixture-moved",
                "t",
                Shape.LINEAR,
                time_laws.steadily,
                what,
                (),
                there,
                variant=f"place {place}",
            )
        )
    return tuple(out)


def _in_turns(drivers: Drivers, place: NDArray[np.int64], seen: NDArray[np.bool_]) -> bool:
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
