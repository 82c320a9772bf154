"""UR5e controller, PolyScope 5.12: RTDE, script ports and dashboard over one arm of the emulated world.

    bench = build(world, rig, "127.0.0.2")

What it does not imitate: Modbus (simulators/modbus does), PolyScope X, program trees, URCaps, and the
speed of the controller's own start. What each port leaves out stands in its own file: rtde_server, script_port,
script_text, dashboard_server, control_script; what the arm leaves out, in motion.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Protocol

from simulators.hand.world import GuidedRobot
from simulators.ur.control_script import ControlScript
from simulators.ur.controller_kinematics import NominalArm
from simulators.ur.dashboard_server import Dashboard
from simulators.ur.dynamics import ArmWorld, Carried, Obstacle
from simulators.ur.motion import ArmController, MoveRefused
from simulators.ur.program import Program, ProgramRunner
from simulators.ur.readout import Readout
from simulators.ur.registers import Installation, Memory
from simulators.ur.rtde_server import RtdeServer
from simulators.ur.script_program import (
    LineProgram,
    ScriptRefused,
    is_control_program,
    read_control_program,
    read_lines,
)
from simulators.ur.state_streams import ScriptWire, primary_stream, realtime_stream
from simulators.wire import Bench, DeviceClock, TcpPort, Wire
from simulators.world.world import World

RTDE_PORT, DASHBOARD_PORT, SCRIPT_PORTS = 30004, 29999, (30001, 30002, 30003)
PRIMARY_PORT, REALTIME_PORT = 30001, 30003
VERSION = (5, 12, 0, 1101)  # later than 5.22 changes recipes and breaks upper registers of ur_rtde 1.6.5
OLDEST, NEWEST = (5, 10), (5, 25)  # sizes of the state streams; direct_torque(), which 5.26 has
SERIAL_NUMBER, MODEL = "20195000001", "UR5"  # a UR5e calls itself UR5 on the dashboard
FULL_TURN_RAD = 6.283185307179586


class Closable(Wire, Protocol):
    """A wire that the host lets go of once `closing` is set and everything has been sent."""

    closing: bool


class UrController:
    """The controller behind its wires; one `Instrument`."""

    name = "ur"

    def __init__(self, arm: ArmController, memory: Memory) -> None:
        self.arm, self.memory = arm, memory
        self.runner = ProgramRunner(arm)
        self.rtde = RtdeServer(memory, VERSION, self._read)
        self.dashboard = Dashboard(arm, self.runner, self._compile, _dotted(VERSION), SERIAL_NUMBER, MODEL)
        self.clock = DeviceClock()
        self._tick = 0
        self._wires: list[Closable] = []

    def before_step(self, t_s: float) -> None:
        self.memory.apply_outputs()
        self.runner.before_step(t_s, self.memory.speed_slider)
        self.arm.before_step(t_s)

    def after_step(self, t_s: float) -> None:
        self._tick += 1
        self.rtde.new_cycle()

    def run_script(self, text: str) -> None:
        """A program from a script port replaces the running one; a refused one leaves a reason and nothing else."""
        try:
            self.runner.start(self._compile(text))
        except (ScriptRefused, MoveRefused) as refused:
            self.runner.fail(str(refused))

    def report_version(self, version: tuple[int, int, int, int]) -> None:
        """The PolyScope version that clients see from their next connection on. ValueError for one not imitated."""
        if not OLDEST <= version[:2] <= NEWEST:
            raise ValueError(f"PolyScope {_dotted(version)}: {_dotted(OLDEST)} to {_dotted(NEWEST)} can be imitated")
        self.rtde.version, self.dashboard.polyscope = version, _dotted(version)

    def port(self, name: str, host: str, number: int, accept: Callable[[], Closable]) -> TcpPort:
        """A port whose clients `disconnect` reaches."""

        def accepted() -> Wire:
            wire = accept()
            self._wires.append(wire)
            return wire

        return TcpPort(name, host, number, accepted, self._closed)

    def disconnect(self) -> None:
        """Drops every client, as a controller does that shuts down; they may connect again."""
        for wire in self._wires:
            wire.closing = True

    def script_wire(self, port: int = REALTIME_PORT) -> ScriptWire:
        if port == REALTIME_PORT:
            stream = realtime_stream(self._readout)
        else:
            stream = primary_stream(self._readout, self.rtde.version, self.runner if port == PRIMARY_PORT else None)
        return ScriptWire(self.run_script, stream.due)

    def _compile(self, text: str) -> Program:
        """ScriptRefused or MoveRefused for a text that cannot be run."""
        if is_control_program(text):
            return ControlScript(read_control_program(text), self.arm, self.memory)
        return LineProgram(read_lines(text), self.arm, self.memory)

    def _readout(self) -> Readout:
        return self.rtde.readout

    def _closed(self, wire: Wire) -> None:
        self._wires = [other for other in self._wires if other is not wire]
        self.memory.release(wire)

    def _read(self) -> Readout:
        return Readout(self._tick, self.arm, self.memory, self.runner.state, self.clock)


def build(world: ArmWorld, rig: Mapping[str, Any], host: str, *, unlock_delay_s: float = 0.0) -> Bench:
    """Everything that the host loop serves on `host`. ValueError when the rig's arm is none it can drive.

    `unlock_delay_s`: for how long a protective stop refuses to be unlocked (5 s on a real controller).
    """
    carried = _carried(rig)
    installation = Installation(carried.mass_kg, carried.com_m)
    controller = UrController(arm_controller(world, rig, unlock_delay_s=unlock_delay_s), Memory(installation))
    verbs = Safety(controller)
    ports = [
        controller.port("rtde", host, RTDE_PORT, controller.rtde.accept),
        controller.port("dashboard", host, DASHBOARD_PORT, controller.dashboard.accept),
        *(controller.port(f"script-{n}", host, n, partial(controller.script_wire, n)) for n in SCRIPT_PORTS),
    ]
    return Bench(
        [controller],
        ports,
        {
            "robot.protective_stop": verbs.protective_stop,
            "robot.unlock": verbs.unlock,
            "robot.emergency_stop": verbs.emergency_stop,
            "robot.silence": verbs.silence,
            "robot.disconnect": controller.disconnect,
            "robot.unlock_delay": verbs.unlock_delay,
            "robot.remote_control": verbs.remote_control,
            "robot.polyscope": verbs.polyscope,
            "robot.store": verbs.store,
            "robot.obstacle": verbs.obstacle,
            "robot.state": verbs.state,
            "robot.standing": verbs.standing,
            **(
                {"robot.guide": GuidedRobot(rig, world.truth, controller.arm).guide} if isinstance(world, World) else {}
            ),
        },
        controller.clock,
    )


def arm_controller(world: ArmWorld, rig: Mapping[str, Any], *, unlock_delay_s: float = 0.0) -> ArmController:
    """The motion controller alone, for use without a wire. ValueError as `build`."""
    arm = NominalArm.from_rig(rig)
    joints = rig["arm"]["joint"]
    counts = [joint.get("encoder_counts") for joint in joints]
    return ArmController(
        world,
        arm,
        [joint.get("lower_rad", -FULL_TURN_RAD) for joint in joints],
        [joint.get("upper_rad", FULL_TURN_RAD) for joint in joints],
        reading_step_rad=max(FULL_TURN_RAD / count if count else 0.0 for count in counts),
        unlock_delay_s=unlock_delay_s,
        carried=_carried(rig),
    )


def _carried(rig: Mapping[str, Any]) -> Carried:
    tool = rig.get("tool", {})
    gravity_m_s2 = rig["arm"].get("gravity_m_s2", Carried().gravity_m_s2)
    return Carried(tool.get("mass_kg", 0.0), tuple(tool.get("com_m", (0.0, 0.0, 0.0))), tuple(gravity_m_s2))


class Safety:
    """Side-channel verbs: what a person at the pendant, or a fault, would do."""

    def __init__(self, controller: UrController) -> None:
        self._controller = controller

    def protective_stop(self) -> None:
        self._controller.arm.protective_stop("side channel")

    def unlock(self) -> bool:
        """False while the controller still refuses."""
        return self._controller.arm.unlock()

    def emergency_stop(self, on: bool = True) -> None:
        self._controller.arm.emergency_stop(on)

    def silence(self, on: bool = True) -> None:
        """RTDE stops streaming; connections stay open."""
        self._controller.rtde.silent = on

    def unlock_delay(self, seconds: float) -> None:
        self._controller.arm.power.unlock_delay_s = float(seconds)

    def remote_control(self, on: bool) -> None:
        self._controller.dashboard.remote_control = on

    def polyscope(self, version: str) -> None:
        """The version to report, such as "5.23.0.0", from the next connections on. ValueError for another form."""
        numbers = version.split(".")
        if len(numbers) != 4 or not all(number.isdecimal() for number in numbers):
            raise ValueError(f"PolyScope version {version!r}; give four numbers such as 5.12.0.1101")
        major, minor, bugfix, build = map(int, numbers)
        self._controller.report_version((major, minor, bugfix, build))

    def store(self, name: str, script: str) -> None:
        """Puts a program on the controller's disk, as a text of URScript. ValueError unless name and text are texts."""
        if not (isinstance(name, str) and isinstance(script, str)):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise ValueError(f"program {name!r}: name and script must be texts")
        self._controller.dashboard.programs[name] = script

    def obstacle(self, point_m: Sequence[float], normal: Sequence[float]) -> None:
        """Where contact functions feel a surface, in the base frame. ValueError unless a point and a direction."""
        length = math.hypot(*normal)
        if len(point_m) != 3 or len(normal) != 3 or not (math.isfinite(math.fsum(point_m)) and 0 < length < math.inf):
            raise ValueError(f"obstacle at {point_m!r} m, normal {normal!r}: three finite numbers each, not all 0")
        x, y, z = (component / length for component in normal)
        self._controller.arm.dynamics.obstacle = Obstacle((point_m[0], point_m[1], point_m[2]), (x, y, z))

    def standing(self) -> bool:
        """Nothing moves, and nothing is about to."""
        return not self._controller.arm.moving

    def state(self) -> dict[str, str]:
        """The states by name, and why the last program ended."""
        power = self._controller.arm.power
        return {
            "robot_mode": power.robot_mode.name,
            "safety_mode": power.safety_mode.name,
            "freedrive": "ON" if self._controller.arm.freedrive else "OFF",
            "runtime_state": self._controller.runner.state.name,
            "last_error": self._controller.runner.last_error,
        }


def _dotted(version: tuple[int, ...]) -> str:
    return ".".join(map(str, version))
