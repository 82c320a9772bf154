"""What is written down: exact readings with noise, and the columns beside them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.hide import Hidden, columns_of
from simulators.conceal.noise import draw_noise
from simulators.conceal.observe import Observed
from simulators.conceal.rig import TrueRig
from simulators.conceal.schedule import Timetable
from simulators.conceal.seated import shaken_rad
from simulators.conceal.wanted import Wanted

Floats = NDArray[np.float64]
ENCODER_RAD = 4e-6  # one sigma of a measuring arm's encoders


def add_noise(
    wanted: Wanted, true: TrueRig, exact: Observed, sigma_m: float, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Joint readings (row, n) and values (row, channel) as written down."""
    rows, channels = exact.values_m.shape
    if wanted.family == "cones":
        encoder_rad = ENCODER_RAD * draw_noise(wanted.noise, rows, exact.reading_rad.shape[1], rng)
        contact_m = sigma_m * draw_noise(wanted.noise, rows, 3, rng)
        return exact.reading_rad + encoder_rad + shaken_rad(true, exact.reading_rad, contact_m), exact.values_m
    return exact.reading_rad, exact.values_m + sigma_m * draw_noise(wanted.noise, rows, channels, rng)


def choose_columns(
    wanted: Wanted, hidden: Sequence[Hidden], table: Timetable, rng: np.random.Generator
) -> tuple[frozenset[str], tuple[str, ...]]:
    """Which columns are written, and which are kept back though a name hangs on them."""
    needed = {name for one in hidden for name in columns_of(one.defect)}
    usual = _usual(wanted, table, rng)
    if any(name.startswith("temp_link") for name in needed):  # one thermometer alone would point at the cause
        usual |= {f"temp_link{link}_degC" for link in range(1, table.scene.goal_rad.shape[1] + 1)}
    if not wanted.withhold:
        return frozenset(usual | needed), ()
    warm = any(name.startswith("temp_") for name in needed)  # another thermometer would stand in for the missing one
    left = usual - needed - {name for name in usual if warm and name.startswith("temp_")}
    return frozenset(left), tuple(sorted(needed))


def _usual(wanted: Wanted, table: Timetable, rng: np.random.Generator) -> set[str]:
    """Columns that sites record whether or not they matter."""
    joints = range(1, table.scene.goal_rad.shape[1] + 1)
    chances = [
        (0.8, {"temp_room_degC"}),
        (0.3, {f"temp_joint{joint}_degC" for joint in joints}),
        (0.2, {f"temp_link{joint}_degC" for joint in joints}),
        (0.8 if wanted.family != "cones" else 0.0, {"approach"}),
        (0.3 if wanted.family != "cones" else 0.0, {"fan_rpm"}),
        (0.4 if wanted.family == "dual-psd" else 0.0, {"temp_laser_degC"}),
    ]
    usual: set[str] = set()
    for chance, names in chances:
        usual |= names if rng.random() < chance else set()
    usual |= {"payload_kg"} if np.ptp(table.scene.payload_kg) > 0.0 else set()
    return usual | ({"qd"} if table.scene.qd_rad_s.any() else set())
