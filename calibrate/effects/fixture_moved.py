"""The fixture was bumped, or drifts, while it stood at one place."""

import numpy as np

from calibrate.effects import time_laws
from calibrate.effects.drivers import Drivers
from calibrate.effects.kind import Kind
from calibrate.effects.moved import in_use, motion
from calibrate.effects.term import Holds, Shape, Term


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    spots = drivers.light
    if spots is None or spots.place is None:
        return ()
    out: list[Term] = []
    for place in np.unique(spots.place[spots.seen]).tolist():
        at_place = spots.seen & (spots.place == place)

        there = in_use(at_place)

        what = f"The fixture at place {place}"
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


EFFECT = Kind(
    "fixture-moved",
    "Someone leans on the fixture, or its magnet creeps: from then on it stands elsewhere.",
    ("base-moved", "encoder-slip"),
    "mismatch catalogue: fixture k bump",
    _terms,
    holds=Holds.SESSION,
)
