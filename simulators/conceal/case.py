"""One concealed session, complete: what is true, what is hidden, what is recorded."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.effect_over_noise import measure_distances, scale_of
from simulators.conceal.hide import Hidden, choose, columns_of, hide, site_of, spares
from simulators.conceal.observe import Observed, observe
from simulators.conceal.plan import Timetable, draw_habits, draw_timetable
from simulators.conceal.rig import ENCODER_RAD, TrueRig
from simulators.conceal.rig_file import Belief, believe
from simulators.conceal.rigs import DrawnRig, draw_rig
from simulators.conceal.seated import shaken_rad
from simulators.conceal.second_encoders import at_the_flange, machine_like, over_noise, second_readings_rad
from simulators.conceal.wanted import Wanted, draw_noise
from simulators.defects import Defect

Floats = NDArray[np.float64]


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


SIGMA = {"dual-psd": 2e-6, "tracker": 15e-6, "wire": 25e-6, "cones": 10e-6}  # typical one sigma, m


@dataclass(frozen=True, eq=False)
class Case:
    """Truth and record of one session."""

    wanted: Wanted
    drawn: DrawnRig
    belief: Belief
    table: Timetable
    posture_rad: Floats  # (row, n) where the arm was sent or held
    hidden: Sequence[Hidden]
    exact: Observed  # with the defects, without noise
    reading_rad: Floats  # (row, n) as recorded
    values_m: Floats  # (row, channel) as recorded
    sigma_m: float
    recorded: frozenset[str]  # columns beside the required ones
    withheld: tuple[str, ...]
    second_rad: Floats | None  # (row, n) what second encoders say; None: there are none
    rng: np.random.Generator  # for what is still to be drawn when the table is written


def conceal(wanted: Wanted) -> Case:
    """Draws everything from the seed. ConcealError when the seed gives no session of the wanted kind."""
    rig_rng, plan_rng, noise_rng = (np.random.default_rng(s) for s in np.random.SeedSequence([wanted.seed, 1]).spawn(3))
    hide_rng = np.random.default_rng([wanted.seed, 2, zlib.crc32(" ".join(wanted.defects).encode())])
    drawn = draw_rig(wanted, rig_rng)
    kinds = choose(wanted, hide_rng) if wanted.encoders is None else ()
    habits = draw_habits(wanted, kinds, plan_rng)
    table = draw_timetable(wanted, drawn.true, habits, plan_rng)
    posture_rad = table.scene.goal_rad
    sigma_m = SIGMA[wanted.family] * float(plan_rng.uniform(0.7, 1.4))
    distances = measure_distances(drawn.true, plan_rng)

    def watch(defects: Sequence[Defect]) -> Observed:
        defects = defects if wanted.encoders is None else at_the_flange(defects, wanted.encoders)
        return observe(drawn.true, table.scene, defects, posture_rad, wire=wanted.family == "wire")

    hidden: list[Hidden] = []
    if wanted.encoders is not None and wanted.defects:
        scale = scale_of(drawn, table, watch, sigma_m, distances)
        for defect in machine_like(wanted.defects, site_of(wanted, drawn, table), hide_rng):
            between = over_noise(drawn.true, table.scene, [defect], wanted.encoders, posture_rad)
            hidden.append(Hidden(defect, max(scale.enr([defect]), between), max(scale.raw([defect]), between)))
    elif kinds:
        scale = scale_of(drawn, table, watch, sigma_m, distances)
        hidden = hide(wanted, kinds, spares(wanted, kinds, hide_rng), site_of(wanted, drawn, table), scale, hide_rng)
    exact = watch([one.defect for one in hidden])
    reading_rad, values_m = add_noise(wanted, drawn.true, exact, sigma_m, noise_rng)
    recorded, withheld = choose_columns(wanted, hidden, table, plan_rng)
    second_rad = None
    if wanted.encoders is not None:
        defects, rng = [one.defect for one in hidden], np.random.default_rng([wanted.seed, 31])
        second_rad = second_readings_rad(drawn.true, table.scene, defects, wanted.encoders, exact.reading_rad, rng)
    return Case(
        wanted,
        drawn,
        believe(wanted, drawn, distances, sigma_m, plan_rng),
        table,
        posture_rad,
        hidden,
        exact,
        reading_rad,
        values_m,
        sigma_m,
        recorded,
        withheld,
        second_rad,
        noise_rng,
    )
