"""A concealed session on the whole wire path: what is drawn before the emulators start, and the truth afterwards.

The arm, its stations and its deviations are those of an emulated world, in the terms of this package. Sizes are set on
a session drawn in its stead, for which poses a real one will take is not known before; the true effect is computed
afterwards.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from simulators.arm.drawing import Drawing, Row
from simulators.arm.kinematics import moved
from simulators.conceal.case import Case, HiddenMechanism, columns_of, hide, site_of
from simulators.conceal.effect_over_noise import INVISIBLE, measure_distances, scale_of
from simulators.conceal.observe import Observed, observe
from simulators.conceal.plan import Habits, Timetable, draw_timetable
from simulators.conceal.rig import DualPsd, Spread, TrueRig
from simulators.conceal.rig_file import StatedRig, rig_document, state_rig
from simulators.conceal.rigs import DrawnRig
from simulators.conceal.wanted import ConcealError, Wanted
from simulators.defects import MECHANISMS, Defect, Scene, Site
from simulators.errors import WorldError
from simulators.world.moving_mechanisms import temperatures
from simulators.world.rig import Emulation, WorldRig, read_rig
from simulators.world.truth import Truth, arm_of, draw_truth

Floats = NDArray[np.float64]


def rig_of_world(rig: WorldRig, truth: Truth, plain: Mapping[str, Any]) -> TrueRig:
    """Arm, laser and places as they truly are; `plain`: the rig file, which knows the limits of the joints.

    WorldError for a rig without a fixture: there is no light to work out.
    """
    if rig.fixture is None:
        raise WorldError("rig file: [fixture] is missing; readings of a light cannot be worked out without one")
    second, unit = rig.fixture.psd2_in_psd1, np.array(truth.laser_direction)
    joints = plain["arm"]["joint"]
    return TrueRig(
        arm=replace(
            arm_of(rig, truth),
            lower_rad=np.array([joint["lower_rad"] for joint in joints]),
            upper_rad=np.array([joint["upper_rad"] for joint in joints]),
        ),
        tool_point_m=np.zeros(3),
        instrument=DualPsd(
            laser_origin_m=np.array(truth.laser_origin_m),
            laser_direction=unit / np.linalg.norm(unit),
            half_size_m=rig.fixture.half_size_m,
            psd2_in_psd1=moved(second.origin_m, second.rotation_rad),
            places=np.stack([moved(p.psd1_in_base.origin_m, p.psd1_in_base.rotation_rad) for p in truth.placements]),
        ),
    )


def nominal_truth(rig: WorldRig) -> Truth:
    """What the rig file states, and nothing off."""
    return draw_truth(msgspec.structs.replace(rig, emulation=Emulation()), 0)


def drawing_of(plain: Mapping[str, Any], rng: np.random.Generator) -> Drawing:
    """The arm of a rig file; of one in seven the masses are unknown."""
    joints, flange = plain["arm"]["joint"], plain["arm"].get("flange", {})
    weighed = rng.random() >= 0.15
    return Drawing(
        name=plain["name"],
        model="dh",
        rows=tuple(Row(j["a_m"], j["alpha_rad"], j["d_m"], j.get("theta_offset_rad", 0.0)) for j in joints),
        fixed=(),
        flange=(tuple(flange.get("origin_m", (0.0,) * 3)), tuple(flange.get("rotation_rad", (0.0,) * 3))),
        lower_rad=tuple(j["lower_rad"] for j in joints),
        upper_rad=tuple(j["upper_rad"] for j in joints),
        mass_kg=tuple(j["mass_kg"] for j in joints) if weighed else (),
        com_m=tuple((j["com_m"][0], j["com_m"][1], j["com_m"][2]) for j in joints) if weighed else (),
        gear_ratio=tuple(j["gear_ratio"] for j in joints),
        reach_m=sum(float(np.hypot(j["a_m"], j["d_m"])) for j in joints),
    )


def spread_of(rig: WorldRig) -> Spread:
    """What [emulation] draws; PSD 2 stands in PSD 1 at its nominal pose, and masses are what they are."""
    of = rig.emulation
    return Spread(
        length_m=of.length_sigma_m,
        angle_rad=of.angle_sigma_rad,
        zero_rad=of.joint_zero_max_rad / np.sqrt(3.0),
        tool_m=of.laser_origin_sigma_m,
        laser_rad=of.laser_direction_sigma_rad,
        place_m=of.placement_origin_sigma_m,
        place_rad=of.placement_rotation_sigma_rad,
        psd2_m=1e-6,
        psd2_rad=1e-6,
        device_m=0.0,
        device_rad=0.0,
        mass=0.0,
    )


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
    stated: StatedRig
    sigma_m: float
    hidden: Sequence[HiddenMechanism]


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
    """For the first places of the rig file `plain`, whose [emulation] states how far truth lies off.

    ConcealError: another seed.
    """
    plain = {**plain, "placement": plain["placement"][: wanted.places]}
    rig_rng, plan_rng, hide_rng = (np.random.default_rng([wanted.seed, stream]) for stream in (11, 12, 13))
    rig = read_rig(plain)
    true = rig_of_world(rig, draw_truth(rig, wanted.seed), plain)
    nominal = rig_of_world(rig, nominal_truth(rig), plain)
    drawn = DrawnRig(drawing_of(plain, rig_rng), nominal, true, spread_of(rig))
    table = draw_timetable(wanted, true, Habits(change_s=0.0), plan_rng)
    sigma_m = _sigma_m(rig, true, table, plan_rng)
    distances = measure_distances(true, plan_rng)
    hidden: list[HiddenMechanism] = []
    if wanted.defects:
        scale = scale_of(drawn, table, _watch(true, table), sigma_m, distances)
        site = _on_site(site_of(wanted, drawn, table), wanted)
        hidden = [_one(wanted, site, lambda kind, rng: hide(wanted, [kind], (), site, scale, rng), hide_rng)]
    stated = state_rig(wanted, drawn, distances, sigma_m, plan_rng)
    site_rig = {**rig_document(stated), **{section: plain[section] for section in ("devices", "motion")}}
    return Wired(wanted, plain, site_rig, drawn, stated, sigma_m, hidden)


def taken_case(wired: Wired, taken: Taken) -> Case:
    """Truth and record of the session that was taken."""
    drawn, table = wired.drawn, _timetable(taken)
    world = replace(table, scene=replace(table.scene, t_s=taken.t_s + taken.power_on_s))
    watch = _watch(drawn.true, world)
    defects = [one.defect for one in wired.hidden]
    hidden = list(wired.hidden)
    if defects:
        scale = scale_of(drawn, world, watch, wired.sigma_m, wired.stated.distances)
        hidden = [HiddenMechanism(_in_session(d, taken.power_on_s), scale.enr([d]), scale.raw([d])) for d in defects]
    return Case(
        wired.wanted,
        drawn,
        wired.stated,
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
    hidden_of: Callable[[type[Defect], np.random.Generator], list[HiddenMechanism]],
    rng: np.random.Generator,
) -> HiddenMechanism:
    """The mechanism asked for, or any that such a session can show and its columns can name."""
    possible = [kind for kind in MECHANISMS if site.instrument in kind.INSTRUMENTS and not kind.HABIT]
    outside = wanted.defects == ("outside",)
    named = [kind for kind in possible if kind.KIND in wanted.defects]
    among = named or [kind for kind in possible if kind.KIND.startswith("outside-") == outside and not kind.ASKED]
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
    """One sigma of a reading: gears that seat again, and what is left of the detector's noise."""
    seated_rad = rig.emulation.joint_repeatability_rad * rng.standard_normal(table.scene.goal_rad.shape)
    off = observe(true, table.scene, (), table.scene.goal_rad + seated_rad).values_m - _watch(true, table)(()).values_m
    return float(np.sqrt(np.mean(off**2) + rig.emulation.psd_noise_m**2 / AVERAGED))


def _on_site(site: Site, wanted: Wanted) -> Site:
    """Times of a session that takes place after place, as quickly as an arm goes."""
    stay_s = A_SAMPLE_S * wanted.samples / len(site.places)
    stays = tuple((place, k * stay_s, (k + 1) * stay_s) for k, place in enumerate(site.places))
    return replace(site, duration_s=stay_s * len(site.places), stays_s=stays)


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
