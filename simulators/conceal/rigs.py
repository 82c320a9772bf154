"""Draws a rig: the arm as its maker draws it, its notation, what is mounted on it, how far truth is from nominal."""

import math
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.arm.drawing import Drawing, Row, as_local_poe, fixed_parts, turning_com_m
from simulators.arm.kinematics import Arm, moved, turned
from simulators.conceal.poses import reachable_share
from simulators.conceal.rig import Artefacts, Device, DualPsd, Spread, TrueRig, perturbed
from simulators.conceal.wanted import ConcealError, Wanted

NO_POSE = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
ARMS: dict[str, dict[str, Any]] = tomllib.loads(Path(__file__).with_name("arms.toml").read_text(encoding="utf-8"))


def drawn(name: str) -> Drawing:
    """An arm of arms.toml as its maker draws it."""
    arm = ARMS[name]
    rows = tuple(Row(a, math.radians(alpha), d, math.radians(theta)) for a, alpha, d, theta in arm.get("rows", ()))
    lower, upper = (tuple(math.radians(pair[i]) for pair in arm["limits_deg"]) for i in (0, 1))
    fixed = tuple((tuple(shift), tuple(turn)) for shift, turn in arm.get("fixed", ()))
    shift, turn = arm.get("flange", NO_POSE)
    return Drawing(
        name=name,
        model=arm["model"],
        rows=rows,
        fixed=fixed,
        flange=(tuple(shift), tuple(turn)),
        lower_rad=lower,
        upper_rad=upper,
        mass_kg=tuple(arm.get("mass_kg", ())),
        com_m=tuple(tuple(centre) for centre in arm.get("com_m", ())),
        gear_ratio=tuple(arm.get("gear_ratio", ())),
        reach_m=arm["reach_m"],
    )


IRB120, UR5, LARGE, KR6, ARM_CMM = map(drawn, ("irb120", "ur5", "large", "kr6", "arm-cmm"))
ROBOTS = (IRB120, UR5, LARGE)
BY_NAME = (*ROBOTS, KR6)  # what is drawn stays as it was: published seeds are of these three


Floats = NDArray[np.float64]
BAR_CHANCE = 0.6
HOLDINGS = 12  # of each bar
BAR_SIGMA_M = 1e-6  # a calibrated bar; ISO 10360-12 asks for a fifth of what it tests


def artefacts(cone_m: Floats, reach_m: float, rng: np.random.Generator) -> Artefacts:
    """The cones (cone, 3), and in most sessions one or two bars, held in many directions within reach."""
    count = int(rng.integers(1, 3)) if rng.random() < BAR_CHANCE else 0
    bar_m = np.round(reach_m * rng.uniform(0.35, 0.7, count), 6)
    held = np.tile(np.arange(count), HOLDINGS)  # in turns
    middle_m = reach_m * rng.uniform(0.35, 0.6, (held.size, 1)) * _unit(held.size, rng)
    middle_m[:, 2] = np.abs(middle_m[:, 2])
    half_m = 0.5 * bar_m[held][:, np.newaxis] * _unit(held.size, rng)
    ends_m = np.stack((middle_m - half_m, middle_m + half_m), axis=1).reshape(-1, 3)
    return Artefacts(np.concatenate((cone_m, ends_m)), len(cone_m), bar_m, held)


def _unit(rows: int, rng: np.random.Generator) -> Floats:
    vector = rng.standard_normal((rows, 3))
    return vector / np.linalg.norm(vector, axis=1, keepdims=True)


PLACE_TRIES = 30
REACHABLE = 0.06  # share of random lines to a place that one attempt reaches
NO_LASER_PLACE = np.eye(4)[np.newaxis]


@dataclass(frozen=True, eq=False)
class DrawnRig:
    """Nominal, assumed and true."""

    drawing: Drawing  # as the rig file shows it: perhaps in another notation, perhaps without masses
    nominal: TrueRig
    true: TrueRig
    spread: Spread


