"""How a session is run: its habits, its poses and their order, and what else changes meanwhile.

Places are visited one after the other and the first once more at the end; some poses are repeated at other times.
Temperatures: the room wanders, motors warm the joints, joints warm the links, the laser warms itself. Each is one
thermal mass (first-order lag: Newton law of cooling), solved on a grid of 20 s, read off in between.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from simulators.conceal.observe import seated_plan
from simulators.conceal.poses import free_poses, shots
from simulators.conceal.rig import Artefacts, DualPsd, TrueRig
from simulators.conceal.wanted import ConcealError, Wanted
from simulators.defects import Defect, Scene

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
GRID_S = 20.0
START_DEGC = 21.5
REST_S = 45.0  # longer without a sample, and the drives are held by their brakes


def temperatures(t_s: Floats, n_joints: int, rng: np.random.Generator) -> Mapping[str, Floats]:
    """By place, (row,) degC: "room", "joint<i>", "link<i>", "laser". Near its samples the arm works, else it rests."""
    grid_s = np.arange(0.0, t_s[-1] + 2.0 * GRID_S, GRID_S)
    following = np.clip(np.searchsorted(t_s, grid_s), 1, t_s.size - 1)
    apart_s = np.minimum(np.abs(grid_s - t_s[following - 1]), np.abs(t_s[following] - grid_s))
    busy = (apart_s < REST_S).astype(np.float64)
    room = _room(grid_s, rng)
    found = {"room": room}
    for joint in range(1, n_joints + 1):
        rise_k = rng.uniform(4.0, 12.0)
        motor = room + _lagged(rise_k * busy, float(rng.uniform(900.0, 2400.0)))
        found[f"joint{joint}"] = motor
        share = rng.uniform(0.3, 0.6)
        found[f"link{joint}"] = room + _lagged(share * (motor - room), float(rng.uniform(600.0, 1800.0)))
    found["laser"] = room + _lagged(np.full_like(grid_s, rng.uniform(3.0, 6.0)), float(rng.uniform(300.0, 900.0)))
    return {where: np.interp(t_s, grid_s, degC) for where, degC in found.items()}


def _room(grid_s: Floats, rng: np.random.Generator) -> Floats:
    """A wandering room: two slow waves and a filtered random walk, about +-1.5 K."""
    waves = sum(
        rng.uniform(0.3, 1.0) * np.sin(2.0 * np.pi * grid_s / rng.uniform(2400.0, 9000.0) + rng.uniform(0.0, 6.28))
        for _ in range(2)
    )
    walk = _lagged(np.cumsum(rng.normal(0.0, 0.06, grid_s.size)), 300.0)
    return START_DEGC + waves + walk


def _lagged(drive: Floats, time_constant_s: float) -> Floats:
    """First-order lag from rest, exact for a drive that holds within each step of the grid."""
    keep = float(np.exp(-GRID_S / time_constant_s))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], drive), dtype=np.float64)


REPEATED = 15
COPIES = 3  # beside the first: groups of four
FEW = 20  # samples of a session: below, no pose is repeated
CYCLE_S = (6.0, 11.0)  # move, settle, read
MOVE_S = 2.0  # every move takes the same time: a point-to-point program with fixed segment times


@dataclass(frozen=True)
class Habits:
    """How a session is run."""

    patterned: bool = False  # every sample is approached by a short move with a random sign for each joint
    moving: bool = False  # half of the samples are taken in passing
    wait_s: float = 1.0  # from the end of the move to the reading
    payload_kg: tuple[float, ...] = (0.0,)  # carried in turns
    pause_s: float = 0.0  # one long break, in which the arm cools
    change_s: float = 400.0  # to carry the fixture to another place
    in_turns: bool = False  # every station stands there all the time, and they are measured in turns


@dataclass(frozen=True, eq=False)
class Timetable:
    """The samples in order of time."""

    pose: Whole  # (row,) which of the poses
    repeat: Whole  # (row,) group, 0: not repeated
    scene: Scene
    stays_s: tuple[tuple[int, float, float], ...] = field(default=())


def timetable(
    pose_rad: Floats,
    place: Whole,
    first_psd: Whole,
    seat: Whole,
    habits: Habits,
    rng: np.random.Generator,
    linked: Whole | None = None,
    repeated: int = REPEATED,
) -> Timetable:
    """Orders the poses (pose, n), each of which belongs to a fixture place (0: none), and adds repeats.

    Poses of one number in `linked` (pose,) follow each other and are not repeated; 0: not linked.
    """
    group = np.zeros(len(pose_rad), dtype=np.int64)
    links = np.zeros(len(pose_rad), dtype=np.int64) if linked is None else linked
    loose = np.flatnonzero(links == 0)
    chosen = rng.choice(loose, size=min(repeated, loose.size), replace=False)
    group[chosen] = np.arange(1, chosen.size + 1)
    taken = np.concatenate((np.arange(len(pose_rad)), np.repeat(chosen, COPIES)))
    stay = np.zeros(taken.size, dtype=np.int64) if habits.in_turns else _stays(place[taken], rng)
    lot = rng.random(taken.size)
    lot = np.where(links[taken] > 0, rng.random(links.max() + 1)[links[taken]], lot)
    order = np.lexsort((lot, stay))
    row, stay = taken[order], stay[order]
    scene = _scene(_times(stay, habits, rng), pose_rad[row], place[row], first_psd[row], seat[row], habits, rng)
    return Timetable(row, group[row], scene, _stay_times(place[row], stay, scene.t_s))


def _scene(
    t_s: Floats, goal_rad: Floats, place: Whole, first_psd: Whole, seat: Whole, habits: Habits, rng: np.random.Generator
) -> Scene:
    """All that the samples are exposed to, in order of time."""
    via_rad, qd_rad_s = _moves(goal_rad, habits, rng)
    turns = np.arange(t_s.size) * 4 * len(habits.payload_kg) // t_s.size % len(habits.payload_kg)
    power = 1.0 + 0.01 * np.sin(2.0 * np.pi * t_s / 1700.0 + rng.uniform(0.0, 6.28)) + rng.normal(0.0, 0.002, t_s.size)
    return Scene(
        t_s=t_s,
        via_rad=via_rad,
        goal_rad=goal_rad,
        qd_rad_s=qd_rad_s,
        wait_s=np.full(t_s.size, habits.wait_s),
        payload_kg=np.asarray(habits.payload_kg)[turns],
        payload_com_m=rng.uniform(-0.03, 0.03, 3) + np.array([0.0, 0.0, 0.10]),
        placement=place,
        first_psd=first_psd,
        seat=seat,
        temperature_degC=temperatures(t_s, goal_rad.shape[1], rng),
        laser_power=power,
        extra={"fan_rpm": _fan_rpm(t_s, rng)},
    )


def _stays(place: Whole, rng: np.random.Generator) -> Whole:
    """(row,) the stay in which each sample is taken: one a place, and a second of the first place at the end."""
    if not place.any():
        return np.zeros_like(place)
    back = (place == 1) & (place.max() > 1) & (rng.random(place.size) < 0.4)
    return np.where(back, place.max() + 1, place)


def _times(stay: Whole, habits: Habits, rng: np.random.Generator) -> Floats:
    step_s = rng.uniform(*CYCLE_S, stay.size)
    step_s[1:] += np.where(np.diff(stay) != 0, habits.change_s * rng.uniform(0.7, 1.3, stay.size - 1), 0.0)
    step_s[int(rng.uniform(0.4, 0.7) * stay.size)] += habits.pause_s
    step_s[0] = 0.0
    return np.round(np.cumsum(step_s), 3)


def _moves(goal_rad: Floats, habits: Habits, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Where each last move began, and the speed at the sample; both (row, n)."""
    qd_rad_s = np.zeros_like(goal_rad)
    via_rad = np.concatenate((np.zeros_like(goal_rad[:1]), goal_rad[:-1]))
    if habits.patterned or habits.moving:
        sign = rng.choice([-1.0, 1.0], goal_rad.shape)
        via_rad = goal_rad - sign * rng.uniform(0.03, 0.08, goal_rad.shape)
    if habits.moving:
        passing = (rng.random(len(goal_rad)) < 0.5)[:, np.newaxis]
        qd_rad_s = np.where(passing, (goal_rad - via_rad) / MOVE_S * rng.uniform(0.3, 1.5, (len(goal_rad), 1)), 0.0)
    return via_rad, qd_rad_s


