"""The streams of a concealed session: its poses one after the other, a fault at work, and the devices that stream.

Devices have their own clocks, rates and noise, and their host stamps come late.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import turned
from simulators.arm.statics import Load
from simulators.conceal.case import Case
from simulators.conceal.case_files import at_start
from simulators.conceal.observe import observe
from simulators.conceal.rig import DualPsd, TrueRig
from simulators.defects import Scene
from simulators.streams.course import STAND_S, Course, course
from simulators.streams.faults import HurriesReading, MovesOutput, ReadsEncoders, StampsLate, StreamFault, SwaysBase

Floats = NDArray[np.float64]

RATE_HZ = {"robot": 125.0, "encoders": 100.0, "psd": 250.0}
EPOCH_S = 40.0  # nobody sets these clocks: up to so far apart
QUARTZ = 2e-5  # one sigma of their rates
HOST_S = 1000.0
LINE_S = 2e-4  # that a line delays, at least and usually
JOINT_NOISE_RAD, ENCODER_NOISE_RAD = 2e-6, 6e-6
ZERO_RAD, DISC_RAD = 1e-2, 1e-4  # of the second encoders: how they were mounted
LIGHT_A = 1e-4  # of both electrodes of an axis
DARK_A = 1e-9


@dataclass(frozen=True, eq=False)
class Clock:
    """A device's: own = true (1 + rate) + epoch_s."""

    epoch_s: float
    rate: float

    def own(self, true_s: Floats) -> Floats:
        return true_s * (1.0 + self.rate) + self.epoch_s


@dataclass(frozen=True, eq=False)
class Stream:
    """What a recorder gets of one device; `clock` is what is true of its stamps."""

    host_s: Floats
    device_s: Floats
    sequence: NDArray[np.int64]
    values: Mapping[str, Floats]
    clock: Clock


def sample_times(device: str, last_s: float, rng: np.random.Generator) -> Floats:
    """True times (row,) at which a device samples until `last_s`."""
    period_s = 1.0 / RATE_HZ[device]
    return np.arange(rng.uniform(0.0, period_s), last_s, period_s)


def delivered(time_s: Floats, values: Mapping[str, Floats], late_s: float, rng: np.random.Generator) -> Stream:
    """Values that were true at `time_s`, stamped `late_s` afterwards."""
    clock = Clock(float(rng.uniform(0.0, EPOCH_S)), float(QUARTZ * rng.standard_normal()))
    stamped_s = time_s + late_s
    host_s = np.maximum.accumulate(HOST_S + stamped_s + LINE_S + rng.exponential(LINE_S, len(time_s)))
    return Stream(host_s, clock.own(stamped_s), np.arange(len(time_s), dtype=np.int64), values, clock)


def second_encoders(q_rad: Floats, rng: np.random.Generator) -> Floats:
    """(row, n) of encoders at the links: mounted anyhow, discs a little off centre."""
    n = q_rad.shape[1]
    disc = DISC_RAD * np.cos(q_rad + rng.uniform(0.0, 2.0 * np.pi, n))
    return q_rad + disc + ZERO_RAD * rng.standard_normal(n) + ENCODER_NOISE_RAD * rng.standard_normal(q_rad.shape)


def photocurrents_a(spot_m: Floats, half_size_m: float) -> Floats:
    """(row, 8) of both faces: x1, x2, y1, y2 each; dark where a spot is off its face."""
    share = spot_m.reshape(-1, 2, 2) / half_size_m
    lit = np.all(np.abs(share) <= 1.0, axis=2) & np.isfinite(share).all(axis=2)
    pair = 0.5 * LIGHT_A * np.stack((1.0 - share, 1.0 + share), axis=3)
    return np.where(lit[:, :, np.newaxis, np.newaxis], pair, DARK_A).reshape(-1, 8)


WAIT_S, READ_S = 0.35, 0.2  # of a patient program: from the stop to the reading, and its length
SPOT_NOISE_M = 2e-6
STEP_ROWS = 20000  # of spots at a time


