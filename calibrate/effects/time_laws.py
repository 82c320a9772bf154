"""How something changes over a session: at once, towards a new state, steadily, or with a temperature."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from calibrate.effects.drivers import Drivers
from calibrate.effects.term import Inner

Floats = NDArray[np.float64]
Law = Callable[[Drivers, Floats], Floats]

STEP_TIMES = 40  # coarse grid of a step over the session
TIME_CONSTANTS = (0.03, 0.1, 0.3, 1.0)  # of the session's length
FEWEST_AFTER = 4  # samples on either side of a step: fewer are bad shots, not a new state


def step(drivers: Drivers, inner: Floats) -> Floats:
    """(pose, 1) one after a time."""
    return (drivers.t_s >= inner[0]).astype(float)[:, None]


def towards(drivers: Drivers, inner: Floats) -> Floats:
    """(pose, 1) 1 - exp(-t / time constant), from the session's start."""
    return 1.0 - np.exp(-(drivers.t_s - drivers.of_session(drivers.t_s).min()) / inner[0])[:, None]


def steadily(drivers: Drivers, inner: Floats) -> Floats:
    """(pose, 1) share of the session that has gone by."""
    own = drivers.of_session(drivers.t_s)
    return ((drivers.t_s - own.min()) / max(float(np.ptp(own)), 1e-9))[:, None]


def with_temperature(where: str, drivers: Drivers, inner: Floats) -> Floats:
    """(pose, 1) K above the session's mean."""
    T = drivers.temperatures_degC[where]
    return (T - drivers.of_session(T).mean())[:, None]


def step_inner(drivers: Drivers, among: NDArray[np.bool_] | None = None) -> tuple[Inner, ...]:
    """The time of a step, between samples; `among` are those that can show it. Empty where too few."""
    times = np.unique(drivers.t_s if among is None else drivers.t_s[among])
    if len(times) < 2 * FEWEST_AFTER + 1:
        return ()
    middles = (times[FEWEST_AFTER - 1 : -FEWEST_AFTER] + times[FEWEST_AFTER : len(times) - FEWEST_AFTER + 1]) / 2.0
    chosen = middles[np.linspace(0, len(middles) - 1, min(STEP_TIMES, len(middles))).astype(int)]
    return (Inner("time_s", tuple(chosen.tolist()), float(middles[0]), float(middles[-1]), discrete=True),)


def constant_inner(drivers: Drivers) -> tuple[Inner, ...]:
    """The time constant of an approach to a new state."""
    length_s = max(float(np.ptp(drivers.t_s)), 1e-9)
    grid = tuple(length_s * share for share in TIME_CONSTANTS)
    return (Inner("time_constant_s", grid, grid[0] / 2.0, grid[-1] * 2.0),)


def when(inner: tuple[Inner, ...]) -> str:
    """End of a sentence: the moment of a step, the time constant of a drift."""
    said = {"time_s": " from {time_s} on", "time_constant_s": " with a time constant of {time_constant_s}"}
    return "".join(said.get(spec.name, "") for spec in inner)


def varies(values: Floats) -> bool:
    """Whether a driver varies at all."""
    return bool(np.ptp(values) > 1e-9 * max(1.0, float(np.abs(values).max())))
