"""How something changes over a session: at once, for a while, towards a new state, steadily, or with a temperature."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.term import Inner

Floats = NDArray[np.float64]
Law = Callable[[Drivers, Floats], Floats]

STEP_TIMES = 40  # coarse grid of a step over the session
TIME_CONSTANTS = (0.03, 0.1, 0.3, 1.0)  # of the session's length
FEWEST_AFTER = 4  # samples on either side of a step: fewer are bad shots, not a new state
WHILE_TIMES = 12  # coarse grid of begins and ends: all pairs of them are tried
FOR_A_WHILE = "for a while"  # the variant of a step that is taken back
LAGS = (0.1, 0.3, 1.0)  # of the session's length
BEHIND = "behind its thermometer"


def step(drivers: Drivers, inner: Floats) -> Floats:
    """(pose, 1) one after a time."""
    return (drivers.t_s >= inner[0]).astype(float)[:, None]


def for_a_while(among: NDArray[np.bool_] | None = None) -> Law:
    """(pose, 1) one from a time until another; nought where fewer samples `among` all lie between than make a state."""

    def law(drivers: Drivers, inner: Floats) -> Floats:
        between = (drivers.t_s >= inner[0]) & (drivers.t_s < inner[1])
        shown = between if among is None else between & among
        enough = np.count_nonzero(drivers.of_session(shown)) >= FEWEST_AFTER
        return (between & enough).astype(float)[:, None]

    return law


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


def behind_thermometer(where: str, drivers: Drivers, inner: Floats) -> Floats:
    """(pose, 1) K above the mean of the thermometer, of a body that follows it with a time constant (s).

    The difference d of body and thermometer, from nought on, decays while the thermometer leads: dd/dt = -d / lag -
    dT/dt, T straight between two samples. Source: first-order lag, Ogata, Modern Control Engineering, section 5-2.
    """
    T, own_s = drivers.temperatures_degC[where], drivers.of_session(drivers.t_s)
    own = drivers.of_session(T)
    order = np.argsort(own_s, kind="stable")
    spans = np.diff(own_s[order]) / inner[0]
    kept = np.exp(-spans)
    led = np.diff(own[order]) * np.where(spans > 0.0, -np.expm1(-spans) / np.where(spans > 0.0, spans, 1.0), 1.0)
    behind = [0.0]
    for keeps, leads in zip(kept.tolist(), led.tolist(), strict=True):
        behind.append(behind[-1] * keeps - leads)
    return (T + np.interp(drivers.t_s, own_s[order], behind) - own.mean())[:, None]


def step_inner(drivers: Drivers, among: NDArray[np.bool_] | None = None) -> tuple[Inner, ...]:
    """The time of a step, between samples; `among` are those that can show it. Empty where too few."""
    middles = _middles(drivers, among)
    return (_moment("time_s", middles, _spread(middles, STEP_TIMES)),) if len(middles) > 1 else ()


def while_inner(drivers: Drivers, among: NDArray[np.bool_] | None = None) -> tuple[Inner, ...]:
    """Begin and end of what is taken back, as `step_inner`; between two of the grid lie enough samples for a state."""
    middles = _middles(drivers, among)
    chosen = _spread(middles, min(WHILE_TIMES, 1 + (len(middles) - 1) // FEWEST_AFTER))
    if len(chosen) < 3:
        return ()
    return _moment("time_s", middles, chosen[:-1]), replace(_moment("until_s", middles, chosen[1:]), later=True)


def _middles(drivers: Drivers, among: NDArray[np.bool_] | None) -> Floats:
    """Moments between samples that have enough of them on either side."""
    times = np.unique(drivers.t_s if among is None else drivers.t_s[among])
    return (times[FEWEST_AFTER - 1 : -FEWEST_AFTER] + times[FEWEST_AFTER : len(times) - FEWEST_AFTER + 1]) / 2.0


def _spread(values: Floats, most: int) -> Floats:
    return values[np.linspace(0, len(values) - 1, max(min(most, len(values)), 0)).astype(int)]


def _moment(name: str, middles: Floats, grid: Floats) -> Inner:
    return Inner(name, tuple(grid.tolist()), float(middles[0]), float(middles[-1]), discrete=True)


def lag_inner(drivers: Drivers) -> tuple[Inner, ...]:
    """The time constant with which a body follows its thermometer."""
    length_s = max(float(np.ptp(drivers.t_s)), 1e-9)
    grid = tuple(length_s * share for share in LAGS)
    return (Inner("lag_s", grid, grid[0] / 2.0, grid[-1] * 2.0),)


def constant_inner(drivers: Drivers) -> tuple[Inner, ...]:
    """The time constant of an approach to a new state."""
    length_s = max(float(np.ptp(drivers.t_s)), 1e-9)
    grid = tuple(length_s * share for share in TIME_CONSTANTS)
    return (Inner("time_constant_s", grid, grid[0] / 2.0, grid[-1] * 2.0),)


def when(inner: tuple[Inner, ...]) -> str:
    """End of a sentence: the moment of a step, or two; the time constant of a drift."""
    said = {
        "time_s": " from {time_s} on",
        "until_s": ", until {until_s}",
        "time_constant_s": " with a time constant of {time_constant_s}",
        "lag_s": ", {lag_s} behind its thermometer",
    }
    return "".join(said.get(spec.name, "") for spec in inner)


def varies(values: Floats) -> bool:
    """Whether a driver varies at all."""
    return bool(np.ptp(values) > 1e-9 * max(1.0, float(np.abs(values).max())))