def draw_rig(wanted: Wanted, rng: np.random.Generator) -> DrawnRig:
    """The rig of a session. ConcealError for an arm of unknown name or places that cannot be reached."""
    full = _choose_arm(wanted, rng)
    shown = as_local_poe(full) if full.gear_ratio and rng.random() < 0.25 and not wanted.confused else full
    if rng.random() < 0.15:
        shown = replace(shown, mass_kg=(), com_m=())
    spread = _spread(full, rng)
    spread = spread if wanted.placed_m is None else replace(spread, tool_m=wanted.placed_m)
    arm = _nominal_arm(full, rng)
    if wanted.family == "dual-psd":
        nominal, true = _with_fixture(arm, full, wanted.places, spread, rng)
    else:
        point_m = np.array([0.0, 0.0, 0.05]) + rng.uniform(-0.06, 0.06, 3) if full.gear_ratio else np.zeros(3)
        nominal = TrueRig(arm, point_m, _others(wanted, full, rng))
        true = perturbed(nominal, spread, rng)
    return DrawnRig(_confused(shown) if wanted.confused else shown, nominal, true, spread)


def _confused(drawing: Drawing) -> Drawing:
    """The same numbers under the name of the other convention."""
    if drawing.model == "local-poe":
        raise ConcealError(f"{drawing.name} has no table of Denavit and Hartenberg; take another family or seed")
    return replace(drawing, model="mdh" if drawing.model == "dh" else "dh")


def _choose_arm(wanted: Wanted, rng: np.random.Generator) -> Drawing:
    if wanted.family == "cones":
        return ARM_CMM
    names = {drawing.name: drawing for drawing in BY_NAME}
    if wanted.arm is None:
        return ROBOTS[int(rng.integers(len(ROBOTS)))]
    if wanted.arm not in names:
        raise ConcealError(f"arm '{wanted.arm}' is not known; there are {', '.join(names)}")
    return names[wanted.arm]


def _spread(drawing: Drawing, rng: np.random.Generator) -> Spread:
    """Machining and assembly of a robot, 0.2 to 0.5 mm for a metre of reach; half of that for a measuring arm."""
    length_m = float(rng.uniform(1.5e-4, 4e-4) * max(drawing.reach_m, 0.8) * (1.0 if drawing.gear_ratio else 0.4))
    return Spread(
        length_m=length_m,
        angle_rad=float(rng.uniform(3e-4, 7e-4)),
        zero_rad=float(rng.uniform(2e-3, 8e-3)) if drawing.gear_ratio else 1e-3,
        tool_m=5e-4,
        laser_rad=3e-3,
        place_m=3e-3,
        place_rad=9e-3,
        psd2_m=1e-4,
        psd2_rad=1e-3,
        device_m=5e-3,
        device_rad=5e-3,
        mass=float(rng.uniform(0.1, 0.3)),
    )


def _nominal_arm(drawing: Drawing, rng: np.random.Generator) -> Arm:
    n = drawing.n_joints
    weighed = bool(drawing.mass_kg)
    return Arm(
        fixed=fixed_parts(drawing),
        zero_rad=np.zeros(n),
        lower_rad=np.asarray(drawing.lower_rad),
        upper_rad=np.asarray(drawing.upper_rad),
        mass_kg=np.asarray(drawing.mass_kg) if weighed else np.zeros(n),
        com_m=turning_com_m(drawing) if weighed else np.zeros((n, 3)),
        tool_kg=float(rng.uniform(0.3, 1.0) * max(drawing.reach_m, 0.5)) if weighed else 0.0,
        tool_com_m=np.array([0.0, 0.0, 0.04]) + rng.uniform(-0.02, 0.02, 3),
        gravity_m_s2=np.array([0.0, 0.0, -9.81]),
    )


