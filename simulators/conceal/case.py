"""One concealed session, complete: what is true, what is hidden, what is recorded.

Mechanisms are chosen from what the session's rig has room for, and each is scaled to the wanted effect over noise.
"""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simulators.arm.kinematics import forward
from simulators.arm.statics import weigh
from simulators.conceal.effect_over_noise import INVISIBLE, Scale, measure_distances, scale_of
from simulators.conceal.observe import (
    Observed,
    at_the_flange,
    machine_like,
    observe,
    over_noise,
    second_readings_rad,
    shaken_rad,
)
from simulators.conceal.plan import Timetable, draw_habits, draw_timetable
from simulators.conceal.readings import flange_turn, stand
from simulators.conceal.rig import ENCODER_RAD, Artefacts, Device, DualPsd, TrueRig
from simulators.conceal.rig_file import StatedRig, state_rig
from simulators.conceal.rigs import DrawnRig, draw_rig
from simulators.conceal.wanted import INSTRUMENT, ConcealError, Wanted, draw_noise
from simulators.defects import MECHANISMS, RAISED, Defect, Scene, Site, UnsuitedError

CARRIES = 0.02  # of the largest torque's spread: a joint below it feels no weight


def site_of(wanted: Wanted, drawn: DrawnRig, table: Timetable) -> Site:
    """Its joints, loads, ranges and times."""
    true, scene = drawn.true, table.scene
    arm = true.arm
    frames = forward(arm, scene.goal_rad + arm.zero_rad)
    foot = np.broadcast_to(np.eye(4), (len(scene), 4, 4))
    turning_nm = weigh(arm, frames, foot, scene.payload_kg, scene.payload_com_m).torque_nm
    torque_nm = np.std(turning_nm, axis=0)
    places = (1,) if not isinstance(true.instrument, DualPsd) else tuple(range(1, len(true.instrument.places) + 1))
    seats = tuple(range(1, true.instrument.cones + 1)) if isinstance(true.instrument, Artefacts) else ()
    felt = np.flatnonzero(torque_nm > CARRIES * torque_nm.max()) if torque_nm.any() else []
    loaded = tuple(int(index) + 1 for index in felt)
    return Site(
        n_joints=arm.n_joints,
        instrument=INSTRUMENT[wanted.family],
        loaded=loaded,
        torque_nm=tuple(torque_nm.tolist()),
        gear_ratio=drawn.drawing.gear_ratio,
        link_length_m=tuple(np.linalg.norm(arm.fixed[:, :3, 3], axis=1).tolist()),
        sweep_rad=tuple(np.ptp(scene.goal_rad, axis=0).tolist()),
        usual_rad=tuple((float(low), float(high)) for low, high in np.quantile(scene.goal_rad, (0.1, 0.9), axis=0).T),
        places=places,
        stays_s=table.stays_s,
        seats=seats,
        half_size_m=true.instrument.half_size_m if isinstance(true.instrument, DualPsd) else 0.0,
        duration_s=float(scene.t_s[-1]),
        pushed=tuple(np.mean(turning_nm > 0.0, axis=0).tolist()),
    )


TRIES = 12
CLOSE = 0.95  # of the wanted effect: less is drawn again, for another joint may show it better
OUTSIDE = "unknown"


@dataclass(frozen=True)
class HiddenMechanism:
    """One mechanism as it is in this session."""

    defect: Defect
    enr: float  # of this one alone, after geometry
    raw: float  # the same before geometry


def choose(wanted: Wanted, rng: np.random.Generator) -> tuple[type[Defect], ...]:
    """The mechanisms asked for. ConcealError for an unknown name or one that the family cannot show."""
    possible = [kind for kind in MECHANISMS if INSTRUMENT[wanted.family] in kind.INSTRUMENTS]
    chosen: list[type[Defect]] = []
    for name in wanted.defects:
        if name in ("any", "outside"):
            among = [k for k in possible if (k.PHYSICS == OUTSIDE) == (name == "outside") and not k.ASKED]
            fresh = [k for k in among if k not in chosen and _agree(k, chosen)] or among
            chosen.append(fresh[int(rng.integers(len(fresh)))])
        else:
            chosen.append(_named(name, possible, INSTRUMENT[wanted.family]))
    return tuple(chosen)


def _agree(kind: type[Defect], chosen: Sequence[type[Defect]]) -> bool:
    """Mechanisms that want different habits of the session are not drawn together."""
    habits = {other.HABIT for other in (*chosen, kind)} - {""}
    return len(habits) <= 1


def _named(name: str, possible: Sequence[type[Defect]], instrument: str) -> type[Defect]:
    for kind in (*possible, *(kind for kind in RAISED if instrument in kind.INSTRUMENTS)):
        if name == kind.KIND:
            return kind
    names = ", ".join(kind.KIND for kind in possible)
    raise ConcealError(f"defect '{name}' cannot be hidden in this family; there are {names}, any, outside")


