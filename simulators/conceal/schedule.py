"""When each pose is taken, from where it is approached, and what else changes meanwhile.

Places are visited one after the other and the first once more at the end; some poses are repeated at other times.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.thermal import temperatures
from simulators.defects.scene import Scene

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
REPEATED = 15
COPIES = 3  # beside the first: groups of four
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
) -> Timetable:
    """Orders the poses (pose, n), each of which belongs to a fixture place (0: none), and adds repeats.

    Poses of one number in `linked` (pose,) follow each other and are not repeated; 0: not linked.
    """
    group = np.zeros(len(pose_rad), dtype=np.int64)
    links = np.zeros(len(pose_rad), dtype=np.int64) if linked is None else linked
    loose = np.flatnonzero(links == 0)
    chosen = rng.choice(loose, size=min(REPEATED, loose.size), replace=False)
    group[chosen] = np.arange(1, chosen.size + 1)
    taken = np.concatenate((np.arange(len(pose_rad)), np.repeat(chosen, COPIES)))
    stay = _stays(place[taken], rng)
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
