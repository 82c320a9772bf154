"""The gate for a rig's arm: its kinematics, limits, cell and rates, all from the rig file and the identified model."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.cell import Box, Cell, SlowArea
from acquisition.motion.following import SetPoints, SetPointStream
from acquisition.motion.gate import Gate
from acquisition.motion.inverse.closed_form import closed_form
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.paths.segments import Pace
from acquisition.motion.setpoints import solve_rate_hz
from acquisition.motion.under_way import GatedArm
from acquisition.recording.rig import ArmModel, Rig
from acquisition.wires.streams import Pump
from calibeam.geometry_only import read_geometry
from calibrate.errors import DataError
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.model_file import corrections
from drivers.clock import Clock
from drivers.device import Movable

Floats = NDArray[np.float64]

WAIT_S = 0.5  # for the first sample of a reader that was just started

UR_STREAM_HZ = 500.0  # e-Series control cycle; the older series takes a set-point every fourth of these


def solver_of(rig: Rig, model: Path | None = None) -> Solver:
    """Inverse kinematics of the rig's nominal arm, or as identified. DataError for a model of another arm."""
    if model is None:
        return Solver(RigArm.of_rig(rig), closed_form(RigArm.of_rig(rig)))
    identified = read_geometry(model)
    if identified.rig.name != rig.name:
        raise DataError(f"{model}: this model is of rig '{identified.rig.name}', not of '{rig.name}'; take its own")
    return Solver(RigArm.of_rig(rig, corrections(identified)), closed_form(RigArm.of_rig(rig)))


def pace_of(rig: Rig, speed_share: float = 1.0) -> Pace:
    """The [motion] of the rig, its speeds taken to a share."""
    motion, ones = rig.motion, np.ones(rig.n_joints)
    return Pace(
        speed_share * motion.speed_rad_s * ones,
        motion.acceleration_rad_s2 * ones,
        speed_share * motion.line_speed_m_s,
        speed_share * Pace.line_turn_rad_s,
    )


def cell_of(rig: Rig) -> Cell:
    """Boxes of the rig; the laser and the probe count as points of the body."""
    motion = rig.motion
    slow = tuple(SlowArea(Box(b.name, b.lower_m, b.upper_m), b.speed_m_s) for b in motion.slow_area)
    keep_out = tuple(Box(b.name, b.lower_m, b.upper_m) for b in motion.keep_out)
    tool = tuple(point for point in (rig.tool.laser_origin_m, rig.tool.point_m) if point is not None)
    # Denavit and Hartenberg's link frames are those of the kinematics; other notations' stand at the link's start.
    com = tuple(joint.com_m for joint in rig.arm.joints[:-1]) if rig.arm.model is ArmModel.DH else ()
    return Cell(keep_out, slow, motion.clearance_m, tool, com)


def gated_arm(arm: Movable, rig: Rig, robot: Pump) -> GatedArm:
    """The controller behind the gate, for motions that it makes itself. DeviceStale where it reports no joints."""

    def now() -> Floats:
        block = robot.latest() or robot.wait(-np.inf, WAIT_S)[-1]
        out: Floats = block.values["actual_q_rad"][-1]
        return out

    return GatedArm(arm, RigArm.of_rig(rig), cell_of(rig), now)


@dataclass(frozen=True)
class DeviceTime:
    """A clock that runs with emulators of another pace; its start is that of the host's clock."""

    host: Clock
    hurry: float  # device seconds in one of the host

    def now_s(self) -> float:
        return self.hurry * self.host.now_s()

    def sleep_s(self, seconds: float) -> None:
        self.host.sleep_s(seconds / self.hurry)


def gate_of(
    rig: Rig, solver: Solver, arm: SetPoints, clock: Clock, speed_share: float = 1.0, hurry: float = 1.0
) -> Gate:
    """Ready to plan and run. `hurry`: device seconds in one of the host's; set-points go out as often as on site, so
    that a faster device has fewer of them, and rounds them off over as many.
    """
    hz, plain = UR_STREAM_HZ / hurry, SetPointStream()
    stream = SetPointStream(
        hz=hz,
        solve_hz=solve_rate_hz(rig.motion.structural_hz, hz),
        lookahead_s=plain.lookahead_s * hurry,
        lag_s=rig.motion.lag_s,
        rested_s=plain.rested_s * hurry,
        late_s=plain.late_s * hurry,
    )
    pace = pace_of(rig, speed_share)
    return Gate(solver, pace, cell_of(rig), arm, stream, clock if hurry == 1.0 else DeviceTime(clock, hurry))