def spares(wanted: Wanted, kinds: Sequence[type[Defect]], rng: np.random.Generator) -> tuple[type[Defect], ...]:
    """What may stand in for a drawn mechanism that does not fit: none where each was asked for by name."""
    if any(name not in ("any", "outside") for name in wanted.defects):
        return ()
    shown = [kind for kind in MECHANISMS if INSTRUMENT[wanted.family] in kind.INSTRUMENTS]
    possible = [kind for kind in shown if kind not in kinds and not kind.ASKED]
    outside = {kind.PHYSICS == OUTSIDE for kind in kinds}
    fitting = [k for k in possible if (k.PHYSICS == OUTSIDE) in outside and (_agree(k, kinds) or not k.HABIT)]
    return tuple(fitting[int(index)] for index in rng.permutation(len(fitting)))


def hide(
    wanted: Wanted,
    kinds: Sequence[type[Defect]],
    spare: Sequence[type[Defect]],
    site: Site,
    scale: Scale,
    rng: np.random.Generator,
) -> list[HiddenMechanism]:
    """As many defects as `kinds`, each with a port or a driver of its own.

    A kind that this rig cannot have, or that could not be seen, gives way to a spare one; without a spare it stays as
    it is, or ConcealError when it cannot be drawn at all.
    """
    hidden: list[HiddenMechanism] = []
    waiting = [*kinds, *spare]
    for number, kind in enumerate(waiting):
        if len(hidden) == len(kinds):
            break
        more = number + 1 < len(waiting) and bool(spare)
        try:
            found = _strongest(wanted, kind, hidden, site, scale, rng)
        except UnsuitedError as reason:
            if not more:
                raise ConcealError(f"{kind.KIND}: {reason}; take another arm, family or seed") from reason
            continue
        if found is not None and (found.enr > INVISIBLE or not more):
            hidden.append(found)
    if any(one.enr < wanted.at_least for one in hidden):
        raise ConcealError(f"no plausible size is {wanted.at_least:g} times the noise; take another seed")
    return hidden


def _strongest(
    wanted: Wanted,
    kind: type[Defect],
    hidden: Sequence[HiddenMechanism],
    site: Site,
    scale: Scale,
    rng: np.random.Generator,
) -> HiddenMechanism | None:
    """One of this kind that comes close to the wanted effect, or the best of some tries; None: all ports are taken."""
    best: HiddenMechanism | None = None
    for _ in range(TRIES):
        drawn = kind.draw(rng, site)
        if wanted.withhold and not columns_of(drawn):
            raise UnsuitedError("no column names it, so none can be withheld")
        if any(_same(one.defect, drawn) for one in hidden):
            continue
        defect, found = scale.brought_to(drawn, wanted.enr)
        if best is None or found > best.enr:
            best = HiddenMechanism(defect, found, scale.raw([defect]))
        if found >= CLOSE * wanted.enr:
            break
    return best


def columns_of(defect: Defect) -> frozenset[str]:
    """Columns of samples.csv without which nobody could name it."""
    return frozenset(defect.needs) - {"gear_ratio"}


def _same(one: Defect, other: Defect) -> bool:
    return one.port == other.port and one.drivers == other.drivers


Floats = NDArray[np.float64]
Whole = NDArray[np.int64]


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
    wanted: Wanted, hidden: Sequence[HiddenMechanism], table: Timetable, rng: np.random.Generator
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
    usual |= {"temp_room_degC"} if wanted.thermometer_k else set()
    usual |= {"payload_kg"} if np.ptp(table.scene.payload_kg) > 0.0 else set()
    return usual | ({"qd"} if table.scene.qd_rad_s.any() else set())


SIGMA = {"dual-psd": 2e-6, "tracker": 15e-6, "wire": 25e-6, "cones": 10e-6}  # typical one sigma, m


@dataclass(frozen=True, eq=False)
class Case:
    """Truth and record of one session."""

    wanted: Wanted
    drawn: DrawnRig
    stated: StatedRig
    table: Timetable
    posture_rad: Floats  # (row, n) where the arm was sent or held
    hidden: Sequence[HiddenMechanism]
    exact: Observed  # with the defects, without noise
    reading_rad: Floats  # (row, n) as recorded
    values_m: Floats  # (row, channel) as recorded
    sigma_m: float
    recorded: frozenset[str]  # columns beside the required ones
    withheld: tuple[str, ...]
    second_rad: Floats | None  # (row, n) what second encoders read; None: there are none
    rng: np.random.Generator  # for what is still to be drawn when the table is written
    target: Whole | None = None  # (row,) of several
    turn_rad: Floats | None = None  # (row, 3) rotation vectors as recorded; None: no 6-D target
    off: Mapping[str, float] = field(default_factory=dict)  # constants beside those of the simulation, by model.json


