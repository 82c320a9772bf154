"""A cone slid: from some moment on its centre is elsewhere."""

import numpy as np

from calibrate.effects import time_laws
from calibrate.effects.drivers import Drivers
from calibrate.effects.kind import Kind
from calibrate.effects.moved import in_use, motion
from calibrate.effects.term import Holds, Shape, Term
from calibrate.sensors.kind import Trait


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    seats = next((drivers.readouts[name] for name in drivers.having(Trait.CONES)), None)
    if seats is None or seats.place is None:
        return ()
    out: list[Term] = []
    for seat in np.unique(seats.place[seats.seen]).tolist():
        in_seat = seats.seen & (seats.place == seat)

        there = in_use(in_seat)

        if inner := time_laws.step_inner(drivers, in_seat):
            out.append(
                motion(
                    "seat.position",
                    "seat-moved",
                    "t",
                    Shape.STEP,
                    time_laws.step,
                    f"Seat {seat}",
                    inner,
                    there,
                    3,
                    f"seat {seat}",
                )
            )
    return tuple(out)


EFFECT = Kind(
    "seat-moved",
    "A cone held by a magnet slides when the probe is pressed into it from the side.",
    ("base-moved", "encoder-slip"),
    "mismatch catalogue; ISO 10360-12:2016, 6.2 asks for a rigid fixing of the seat",
    _terms,
    holds=Holds.SESSION,
)
