"""A cone slid, or the plate with all of them was knocked: from some moment on they are elsewhere, or for a while."""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.fixture_moved import ONE_BODY
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.moved import bumped
from calibrate.model.effects.term import Holds, Term
from calibrate.model.sensors.kind import Trait

SEAT = ("seat.position", "seat-moved")


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    seats = next((drivers.readouts[name] for name in drivers.having(Trait.CONES)), None)
    if seats is None or seats.place is None:
        return ()
    out: list[Term] = []
    numbers = np.unique(seats.place[seats.seen]).tolist()
    if len(numbers) > 1:
        plate = (*SEAT, "The plate with all cones", seats.seen)
        out += bumped(drivers, *plate, variant=ONE_BODY)
    for seat in numbers:
        in_seat = seats.seen & (seats.place == seat)
        out += bumped(drivers, *SEAT, f"Seat {seat}", in_seat, 3, f"seat {seat}")
    return tuple(out)


EFFECT = Kind(
    "seat-moved",
    "A cone held by a magnet slides when the probe is pressed into it from the side.",
    ("base-moved", "encoder-slip"),
    "mismatch catalogue; ISO 10360-12:2016, 6.2 asks for a rigid fixing of the seat",
    _terms,
    holds=Holds.SESSION,
)