def _others(wanted: Wanted, drawing: Drawing, rng: np.random.Generator) -> Device | Artefacts:
    """A tracker or drum two to three reaches away; cones on the table around the arm."""
    if wanted.family == "cones":
        azimuth = rng.uniform(-np.pi, np.pi) + 2.0 * np.pi * np.arange(wanted.places) / wanted.places
        radius_m = drawing.reach_m * rng.uniform(0.4, 0.75, wanted.places)
        height_m = rng.uniform(-0.1, 0.5, wanted.places)
        cone_m = np.stack((radius_m * np.cos(azimuth), radius_m * np.sin(azimuth), height_m), axis=1)
        return artefacts(cone_m, drawing.reach_m, rng)
    azimuth = rng.uniform(-np.pi, np.pi)
    far_m = drawing.reach_m * rng.uniform(1.6, 2.6) + (0.5 if wanted.family == "tracker" else 0.0)
    origin_m = np.array([far_m * np.cos(azimuth), far_m * np.sin(azimuth), rng.uniform(0.0, 1.0)])
    return Device(moved(origin_m, rng.uniform(-0.05, 0.05, 3) + np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)])))


def _with_fixture(
    arm: Arm, drawing: Drawing, places: int, spread: Spread, rng: np.random.Generator
) -> tuple[TrueRig, TrueRig]:
    """Laser 60 to 90 deg off the flange axis; places that can be reached, drawn one by one on the true arm."""
    lean, around = np.radians(rng.uniform(60.0, 90.0)), rng.uniform(-np.pi, np.pi)
    bare = DualPsd(
        laser_origin_m=np.array([0.0, 0.0, 0.05]) + rng.uniform(-0.05, 0.05, 3),
        laser_direction=np.array([np.sin(lean) * np.cos(around), np.sin(lean) * np.sin(around), np.cos(lean)]),
        half_size_m=float(rng.choice([0.010, 0.010, 0.015, 0.020])),
        psd2_in_psd1=_second_face(rng),
        places=NO_LASER_PLACE,
    )
    true = perturbed(TrueRig(arm, np.zeros(3), bare), spread, rng)
    nominal_places = [_place(true, drawing, rng) for _ in range(places)]
    off = moved(spread.place_m * rng.standard_normal((places, 3)), spread.place_rad * rng.standard_normal((places, 3)))
    nominal = np.stack(nominal_places)
    fixture = true.instrument
    assert isinstance(fixture, DualPsd)  # noqa: S101 - narrows the type
    return (
        TrueRig(arm, np.zeros(3), replace(bare, places=nominal)),
        replace(true, instrument=replace(fixture, places=nominal @ off)),
    )


def _second_face(rng: np.random.Generator) -> Floats:
    """PSD 2 in PSD 1: both faces see each other at one angle, so that either may be struck first from the same side."""
    incidence, apart_m = np.radians(rng.uniform(30.0, 40.0)), rng.uniform(0.06, 0.12)
    origin_m = apart_m * np.array([0.0, np.sin(incidence), np.cos(incidence)])
    return moved(origin_m, np.array([np.pi - 2.0 * incidence, 0.0, 0.0]))


def _place(true: TrueRig, drawing: Drawing, rng: np.random.Generator) -> Floats:
    """A place that looks towards the arm and that enough poses reach; of many tries the best."""
    best, best_share = np.eye(4), 0.0
    fixture = true.instrument
    assert isinstance(fixture, DualPsd)  # noqa: S101 - narrows the type
    for _ in range(PLACE_TRIES):
        azimuth = rng.uniform(-2.2, 2.2)
        radius_m, height_m = drawing.reach_m * rng.uniform(0.35, 0.85), drawing.reach_m * rng.uniform(0.05, 0.75)
        facing = turned(np.array([0.0, 0.0, azimuth - 0.5 * np.pi + rng.uniform(-1.0, 1.0)]))
        place = facing @ turned(np.array([rng.uniform(-0.6, 0.6), rng.uniform(-0.4, 0.4), 0.0]))
        place[:3, 3] = radius_m * np.cos(azimuth), radius_m * np.sin(azimuth), height_m
        share = reachable_share(true, replace(fixture, places=place[np.newaxis]), 1, rng)
        if share > best_share:
            best, best_share = place, share
        if best_share >= REACHABLE:
            return best
    if best_share < 0.01:
        raise ConcealError(
            f"no place of {PLACE_TRIES} that {drawing.name} can see from enough sides; take another seed"
        )
    return best
