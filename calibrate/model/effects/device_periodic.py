"""Something round in the device that is not: a wire's drum, a tracker's angle encoders."""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Floats, Form, Functions, Inner, Shape, Term
from calibrate.model.sensors.kind import Trait

SHORTEST_M, LONGEST_M = 0.05, 1.0  # circumference of drums in use
LIMIT_M = 5e-3
LIMIT_RAD = 5e-4  # 20 µm on a radius of 40 mm
_CIRCLES = (("azimuth", 1), ("azimuth", 2), ("elevation", 1), ("elevation", 2))


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    circles = [_circle(name, k) for name in drivers.having(Trait.ANGLE_ENCODERS) for k in _CIRCLES]
    return (*(term for name in drivers.having(Trait.DRUM) for term in _drum(drivers, name)), *circles)


def _drum(drivers: Drivers, name: str) -> tuple[Term, ...]:
    """An error that repeats with the length read."""
    reading = drivers.readouts[name]
    span_m = float(np.ptp(reading.predicted[reading.seen]))
    if span_m < SHORTEST_M:
        return ()
    longest_m = min(LONGEST_M, 1.5 * span_m)
    turns = np.arange(span_m / longest_m, span_m / SHORTEST_M, 0.25)
    grid = tuple(sorted((span_m / turns).tolist()))
    return (
        Form(
            Port("device.reading", Place.READING, instrument=name),
            ("reading",),
            Shape.HARMONIC,
            "device-periodic",
            None,
            (Inner("period_m", grid, grid[0] * 0.9, grid[-1] * 1.1),),
            function=_once_a_drum_turn(name),
            names=("amplitude_m", "phase_rad"),
            limit=LIMIT_M,
            sentence="The wire reads off by up to {amplitude_m} and repeats every {period_m}: its drum is out of round",
            polar=True,
        ),
    )


def _once_a_drum_turn(name: str) -> Functions:
    def function(drivers: Drivers, inner: Floats) -> Floats:
        angle = 2.0 * np.pi * np.nan_to_num(drivers.readouts[name].predicted[:, 0]) / inner[0]
        return np.stack([np.sin(angle), np.cos(angle)], axis=1)[:, None, :]

    return function


def _circle(name: str, circle: tuple[str, int]) -> Term:
    """A harmonic of one angle encoder of a tracker; the target seems to swing about the axis of that angle."""
    which, order = circle

    def function(drivers: Drivers, inner: Floats) -> Floats:
        seen = np.nan_to_num(drivers.readouts[name].predicted)
        x, y, z = seen[:, :3].T
        out = np.zeros((*seen.shape, 2))
        if which == "azimuth":
            angle, swing = np.arctan2(y, x), np.stack([-y, x, np.zeros_like(x)], axis=1)
        else:
            level = np.hypot(x, y)
            angle, unit = np.arctan2(z, level), np.stack([x, y], axis=1) / np.maximum(level, 1e-9)[:, None]
            swing = np.concatenate([-z[:, None] * unit, level[:, None]], axis=1)
        out[:, :3, 0], out[:, :3, 1] = (
            wave[:, None] * swing for wave in (np.sin(order * angle), np.cos(order * angle))
        )
        return out

    return Form(
        Port("device.reading", Place.READING, instrument=name),
        ("reading",),
        Shape.HARMONIC,
        "device-periodic",
        order,
        variant=which,
        function=function,
        names=("amplitude_rad", "phase_rad"),
        limit=LIMIT_RAD,
        sentence=f"The tracker's {which} is off by up to {{amplitude_rad}}, {order} times a turn: its encoder",
        polar=True,
    )


EFFECT = Kind(
    "device-periodic",
    "A measuring drum that is eccentric pays out more wire on one side than on the other.",
    ("device-scale",),
    "wheel: length = R phi + e sin phi; tracker: Muralikrishnan et al., NIST J. Res. 114, 2009, encoder terms h1, h2",
    _terms,
)
