"""One concealed session, complete: what is true, what is hidden, what is recorded."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.belief import Belief
from simulators.conceal.believe import believe
from simulators.conceal.distances import measure_distances
from simulators.conceal.hide import Hidden, choose, hide, spares
from simulators.conceal.observe import Observed, observe
from simulators.conceal.plan import draw_habits, draw_timetable
from simulators.conceal.recorded import add_noise, choose_columns
from simulators.conceal.rigs import DrawnRig, draw_rig
from simulators.conceal.scale import scale_of
from simulators.conceal.schedule import Timetable
from simulators.conceal.second_encoders import at_the_flange, machine_like, over_noise, second_readings_rad
from simulators.conceal.site import site_of
from simulators.conceal.wanted import Wanted
from simulators.defects.defect import Defect

Floats = NDArray[np.float64]
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
