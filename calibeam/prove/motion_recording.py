"""Recordings of an arm in motion, for the concealed proof of torques: offline in the world, or over emulated wires.

The recording holds set-points, joint angles, and torques or currents, with the assumed rig and nothing of the world.
Emulated controllers report exact numbers: the noise of the readings is added where a block of them arrives.
"""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Channel, RecordingWriter, read
from acquisition.recording.rig import parse_rig, plain_rig, rig_text
from acquisition.wires.streams import Pump
from calibeam.devices.encoders import emulated_encoders, encoder_driver
from calibeam.devices.robot import emulated_robot, robot_of
from calibeam.rig_files import RIGS
from calibeam.software import SOFTWARE
from drivers.clock import SystemClock
from drivers.device import Block, Device, Movable, stamps_of
from drivers.errors import DeviceError
from simulators.conceal.motion.driving import Moved, drive
from simulators.conceal.motion.motion_case import MotionCase, draw_motion
from simulators.conceal.motion.over_noise import over_noise
from simulators.conceal.rig_file import toml_text
from simulators.conceal.wanted import ConcealError, Wanted
from simulators.defects import written
from simulators.process import Emulators, EmulatorsError
from simulators.streams.stream_session import HOST_S

Floats = NDArray[np.float64]
RIG = RIGS / "ur5e-dual-psd.toml"
WIRED = ("robot", "encoders")  # devices of that rig
PACE = 4.0  # emulated seconds in one of ours
MIDDLE_RAD = np.array([0.3, -1.4, 1.4, -0.8, 0.5, 0.0])
REACH_RAD = np.array([1.0, 0.5, 0.8, 1.0, 1.0, 1.5])
MOVES = 16  # some 20 s
SPEED_RAD_S, ACCELERATION_RAD_S2 = (0.5, 1.5), (2.0, 5.0)


def record_motion(wanted: Wanted, path: Path) -> dict[str, Any]:
    """Moves the world's arm, writes the recording; returns what is true, for the seal."""
    case = draw_motion(wanted)
    moved = drive(case)
    n, per_ampere = moved.q_rad.shape[1], case.per_ampere
    name, unit = ("joint_torque_nm", "Nm") if per_ampere is None else ("actual_current_a", "A")
    values = {
        "target_q_rad": moved.target_rad,
        "actual_q_rad": moved.q_rad,
        name: moved.torque_nm / (1.0 if per_ampere is None else per_ampere),
    }
    channels = tuple(Channel(c, unit if c == name else "rad", (n,)) for c in values)
    rows = np.arange(len(moved.time_s))
    with _writer(case.stated, path) as writer:
        writer.stream("robot", channels, stamps="sampled").append(HOST_S + moved.time_s, moved.time_s, rows, values)
    return truth_of_motion(case, moved)


def record_wired_motion(wanted: Wanted, path: Path) -> dict[str, Any]:
    """The same of an emulated UR that is moved from pose to pose and recorded over its wires, with CAN encoders.

    ConcealError where the emulators or the wires failed.
    """
    case = draw_motion(wanted)
    plain = plain_rig(rig_text(RIG), str(RIG))
    devices = {"devices": {name: plain["devices"][name] for name in WIRED}}
    hidden = written(case.hidden)
    try:
        with Emulators(
            {**case.true, **devices}, seed=wanted.seed, time_scale=PACE, links=False, hidden=hidden
        ) as emulators:
            _record(case, {**case.stated, **devices}, emulators.address, path)
    except (DeviceError, EmulatorsError) as reason:
        raise ConcealError(f"the motion on the wires ended early: {reason}") from reason
    return truth_of_motion(case, _moved(case, path))