TARGET_M = 0.08  # one sigma of where further targets sit about the first
MOUNT_RAD = 0.02  # one sigma of how a 6-D target is screwed on
TURN_RAD = 5e-5  # typical one sigma of a 6-D target's orientation


def _with_targets(wanted: Wanted, drawn: DrawnRig, table: Timetable) -> tuple[DrawnRig, Floats | None, Whole | None]:
    """The rig with the point of each row, the points (target, 3) as assumed, and the number of each row's target."""
    if wanted.targets == 1:
        return drawn, None, None
    rng = np.random.default_rng([wanted.seed, 41])
    off_m = np.vstack((np.zeros(3), TARGET_M * rng.standard_normal((wanted.targets - 1, 3))))
    true_m = drawn.true.tool_point_m + off_m
    true_m[1:] += drawn.spread.tool_m * rng.standard_normal((wanted.targets - 1, 3))
    number = table.pose % wanted.targets  # repeats are of one target
    true = replace(drawn.true, tool_point_m=true_m[number])
    return replace(drawn, true=true), drawn.nominal.tool_point_m + off_m, number + 1


def _turns_rad(
    wanted: Wanted, true: TrueRig, table: Timetable, hidden: Sequence[HiddenMechanism], goal_rad: Floats
) -> Floats | None:
    """(row, 3) what a 6-D target reads of its orientation: rotation vectors in the axes of the device, with noise."""
    if not wanted.six_d or not isinstance(true.instrument, Device):
        return None
    rng, defects = np.random.default_rng([wanted.seed, 43]), [one.defect for one in hidden]
    stance = stand(true, table.scene, defects, goal_rad)
    seen = Rotation.from_matrix(flange_turn(true.instrument, table.scene, defects, stance))
    mount = Rotation.from_rotvec(MOUNT_RAD * rng.standard_normal(3))
    noise = Rotation.from_rotvec(TURN_RAD * rng.uniform(0.7, 1.4) * rng.standard_normal((len(table.scene), 3)))
    return (noise * seen * mount).as_rotvec()


def _with_drifting_thermometer(scene: Scene, drift_k: float) -> Scene:
    """The thermometer of the room alone: joints and links are as warm as before."""
    room = scene.temperature_degC["room"] + drift_k * scene.t_s / scene.t_s[-1]
    return replace(scene, temperature_degC={**scene.temperature_degC, "room": room})


def conceal(wanted: Wanted) -> Case:
    """Draws everything from the seed. ConcealError when the seed gives no session of the wanted kind."""
    rig_rng, plan_rng, noise_rng = (np.random.default_rng(s) for s in np.random.SeedSequence([wanted.seed, 1]).spawn(3))
    hide_rng = np.random.default_rng([wanted.seed, 2, zlib.crc32(" ".join(wanted.defects).encode())])
    drawn = draw_rig(wanted, rig_rng)
    kinds = choose(wanted, hide_rng) if wanted.encoders is None else ()
    habits = draw_habits(wanted, kinds, plan_rng)
    table = draw_timetable(wanted, drawn.true, habits, plan_rng)
    table = replace(table, scene=_with_drifting_thermometer(table.scene, wanted.thermometer_k))
    drawn, targets_m, target = _with_targets(wanted, drawn, table)
    posture_rad = table.scene.goal_rad
    sigma_m = SIGMA[wanted.family] * float(plan_rng.uniform(0.7, 1.4))
    distances = measure_distances(drawn.true, plan_rng)

    def watch(defects: Sequence[Defect]) -> Observed:
        defects = defects if wanted.encoders is None else at_the_flange(defects, wanted.encoders)
        return observe(drawn.true, table.scene, defects, posture_rad, wire=wanted.family == "wire")

    hidden: list[HiddenMechanism] = []
    if wanted.encoders is not None and wanted.defects:
        scale = scale_of(drawn, table, watch, sigma_m, distances)
        for defect in machine_like(wanted.defects, site_of(wanted, drawn, table), hide_rng):
            between = over_noise(drawn.true, table.scene, [defect], wanted.encoders, posture_rad)
            hidden.append(HiddenMechanism(defect, max(scale.enr([defect]), between), max(scale.raw([defect]), between)))
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
        replace(
            state_rig(wanted, drawn, distances, sigma_m, plan_rng), targets_m=targets_m, targets_sigma_m=wanted.placed_m
        ),
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
        target,
        _turns_rad(wanted, drawn.true, table, hidden, posture_rad),
    )
