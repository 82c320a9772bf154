"""A concealed session on the whole wire path: what is drawn before the emulators start, and the truth afterwards.

The arm, its places and its deviations are those of an emulated world. Sizes are set on a session drawn in its stead,
for which poses a real one will take is not known before; what the effect truly was is worked out afterwards.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.case import Case
from simulators.conceal.effect_over_noise import INVISIBLE, measure_distances, scale_of
from simulators.conceal.from_world import drawing_of, nominal_truth, rig_of_world, spread_of
from simulators.conceal.hide import Hidden, columns_of, hide, site_of
from simulators.conceal.observe import Observed, observe
from simulators.conceal.plan import Habits, Timetable, draw_timetable
from simulators.conceal.rig import TrueRig
from simulators.conceal.rig_file import Belief, believe, rig_document
from simulators.conceal.rigs import DrawnRig
from simulators.conceal.wanted import ConcealError, Wanted
from simulators.defects import MECHANISMS, Defect, Scene, Site
from simulators.world.exposure import temperatures
from simulators.world.rig import WorldRig, read_rig
from simulators.world.truth import draw_truth

Floats = NDArray[np.float64]
RECORDED = frozenset({"approach", "qd", "psd1_sum_v", "psd2_sum_v"})  # of what a name may need
A_SAMPLE_S = 5.0  # of emulated time: go there, settle, read, now and then search the light
APPROACH_RAD = 0.035  # the last move to a sample was longer than any play
AVERAGED = 200  # readings of a detector in a sample


@dataclass(frozen=True, eq=False)
class Wired:
    """What the emulators and the site are given, and what is true."""

    wanted: Wanted
    emulated: Mapping[str, Any]  # rig file of the world
    site_rig: Mapping[str, Any]  # rig file of the session
    drawn: DrawnRig
    belief: Belief
    sigma_m: float
    hidden: Sequence[Hidden]


@dataclass(frozen=True, eq=False)
class Taken:
    """The samples of the session, one row each."""

    t_s: Floats
    power_on_s: float  # by which the world was older than the session
    reading_rad: Floats  # (row, n)
    approach: Floats  # (row, n)
    placement: NDArray[np.int64]
    first_psd: NDArray[np.int64]
    repeat: NDArray[np.int64]
    spots_m: Floats  # (row, 4)


def draw_wired(wanted: Wanted, plain: Mapping[str, Any]) -> Wired:
    """For the first places of the rig file `plain`, whose [emulation] says how far truth lies off.

    ConcealError: another seed.
    """
    plain = {**plain, "placement": plain["placement"][: wanted.places]}
    rig_rng, plan_rng, hide_rng = (np.random.default_rng([wanted.seed, stream]) for stream in (11, 12, 13))
    rig = read_rig(plain)
    true = rig_of_world(rig, draw_truth(rig, wanted.seed), plain)
    believed = rig_of_world(rig, nominal_truth(rig), plain)
    drawn = DrawnRig(drawing_of(plain, rig_rng), believed, true, spread_of(rig))
    table = draw_timetable(wanted, true, Habits(change_s=0.0), plan_rng)
    sigma_m = _sigma_m(rig, true, table, plan_rng)
    distances = measure_distances(true, plan_rng)
    hidden: list[Hidden] = []
    if wanted.defects:
        scale = scale_of(drawn, table, _watch(true, table), sigma_m, distances)
        site = _on_site(site_of(wanted, drawn, table), wanted)
        hidden = [_one(wanted, site, lambda kind, rng: hide(wanted, [kind], (), site, scale, rng), hide_rng)]
    belief = believe(wanted, drawn, distances, sigma_m, plan_rng)
    site_rig = {**rig_document(belief), **{section: plain[section] for section in ("devices", "motion")}}
    return Wired(wanted, plain, site_rig, drawn, belief, sigma_m, hidden)


def taken_case(wired: Wired, taken: Taken) -> Case:
    """Truth and record of the session that was taken."""
    drawn, table = wired.drawn, _timetable(taken)
    world = replace(table, scene=replace(table.scene, t_s=taken.t_s + taken.power_on_s))
    watch = _watch(drawn.true, world)
    defects = [one.defect for one in wired.hidden]
    hidden = list(wired.hidden)
    if defects:
        scale = scale_of(drawn, world, watch, wired.sigma_m, wired.belief.distances)
        hidden = [Hidden(_in_session(d, taken.power_on_s), scale.enr([d]), scale.raw([d])) for d in defects]
    return Case(
        wired.wanted,
        drawn,
        wired.belief,
        table,
        taken.reading_rad,
        hidden,
        watch(defects),
        taken.reading_rad,
        taken.spots_m,
        wired.sigma_m,
        RECORDED,
        (),
        None,
        np.random.default_rng(wired.wanted.seed),
    )


def _one(
    wanted: Wanted,
    site: Site,
    hidden_of: Callable[[type[Defect], np.random.Generator], list[Hidden]],
    rng: np.random.Generator,
) -> Hidden:
    """The mechanism asked for, or any that such a session can show and its columns can name."""
    possible = [kind for kind in MECHANISMS if site.instrument in kind.INSTRUMENTS and not kind.HABIT]
    outside = wanted.defects == ("outside",)
    named = [kind for kind in possible if kind.KIND in wanted.defects]
    among = named or [kind for kind in possible if kind.KIND.startswith("outside-") == outside]
    for index in rng.permutation(len(among)):
        try:
            found = hidden_of(among[int(index)], rng)
        except ConcealError:
            continue
        if found and found[0].enr > INVISIBLE and columns_of(found[0].defect) <= RECORDED:
            return found[0]
    raise ConcealError("no mechanism shows in a session of this seed; take another one")


def _watch(true: TrueRig, table: Timetable) -> Callable[[Sequence[Defect]], Observed]:
    return lambda defects: observe(true, table.scene, defects, table.scene.goal_rad)


def _sigma_m(rig: WorldRig, true: TrueRig, table: Timetable, rng: np.random.Generator) -> float:
    """One sigma of a reading: gears that seat anew, and what is left of the detector's noise."""
    seated_rad = rig.emulation.joint_repeatability_rad * rng.standard_normal(table.scene.goal_rad.shape)
    off = observe(true, table.scene, (), table.scene.goal_rad + seated_rad).values_m - _watch(true, table)(()).values_m
    return float(np.sqrt(np.mean(off**2) + rig.emulation.psd_noise_m**2 / AVERAGED))