def _record(case: MotionCase, stated: Mapping[str, Any], address: Mapping[str, Any], path: Path) -> None:
    clock, text = SystemClock(), toml_text(stated)
    rig = parse_rig(text, "rig of the site")
    if rig.devices.robot is None or rig.devices.encoders is None:
        raise ConcealError(f"{RIG.name}: [devices] has no robot or no encoders")
    robot = robot_of(emulated_robot(rig.devices.robot, address["robot"]), clock, PACE)
    encoders = encoder_driver(emulated_encoders(rig.devices.encoders, address["can"]), clock, hurry=PACE)
    noise, failures = ReadingNoise(case, np.random.default_rng([case.wanted.seed, 36])), []
    arm = robot.arm()
    with _writer(stated, path) as writer, ExitStack() as cleaning:
        cleaning.callback(arm.close)
        arm.connect()
        arm.move_joints(MIDDLE_RAD, SPEED_RAD_S[1], ACCELERATION_RAD_S2[1])
        for device in (robot.reader, encoders):
            cleaning.enter_context(_reading(device, writer, clock, noise, failures))
        _move(arm, np.random.default_rng([case.wanted.seed, 34]))
    if failures:
        raise ConcealError(f"the motion on the wires ended early: {failures[0]}") from failures[0]


def _move(arm: Movable, rng: np.random.Generator) -> None:
    for _ in range(MOVES):
        goal_rad = MIDDLE_RAD + REACH_RAD * rng.uniform(-1.0, 1.0, len(MIDDLE_RAD))
        arm.move_joints(goal_rad, float(rng.uniform(*SPEED_RAD_S)), float(rng.uniform(*ACCELERATION_RAD_S2)))


def _reading(
    device: Device, writer: RecordingWriter, clock: SystemClock, noise: "ReadingNoise", failures: list[Exception]
) -> ExitStack:
    """The device connected, its blocks with noise going into the recording until left."""
    with ExitStack() as begun:
        begun.callback(device.close)
        device.connect()
        channels = tuple(Channel(c.name, c.unit, c.shape, c.full_scale, c.resolution) for c in device.describe())
        stream = writer.stream(device.name, channels, stamps=stamps_of(device))

        def keep(block: Block) -> None:
            stream.append(block.host_s, block.device_s, block.sequence, noise.on(block))

        pump = Pump(device, clock, keep, failures.append)
        begun.callback(pump.stop)
        pump.start()
        return begun.pop_all()


@dataclass(frozen=True, eq=False)
class ReadingNoise:
    """Of the controller's readings."""

    case: MotionCase
    rng: np.random.Generator

    def on(self, block: Block) -> Mapping[str, Any]:
        """The values of a block as a noisy controller would have sent them."""
        per_ampere = self.case.per_ampere
        sigma: dict[str, float | Floats] = {"actual_q_rad": self.case.angle_sigma_rad}
        if per_ampere is not None:
            sigma["actual_current_a"] = self.case.torque_sigma_nm / per_ampere
        return {
            name: values + sigma[name] * self.rng.standard_normal(np.shape(values)) if name in sigma else values
            for name, values in block.values.items()
        }


def _moved(case: MotionCase, path: Path) -> Moved:
    robot = read(path).streams["robot"]
    per_ampere = 1.0 if case.per_ampere is None else case.per_ampere
    target, q, current = (robot.values[c] for c in ("target_q_rad", "actual_q_rad", "actual_current_a"))
    return Moved(robot.device_s, target, q, current * per_ampere)


def _writer(stated: Mapping[str, Any], path: Path) -> RecordingWriter:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)  # of an attempt that ended early
    return RecordingWriter(path, rig_text=toml_text(stated), software=SOFTWARE, clock=SystemClock())


def truth_of_motion(case: MotionCase, moved: Moved) -> dict[str, Any]:
    """Defects as those of poses, noise, and the true rig."""
    return {
        "schema": 1,
        "wanted": asdict(case.wanted),
        "defects": [
            {
                "mechanism": one.KIND,
                "physics": one.PHYSICS,
                "port": one.port,
                "drivers": list(one.drivers),
                "fields": dict(vars(one)),
                "figures": dict(one.figures),
                "enr": enr,
            }
            for one, enr in zip(case.hidden, over_noise(case, moved), strict=True)
        ],
        "torque_sigma_nm": case.torque_sigma_nm.tolist(),
        "angle_sigma_rad": case.angle_sigma_rad,
        "rig": case.true,
    }