def _fan_rpm(t_s: Floats, rng: np.random.Generator) -> Floats:
    """A cabinet fan that its thermostat switches between two speeds, and wear makes uneven."""
    period_s = rng.uniform(500.0, 1100.0)
    on = np.sin(2.0 * np.pi * t_s / period_s + rng.uniform(0.0, 6.28)) > rng.uniform(-0.4, 0.4)
    return np.where(on, 2400.0, 1100.0) + rng.normal(0.0, 60.0, t_s.size)


def _stay_times(place: Whole, stay: Whole, t_s: Floats) -> tuple[tuple[int, float, float], ...]:
    return tuple(
        (int(place[stay == number][0]), float(t_s[stay == number][0]), float(t_s[stay == number][-1]) + 1.0)
        for number in np.unique(stay).tolist()
    )


ENOUGH = 0.5  # of the wanted poses: fewer are no session
CENTRED = 0.2  # share of the shots that aim at both centres


def draw_habits(wanted: Wanted, kinds: Sequence[type[Defect]], rng: np.random.Generator) -> Habits:
    """Habits that let the defects be seen; the same habits also occur without them, so that they give nothing away."""
    asked = {kind.HABIT for kind in kinds} - {""}
    loads = (0.0, float(np.round(rng.uniform(1.0, 3.0), 1)))
    carries = "payload" in asked or rng.random() < 0.2
    always = (float(np.round(rng.uniform(0.5, 2.5), 1)),) if rng.random() < 0.25 else (0.0,)
    patterned = rng.random() < 0.6 or wanted.withhold
    driven = wanted.family != "cones"
    return Habits(
        patterned=patterned and "direct" not in asked,
        moving="moving" in asked or (driven and not asked and rng.random() < 0.1),
        payload_kg=(loads if carries else always) if driven else (0.0,),
        pause_s=float(rng.choice([0.0, 2400.0])),
        in_turns="in turns" in asked,
    )


