"""The streams of a concealed session: its poses gone through one after the other, and a fault at work meanwhile."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import turned
from simulators.arm.statics import Load
from simulators.conceal.case import Case
from simulators.conceal.case_files import at_start
from simulators.conceal.observe import observe
from simulators.conceal.rig import DualPsd, TrueRig
from simulators.defects import Scene
from simulators.streams.course import STAND_S, Course, course
from simulators.streams.devices import (
    JOINT_NOISE_RAD,
    Stream,
    delivered,
    photocurrents_a,
    sample_times,
    second_encoders,
)
from simulators.streams.faults import HurriesReading, MovesOutput, ReadsEncoders, StampsLate, StreamFault, SwaysBase

Floats = NDArray[np.float64]
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