def _on_site(site: Site, wanted: Wanted) -> Site:
    """Times of a session that takes place after place, as quickly as an arm goes."""
    stay_s = A_SAMPLE_S * wanted.samples / len(site.places)
    stays = tuple((place, k * stay_s, (k + 1) * stay_s) for k, place in enumerate(site.places))
    return replace(site, duration_s=stay_s * len(site.places), stays_s=stays, extras=())


def _timetable(taken: Taken) -> Timetable:
    """Conditions of the samples on the time of the session: standing, unloaded, the arm warming since power-on."""
    rows, n = taken.reading_rad.shape
    none = np.zeros(rows)
    scene = Scene(
        t_s=taken.t_s,
        via_rad=taken.reading_rad - APPROACH_RAD * taken.approach,
        goal_rad=taken.reading_rad,
        qd_rad_s=np.zeros((rows, n)),
        wait_s=none,
        payload_kg=none,
        payload_com_m=np.zeros(3),
        placement=taken.placement,
        first_psd=taken.first_psd,
        seat=np.zeros(rows, dtype=np.int64),
        temperature_degC=temperatures(taken.t_s + taken.power_on_s, n),
        laser_power=np.ones(rows),
        extra={},
    )
    return Timetable(np.arange(rows), taken.repeat, scene)


def _in_session(defect: Defect, power_on_s: float) -> Defect:
    """The same with its times counted as the session counts them."""
    changed: Any = defect
    times = {f.name for f in fields(changed)} & {"at_s", "until_s"}
    return replace(changed, **{name: getattr(changed, name) - power_on_s for name in times})