def draw_timetable(wanted: Wanted, true: TrueRig, habits: Habits, rng: np.random.Generator) -> Timetable:
    """Poses and their order. ConcealError when the places of this seed let too few poses reach."""
    poses = max(wanted.samples - COPIES * REPEATED, REPEATED)
    instrument = true.instrument
    none = np.zeros(poses, dtype=np.int64)
    if isinstance(instrument, Artefacts):
        reading_rad, seat, linked = seated_plan(true, instrument, poses, rng)
        _refuse_few(len(seat), poses)
        none = np.zeros_like(seat)
        return timetable(reading_rad, none, none, seat, habits, rng, linked)
    if not isinstance(instrument, DualPsd):
        if wanted.samples < FEW:
            few = np.zeros(wanted.samples, dtype=np.int64)
            return timetable(free_poses(true.arm, few.size, rng), few, few, few, habits, rng, repeated=0)
        return timetable(free_poses(true.arm, poses, rng), none, none, none, habits, rng)
    each = [poses // wanted.places + (k < poses % wanted.places) for k in range(wanted.places)]
    taken = [shots(true, instrument, k + 1, number, CENTRED, rng) for k, number in enumerate(each)]
    reading_rad = np.concatenate([one.reading_rad for one in taken])
    _refuse_few(len(reading_rad), poses)
    place = np.repeat(np.arange(1, wanted.places + 1), [len(one.reading_rad) for one in taken])
    first = np.concatenate([one.first_psd for one in taken])
    return timetable(reading_rad, place, first, np.zeros_like(place), habits, rng)


def _refuse_few(found: int, poses: int) -> None:
    if found < ENOUGH * poses:
        raise ConcealError(f"only {found} of {poses} poses can be reached with this seed; take another one")