@dataclass(frozen=True, eq=False)
class StreamedSession:
    """By name: "robot", "encoders", "psd"; when each sample was read, on true time and on the PSD box's clock."""

    streams: Mapping[str, Stream]
    read_s: Floats  # (sample,) middle
    window_s: Floats  # (sample, 2)


@dataclass(frozen=True, eq=False)
class _Sway:
    """The foot as a mechanism of the chain: turned by (row, 3)."""

    turn_rad: Floats

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        return turned(self.turn_rad)


def streamed(case: Case, fault: StreamFault | None, rng: np.random.Generator) -> StreamedSession:
    """Of a session with a dual-PSD fixture; the samples are those of the case."""
    way = course(case.posture_rad)
    robot_s, encoder_s, psd_s = (sample_times(d, float(way.time_s[-1]), rng) for d in ("robot", "encoders", "psd"))
    shafts = way.at(way.q_rad, robot_s)
    robot = {
        "target_q_rad": way.at(way.command_rad, robot_s),
        "actual_q_rad": shafts + JOINT_NOISE_RAD * rng.standard_normal(shafts.shape),
    }
    read = fault.read_rad(way, way.q_rad) if isinstance(fault, ReadsEncoders) else way.q_rad
    encoders = {"position_rad": second_encoders(way.at(read, encoder_s), rng)}
    psd = {"photocurrent_a": _currents(case, way, fault, psd_s, rng)}
    late = {device: fault.late_s(device) if isinstance(fault, StampsLate) else 0.0 for device in ("robot", "encoders")}
    streams = {
        "robot": delivered(robot_s, robot, late["robot"], rng),
        "encoders": delivered(encoder_s, encoders, late["encoders"], rng),
        "psd": delivered(psd_s, psd, 0.0, rng),
    }
    wait_s = fault.wait_s() if isinstance(fault, HurriesReading) else WAIT_S
    window_s = np.stack((way.stops_s + wait_s, way.stops_s + wait_s + READ_S), axis=1)
    return StreamedSession(streams, window_s.mean(axis=1), streams["psd"].clock.own(window_s))


def _currents(case: Case, way: Course, fault: StreamFault | None, time_s: Floats, rng: np.random.Generator) -> Floats:
    """(row, 8): spots of the fixture that stood there at the next stop."""
    fixture = case.drawn.true.instrument
    if not isinstance(fixture, DualPsd):
        raise TypeError(f"streams of spots need a dual-PSD fixture, not a {type(fixture).__name__}")
    output = way.q_rad - fault.left_rad(way) if isinstance(fault, MovesOutput) else way.q_rad
    sway = fault.sway_rad(way) if isinstance(fault, SwaysBase) else None
    following = np.minimum(np.searchsorted(way.stops_s, time_s - STAND_S), len(way.stops_s) - 1)
    spots = [
        _spots_m(case.drawn.true, case.table.scene, way, output, sway, time_s[a : a + STEP_ROWS], following[a:])
        for a in range(0, len(time_s), STEP_ROWS)
    ]
    spot_m = np.concatenate(spots)
    return photocurrents_a(spot_m + SPOT_NOISE_M * rng.standard_normal(spot_m.shape), fixture.half_size_m)


def _spots_m(
    true: TrueRig,
    scene: Scene,
    way: Course,
    output_rad: Floats,
    sway_rad: Floats | None,
    time_s: Floats,
    sample: NDArray[np.intp],
) -> Floats:
    """(row, 4) at these times; `sample`: whose fixture place and order count."""
    q_rad, which = way.at(output_rad, time_s), sample[: len(time_s)]
    there = replace(
        at_start(scene, q_rad, np.random.default_rng(0)),
        t_s=time_s,
        placement=scene.placement[which],
        first_psd=scene.first_psd[which],
    )
    swaying = () if sway_rad is None else (_Sway(way.at(sway_rad, time_s)),)
    return observe(true, there, swaying, q_rad).values_m  # pyright: ignore[reportArgumentType] - has what a chain asks
