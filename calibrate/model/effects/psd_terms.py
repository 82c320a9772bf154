"""What the readout terms of a position-sensitive detector share: its port, its spot as the model predicts it."""

from collections.abc import Callable

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Floats, Form, Shape, Term
from calibrate.model.sensors import spots

Columns = Callable[[Drivers, int, Floats], Floats]  # drivers, detector, its spot (pose, 2) -> (pose, 2, m)


def of_both(drivers: Drivers, make: Callable[[int], Term]) -> tuple[Term, ...]:
    """One term for each detector; none without a dual PSD."""
    return (make(1), make(2)) if drivers.light is not None else ()


def readout(
    detector: int,
    physics: str,
    shape: Shape,
    columns: Columns,
    names: tuple[str, ...],
    limit: float,
    sentence: str,
    depends_on: str = "",
    variant: str = "",
) -> Term:
    """An error of one detector's x and y."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        seen = columns(drivers, detector, spot(drivers, detector))
        out = np.zeros((len(seen), 4, seen.shape[2]))
        out[:, 2 * detector - 2 : 2 * detector] = seen
        return out

    return Form(
        Port(f"psd{detector}.reading", Place.READING, instrument=spots.KIND.name),
        (depends_on or f"spot{detector}",),
        shape,
        physics,
        variant=variant,
        function=function,
        names=names,
        limit=limit,
        sentence=sentence,
    )


def spot(drivers: Drivers, detector: int) -> Floats:
    """(pose, 2) m as predicted, zero where the detector was not in use."""
    return np.nan_to_num(drivers.readouts[spots.KIND.name].predicted[:, 2 * detector - 2 : 2 * detector])


def half_size_m(drivers: Drivers) -> float:
    """Of the faces; spots are at most that far out."""
    fixture = drivers.rig.fixture
    return 0.01 if fixture is None else fixture.half_size_m
