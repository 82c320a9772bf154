"""Everything in a session that an unknown effect might depend on, by the words of docs/formats.md."""

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.drivers import Drivers

Floats = NDArray[np.float64]

LEAST_LEVELS = 4  # different values that a curve needs
SLOW = ("t", "temp_")


def causes_of(drivers: Drivers) -> dict[str, Floats]:
    """(pose,) by driver; those that vary, and in more than a few levels."""
    found = {name: cause(drivers, name) for name in _names(drivers)}
    return {name: values for name, values in found.items() if _varies(values)}


def cause(drivers: Drivers, name: str) -> Floats:
    """(pose,) of one driver that the session holds."""
    stem, number = name.rstrip("0123456789"), name[len(name.rstrip("0123456789")) :]
    by_joint = {
        "q": drivers.q_rad,
        "last_move": drivers.last_move_rad,
        "qd": drivers.qd_rad_s,
        "cmd_minus_q": drivers.cmd_minus_q_rad,
    }
    table = by_joint.get(stem)
    if number and table is not None:
        return table[:, int(number) - 1]
    temperature = drivers.temperatures_degC.get(name.removeprefix("temp_")) if name.startswith("temp_") else None
    if temperature is not None:
        return temperature
    single = {"t": drivers.t_s, "payload": drivers.payload_kg}
    if drivers.psd_sum_v is not None:
        single |= {"psd1_sum": drivers.psd_sum_v[:, 0], "psd2_sum": drivers.psd_sum_v[:, 1]}
    found = single.get(name)
    return drivers.extra[name] if found is None else found


def acts_at(name: str, where: str) -> bool:
    """Whether a driver could act at a port: how a joint moved matters at that joint."""
    stem = name.rstrip("0123456789")
    if stem not in ("last_move", "qd", "cmd_minus_q"):
        return True
    return where == f"joint{name[len(stem) :]}.angle"


def _names(drivers: Drivers) -> list[str]:
    joints = range(1, drivers.n_joints + 1)
    names = ["t", *(f"q{i}" for i in joints), *(f"last_move{i}" for i in joints)]
    if drivers.qd_rad_s is not None:
        names += [f"qd{i}" for i in joints]
    if drivers.cmd_minus_q_rad is not None:
        names += [f"cmd_minus_q{i}" for i in joints]
    names += [f"temp_{where}" for where in drivers.temperatures_degC]
    if drivers.payload_kg is not None:
        names.append("payload")
    if drivers.psd_sum_v is not None:
        names += ["psd1_sum", "psd2_sum"]
    return [*names, *drivers.extra]


def is_slow_cause(name: str) -> bool:
    """A function of time, or what follows it."""
    return name == SLOW[0] or name.startswith(SLOW[1])


def centred(values: Floats) -> Floats:
    """Onto -1 ... 1."""
    low, high = float(np.min(values)), float(np.max(values))
    return (values - (low + high) / 2.0) / max((high - low) / 2.0, 1e-300)


def _varies(values: Floats) -> bool:
    return bool(np.all(np.isfinite(values))) and len(np.unique(values)) >= LEAST_LEVELS
