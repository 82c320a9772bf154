"""Every public method of ur_rtde and urx, called once: it works, with a value of the world, or is refused at once.

One emulator for all. The tables below are sessions: rows are called in order, by a process that reports a call which
does not return (call_clients.py). A law holds each table against the classes of the installed client, so that a
new version with other methods is noticed. What is refused says so in the words of the client or of the controller.
"""

import json
import math
import subprocess
import sys
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from simulators.ur.kinematics import NominalArm
from simulators.ur.poses import IDENTITY, frame_of, pose_of
from simulators.world.model import ARMATURE_KG_M2, build_mjcf
from simulators.world.rig import read_rig
from simulators.world.truth import draw_truth

CALLER = Path(__file__).with_name("call_clients.py")
CLIENTS = Path(__file__).parents[3] / ".venv-clients/bin/python"
HOME = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0]
ARRIVED_RAD, ARRIVED_M = 2e-5, 2e-5  # a move has ended within 1e-5 rad, and the encoders count in 1.2e-5 rad
TOOL = [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]
TOOL_KG, TOOL_COM_M = 0.4, [0.0, 0.02, 0.04]  # of the rig: stated to the controller from its start
G_M_S2 = 9.81
STEP_S = 0.002
ZEROS = [0.0] * 6
TOUCHES_M = 1e-3  # one cycle at 0.1 m/s is 0.2 mm; the true arm turns a little otherwise than the nominal one


@dataclass(frozen=True)
class Refused:
    """The call raises, and the message holds these words."""

    words: str


Check = Callable[[Any], bool]


@dataclass(frozen=True)
class Row:
    """One call; `gives` is a check, a value to compare with, or how it is refused."""

    on: str
    call: str
    args: tuple[Any, ...] = ()
    gives: Any = None
    again: bool = False
    until: str | None = None

    @property
    def step(self) -> dict[str, Any]:
        step = {"on": self.on, "call": self.call, "args": list(self.args), "again": self.again}
        return step if self.until is None else {**step, "until": self.until}

    def agrees(self, result: dict[str, Any]) -> bool:
        if isinstance(self.gives, Refused):
            return self.gives.words in result.get("error", "")
        if "value" not in result:
            return False
        value = result["value"]
        return bool(self.gives(value)) if callable(self.gives) else value == self.gives


def verb(verb_name: str, /, **arguments: Any) -> Row:
    """Something that a person does at the robot."""
    return Row("world", "do", (verb_name, arguments), gives=lambda answer: not str(answer).startswith("refused"))


def near(expected: Any, tolerance: float) -> Check:
    return lambda value: value == pytest.approx(expected, abs=tolerance)


def between(low: float, high: float) -> Check:
    """A number or all numbers of a list."""
    return lambda value: all(low <= number <= high for number in (value if isinstance(value, list) else [value]))


def holds(words: str) -> Check:
    return lambda value: words in value


def numbers(count: int) -> Check:
    return lambda value: len(value) == count and all(math.isfinite(number) for number in value)


# --- what the world is


@dataclass(frozen=True)
class Standing:
    """At HOME: the poses that the controller calculates, and what the true arm weighs and where it is."""

    pose: list[float]
    tool_pose: list[float]
    jacobian: list[float]
    mass_matrix_kg_m2: list[float]
    gravity_nm: list[float]
    true_z_m: float


def at_home() -> Standing:
    rig = tomllib.loads((CALLER.parents[3] / "rigs/ur5e-dual-psd.toml").read_text())
    arm = NominalArm.from_rig(rig)
    checked = read_rig(rig)
    truth = draw_truth(checked, checked.emulation.seed)
    model: Any = mujoco.MjModel.from_xml_string(build_mjcf(checked, truth))
    state: Any = mujoco.MjData(model)
    state.qpos[:] = np.add(HOME, truth.joint_zero_rad)
    mujoco.mj_forward(model, state)
    full = np.empty((6, 6))
    mujoco.mj_fullM(model, state, full)
    rotors = ARMATURE_KG_M2 * np.eye(6)  # get_mass_matrix() leaves them out
    return Standing(
        list(pose_of(arm.forward(HOME)[0])),
        list(pose_of(arm.tool(HOME, frame_of(TOOL)))),
        arm.jacobian(HOME, IDENTITY)[0].T.ravel().tolist(),
        (full - rotors).T.ravel().tolist(),
        state.qfrc_bias.tolist(),
        float(state.site("flange").xpos[2]),
    )


NOW = at_home()
# the joints stand within repeatability and a count of HOME: 5e-5 rad times 40 N m, and 3 kg m^2
STANDS_NM, STANDS_KG_M2 = 2e-3, 2e-4


def shifted(pose: Sequence[float], dz_m: float) -> list[float]:
    return [*pose[:2], pose[2] + dz_m, *pose[3:]]


# --- ur_rtde

RECEIVE = [
    Row("receive", "isConnected", gives=True),
    Row("receive", "getTimestamp", gives=lambda time_s: time_s > 0.0),
    Row("receive", "getTargetQ", gives=numbers(6)),
    Row("receive", "getTargetQd", gives=ZEROS),
    Row("receive", "getTargetQdd", gives=ZEROS),
    Row("receive", "getTargetCurrent", gives=between(-10.0, 10.0)),
    Row("receive", "getTargetMoment", gives=between(-60.0, 60.0)),
    Row("receive", "getActualQ", gives=numbers(6)),
    Row("receive", "getActualQd", gives=near(ZEROS, 1e-3)),
    Row("receive", "getActualCurrent", gives=between(-10.0, 10.0)),
    Row("receive", "getJointControlOutput", gives=between(-10.0, 10.0)),
    Row("receive", "getActualTCPPose", gives=numbers(6)),
    Row("receive", "getActualTCPSpeed", gives=near(ZEROS, 1e-3)),
    Row("receive", "getActualTCPForce", gives=near(ZEROS, 1e-9)),
    Row("receive", "getFtRawWrench", gives=lambda w: math.hypot(*w[:3]) == pytest.approx(TOOL_KG * G_M_S2, abs=1e-9)),
    Row("receive", "getTargetTCPPose", gives=numbers(6)),
    Row("receive", "getTargetTCPSpeed", gives=ZEROS),
    Row("receive", "getActualDigitalInputBits", gives=0),
    Row("receive", "getActualDigitalOutputBits", gives=0),
    Row("receive", "getDigitalInState", (0,), gives=False),
    Row("receive", "getDigitalOutState", (0,), gives=False),
    Row("receive", "getJointTemperatures", gives=between(15.0, 60.0)),
    Row("receive", "getActualExecutionTime", gives=between(1e-6, STEP_S)),
    Row("receive", "getRobotMode", gives=7),
    Row("receive", "getRobotStatus", gives=1),
    Row("receive", "getJointMode", gives=[253] * 6),
    Row("receive", "getSafetyMode", gives=1),
    Row("receive", "getSafetyStatusBits", gives=1),
    Row("receive", "getRuntimeState", gives=1),
    Row("receive", "isProtectiveStopped", gives=False),
    Row("receive", "isEmergencyStopped", gives=False),
    Row("receive", "getActualToolAccelerometer", gives=lambda a: math.hypot(*a) == pytest.approx(9.82, abs=1e-9)),
    Row("receive", "getSpeedScaling", gives=1.0),
    Row("receive", "getSpeedScalingCombined", gives=1.0),
    Row("receive", "getTargetSpeedFraction", gives=1.0),
    Row("receive", "getActualMomentum", gives=0.0),
    Row("receive", "getActualMainVoltage", gives=48.0),
    Row("receive", "getActualRobotVoltage", gives=48.0),
    Row("receive", "getActualRobotCurrent", gives=between(0.1, 10.0)),
    Row("receive", "getActualJointVoltage", gives=[48.0] * 6),
    Row("receive", "getStandardAnalogInput0", gives=0.0),
    Row("receive", "getStandardAnalogInput1", gives=0.0),
    Row("receive", "getStandardAnalogOutput0", gives=0.0),
    Row("receive", "getStandardAnalogOutput1", gives=0.0),
    Row("receive", "getPayload", gives=TOOL_KG),
    Row("receive", "getPayloadCog", gives=TOOL_COM_M),
    Row("receive", "getPayloadInertia", gives=ZEROS),
    Row("receive", "getOutputIntRegister", (12,), gives=0),
    Row("receive", "getOutputDoubleRegister", (12,), gives=0.0),
    Row("receive", "startFileRecording", ("/dev/null",), gives=True),
    Row("receive", "stopFileRecording", gives=True),
    Row("receive", "initPeriod", gives=lambda seconds: seconds >= 0.0),
    Row("receive", "waitPeriod", ({"period": True},)),
    Row("receive", "disconnect"),
    Row("receive", "reconnect", gives=True),
]

IO = [
    Row("io", "isConnected", gives=True),
    Row("io", "setStandardDigitalOut", (1, True), gives=True),
    Row("io", "setConfigurableDigitalOut", (2, True), gives=True),
    Row("io", "setToolDigitalOut", (0, True), gives=True),
    Row("receive", "getActualDigitalOutputBits", gives=1 << 1 | 1 << 10 | 1 << 16, again=True),
    Row("io", "setAnalogOutputVoltage", (0, 0.5), gives=True),
    Row("receive", "getStandardAnalogOutput0", gives=5.0, again=True),
    Row("io", "setAnalogOutputCurrent", (1, 0.5), gives=True),
    Row("receive", "getStandardAnalogOutput1", gives=near(0.012, 1e-12), again=True),
    Row("io", "setInputIntRegister", (18, 7), gives=True),
    Row("io", "setInputDoubleRegister", (18, 0.25), gives=True),
    Row("io", "setSpeedSlider", (0.5,), gives=True),
    Row("receive", "getTargetSpeedFraction", gives=0.5, again=True),
    Row("io", "setSpeedSlider", (1.0,), gives=True),
    Row("io", "disconnect"),
    Row("io", "reconnect", gives=True),
]

DASHBOARD = [
    Row("dashboard", "connect"),
    Row("dashboard", "isConnected", gives=True),
    Row("dashboard", "polyscopeVersion", gives="5.12.0.1101"),
    Row("dashboard", "getSerialNumber", gives="20195000001"),
    Row("dashboard", "getRobotModel", gives="UR5"),
    Row("dashboard", "isInRemoteControl", gives=True),
    Row("dashboard", "robotmode", gives="Robotmode: RUNNING"),
    Row("dashboard", "safetymode", gives="Safetymode: NORMAL"),
    Row("dashboard", "safetystatus", gives="Safetystatus: NORMAL"),
    Row("dashboard", "running", gives=False),
    Row("dashboard", "programState", gives="STOPPED <unnamed>"),
    Row("dashboard", "getLoadedProgram", gives="No program loaded"),
    Row("dashboard", "isProgramSaved", gives=False),
    Row("dashboard", "loadURP", ("nowhere.urp",), gives=Refused("File not found: nowhere.urp")),
    Row("dashboard", "play", gives=Refused("Failed to execute: play")),
    Row("dashboard", "pause", gives=Refused("Failed to execute: pause")),
    verb("robot.store", name="rest.urp", script="def rest():\n  movej([0, -1.5, 1.5, -1.5, -1.5, 0], a=6, v=2)\nend"),
    verb("robot.store", name="wait.urp", script="def wait():\n  sleep(60)\nend"),
    Row("dashboard", "loadURP", ("rest.urp",)),
    Row("dashboard", "getLoadedProgram", gives="Loaded program: /programs/rest.urp"),
    Row("dashboard", "play"),
    Row("dashboard", "programState", gives="STOPPED rest.urp", until="STOPPED"),
    Row("receive", "getActualQ", gives=near(HOME, ARRIVED_RAD), again=True),
    Row("dashboard", "loadURP", ("wait.urp",)),
    Row("dashboard", "play"),
    Row("dashboard", "programState", gives="PLAYING wait.urp", until="PLAYING"),
    Row("dashboard", "running", gives=True),
    Row("dashboard", "pause"),
    Row("dashboard", "programState", gives="PAUSED wait.urp"),
    Row("dashboard", "play"),
    Row("dashboard", "stop"),
    Row("dashboard", "popup", ("look",)),
    Row("dashboard", "closePopup"),
    Row("dashboard", "addToLog", ("a line",)),
    Row(
        "dashboard", "setUserRole", ("operator",), gives=Refused("incompatible function arguments")
    ),  # no enum in Python
    Row("dashboard", "closeSafetyPopup"),
    Row("dashboard", "restartSafety"),
    verb("robot.protective_stop"),
    Row("dashboard", "safetystatus", gives="Safetystatus: PROTECTIVE_STOP"),
    Row("dashboard", "play", gives=Refused("Failed to execute: play")),
    Row("dashboard", "unlockProtectiveStop"),
    Row("dashboard", "powerOff"),
    Row("dashboard", "robotmode", gives="Robotmode: POWER_OFF"),
    Row("dashboard", "play", gives=Refused("Failed to execute: play")),
    Row("dashboard", "powerOn"),
    Row("dashboard", "brakeRelease"),
    Row("dashboard", "robotmode", gives="Robotmode: RUNNING", until="RUNNING"),
    Row("dashboard", "send", ("get operational mode\n",)),
    Row("dashboard", "receive", gives="NONE"),
    Row("dashboard", "shutdown"),
    Row("dashboard", "quit"),
    Row("dashboard", "disconnect"),
]

AT_HOME = Row("control", "moveJ", (HOME, 2.0, 6.0), gives=True)
UNANSWERED = Refused("unable to get state data for specified key: output_double_register_6")  # before PolyScope 5.23

CONTROL = [
    AT_HOME,
    Row("control", "isConnected", gives=True),
    Row("control", "isProgramRunning", gives=True),
    Row("control", "getRobotStatus", gives=3),
    Row("receive", "getActualTCPPose", gives=near(NOW.pose, ARRIVED_M), again=True),
    Row("receive", "getTargetMoment", gives=near(NOW.gravity_nm, STANDS_NM)),
    Row("control", "getActualToolFlangePose", gives=near(NOW.pose, ARRIVED_M), again=True),
    Row("control", "getJointTorques", gives=near(ZEROS, 1e-6), again=True),
    Row("control", "setTcp", (TOOL,), gives=True),
    Row("control", "getTCPOffset", gives=near(TOOL, 1e-12)),
    Row("receive", "getActualTCPPose", gives=near(NOW.tool_pose, ARRIVED_M), again=True),
    Row("control", "getActualToolFlangePose", gives=near(NOW.pose, ARRIVED_M), again=True),
    Row("control", "getForwardKinematics", gives=near(NOW.tool_pose, ARRIVED_M)),
    Row("control", "getForwardKinematics", (HOME, TOOL), gives=near(NOW.tool_pose, 1e-9)),
    Row("control", "setTcp", (ZEROS,), gives=True),
    Row("control", "getInverseKinematics", (NOW.pose, HOME), gives=near(HOME, 1e-6)),
    Row("control", "getInverseKinematicsHasSolution", (NOW.pose, HOME), gives=True),
    Row("control", "getInverseKinematicsHasSolution", ([3.0, *ZEROS[1:]], HOME), gives=False),
    Row("control", "isPoseWithinSafetyLimits", (NOW.pose,), gives=True),
    Row("control", "isJointsWithinSafetyLimits", ([9.0, *HOME[1:]],), gives=False),
    Row(
        "control",
        "poseTrans",
        ([0.1, 0.2, 0.3, 0, 0, math.pi / 2], [0.1, 0, 0, 0, 0, 0]),
        gives=near([0.1, 0.3, 0.3, 0, 0, math.pi / 2], 1e-12),
    ),
    Row("control", "getTargetWaypoint", gives=near(NOW.pose, ARRIVED_M)),
    Row("control", "getStepTime", gives=STEP_S, again=True),
    Row("control", "getActualJointPositionsHistory", (5,), gives=near(HOME, ARRIVED_RAD), again=True),
    Row("control", "isSteady", gives=True, until="true"),
    # load and force sensor
    Row("control", "setPayload", (TOOL_KG + 1.0, TOOL_COM_M), gives=True),
    Row("receive", "getActualTCPForce", gives=lambda w: w[2] == pytest.approx(G_M_S2, abs=1e-6), again=True),
    Row("control", "zeroFtSensor", gives=True),
    Row("receive", "getActualTCPForce", gives=near(ZEROS, 1e-9), again=True),
    Row("control", "setTargetPayload", (TOOL_KG, TOOL_COM_M, ZEROS), gives=True),
    Row("control", "zeroFtSensor", gives=True),
    Row("control", "setGravity", ([0.0, 0.0, 9.82],), gives=True),
    Row("control", "enableExternalFtSensor", (False,), gives=True),
    Row("control", "ftRtdeInputEnable", (False,), gives=True),
    Row("control", "setExternalForceTorque", (ZEROS,), gives=True),
    # moves
    Row("control", "moveL", (shifted(NOW.pose, 0.02), 0.5, 2.0), gives=True),
    Row("control", "moveJ_IK", (NOW.pose, 2.0, 6.0), gives=True),
    Row("control", "moveL_FK", ([0.05, *HOME[1:]], 0.5, 2.0), gives=True),
    Row("control", "movePath", ({"path": [[0.02, *HOME[1:], 2.0, 6.0, 0.0], [*HOME, 2.0, 6.0, 0.0]]},), gives=True),
    Row("receive", "getActualQ", gives=near(HOME, ARRIVED_RAD), again=True),
    Row("control", "moveJ", ([1.0, *HOME[1:]], 0.5, 2.0, True), gives=True),
    Row("control", "getAsyncOperationProgress", gives=lambda progress: progress >= 0),
    Row("control", "getAsyncOperationProgressEx", gives=holds("AsyncOperationStatus")),
    Row("control", "stopJ", (6.0,)),
    Row("control", "moveL", (shifted(NOW.pose, 0.2), 0.1, 2.0, True), gives=True),
    Row("control", "stopL", (6.0,)),
    Row("control", "speedJ", ([0.1, *ZEROS[1:]], 2.0, 0.1), gives=True),
    Row("control", "speedStop", (6.0,), gives=True),
    Row("control", "speedL", ([0.0, 0.0, 0.02, 0.0, 0.0, 0.0], 2.0, 0.1), gives=True),
    Row("control", "speedStop", (6.0,), gives=True),
    Row("control", "jogStart", ([0.0, 0.0, 0.02, 0.0, 0.0, 0.0], 0, 0.5, ZEROS), gives=True),
    Row("control", "jogStop", gives=True),
    AT_HOME,
    Row("control", "servoJ", (HOME, 0.0, 0.0, 0.002, 0.1, 300.0), gives=True),
    Row("control", "servoL", (NOW.pose, 0.0, 0.0, 0.002, 0.1, 300.0), gives=True),
    Row("control", "servoStop", gives=True),
    Row("control", "initPeriod", gives=lambda seconds: seconds >= 0.0),
    Row("control", "waitPeriod", ({"period": True},)),
    # contact: a surface 30 mm below the tool
    verb("robot.obstacle", point_m=[0.0, 0.0, NOW.true_z_m - 0.03], normal=[0.0, 0.0, 1.0]),
    Row("control", "toolContact", (ZEROS,), gives=0, again=True),
    Row("control", "moveUntilContact", ([0.0, 0.0, -0.1, 0.0, 0.0, 0.0], ZEROS, 1.2), gives=True),
    Row("receive", "getActualTCPPose", gives=near(shifted(NOW.pose, -0.03), TOUCHES_M), again=True),
    Row("control", "moveL", (NOW.pose, 0.2, 2.0), gives=True),
    Row("control", "startContactDetection", (ZEROS,), gives=True),
    Row("control", "moveL", (shifted(NOW.pose, -0.1), 0.1, 2.0, True), gives=True),
    Row("control", "readContactDetection", gives=True, until="true"),
    Row("control", "stopContactDetection", gives=True),
    Row("control", "isSteady", gives=True, until="true"),
    Row("receive", "getActualTCPPose", gives=near(shifted(NOW.pose, -0.03), TOUCHES_M), again=True),
    AT_HOME,
    # accepted, without effect on the emulated arm
    Row("control", "forceMode", (ZEROS, [0, 0, 1, 0, 0, 0], ZEROS, 2, [0.1] * 6), gives=True),
    Row("control", "forceModeStop", gives=True),
    Row("control", "forceModeSetDamping", (0.5,), gives=True),
    Row("control", "forceModeSetGainScaling", (0.5,), gives=True),
    Row("control", "freedriveMode", gives=True),
    Row("control", "getFreedriveStatus", gives=0),
    Row("control", "endFreedriveMode", gives=True),
    Row("control", "teachMode", gives=True),
    Row("control", "endTeachMode", gives=True),
    Row("control", "directTorque", (ZEROS,), gives=True),
    # the script for PolyScope 5.12 does not hold these; the client finds no answer, or the registers as they were
    Row("control", "getMassMatrix", gives=UNANSWERED),
    Row("control", "getJacobian", gives=UNANSWERED),
    Row("control", "getJacobianTimeDerivative", gives=UNANSWERED),
    Row("control", "getCoriolisAndCentrifugalTorques", gives=numbers(6)),
    Row("control", "getTargetJointAccelerations", gives=numbers(6)),
    # programs
    Row("control", "sendCustomScriptFunction", ("light", "set_standard_digital_out(3, True)"), gives=True),
    Row("receive", "getDigitalOutState", (3,), gives=True, again=True),
    Row(
        "control",
        "sendCustomScript",
        (
            "def dark():\n  write_output_integer_register(0, 1)\n  set_standard_digital_out(3, False)\n"
            "  write_output_integer_register(0, 2)\nend\n",
        ),
        gives=True,
    ),
    Row("receive", "getDigitalOutState", (3,), gives=False, again=True),
    Row("control", "sendCustomScriptFile", ("@custom.script",), gives=True),
    Row("receive", "getDigitalOutState", (4,), gives=True, again=True),
    Row("control", "reuploadScript", gives=True),
    Row("control", "isProgramRunning", gives=True, until="true"),
    Row("control", "setCustomScriptFile", ("",)),
    Row("control", "isProgramRunning", gives=True, until="true"),
    Row("control", "setWatchdog", (0.2,), gives=True),
    Row("control", "kickWatchdog", gives=True),
    Row("control", "triggerProtectiveStop", gives=lambda value: value in (True, False)),  # done, or ended by the stop
    Row("control", "moveJ", (HOME, 2.0, 6.0), gives=False),
    verb("robot.unlock"),
    Row("control", "reuploadScript", gives=True),
    Row("control", "isProgramRunning", gives=True, until="true"),
    AT_HOME,
    Row("control", "stopScript"),
    Row("control", "isProgramRunning", gives=False),
    Row("control", "reuploadScript", gives=True),
    Row("control", "isProgramRunning", gives=True, until="true"),
    Row("control", "servoC", (NOW.pose, 0.1, 0.5, 0.0), gives=True),  # after it this client waits for ever: see docs
    Row("control", "disconnect"),
]

# From PolyScope 5.23 on the script holds the dynamics, and the client asks for all its registers.
LATER = [
    verb("robot.polyscope", version="5.23.0.0"),
    Row("control", "(new)", gives="made"),
    AT_HOME,
    Row("control", "getMassMatrix", gives=near(NOW.mass_matrix_kg_m2, STANDS_KG_M2), again=True),
    Row("control", "getJacobian", gives=near(NOW.jacobian, 1e-4), again=True),
    Row("control", "getJacobianTimeDerivative", gives=near([0.0] * 36, 1e-3), again=True),
    Row("control", "getCoriolisAndCentrifugalTorques", gives=near(ZEROS, 1e-6), again=True),
    Row("control", "getTargetJointAccelerations", gives=near(ZEROS, 1e-9), again=True),
    Row("control", "disconnect"),
    Row("control", "reconnect", gives=True),
    AT_HOME,
    Row("control", "stopScript"),
    Row("control", "disconnect"),
    verb("robot.polyscope", version="5.12.0.1101"),
]

SCRIPT = [
    Row("script", "connect"),
    Row("script", "isConnected", gives=True),
    Row("script", "getScript", gives=holds("RTDE Control script")),
    Row("script", "sendScriptCommand", ("set_standard_digital_out(5, True)\n",), gives=True),
    Row("receive", "getDigitalOutState", (5,), gives=True, again=True),
    Row("script", "sendScript", gives=True),  # without the register offsets that only RTDEControlInterface fills in
    Row("world", "do", ("robot.state", {}), gives=lambda state: "offsets" in state["last_error"], until="offsets"),
    Row("script", "disconnect"),
]
UR_RTDE = [*RECEIVE, *IO, *DASHBOARD, *CONTROL, *LATER, *SCRIPT]

# Names that are no calls, or none that reaches the controller.
NOT_CALLED = {
    "control": {"FLAGS_DEFAULT", "Feature", "Flags", "FEATURE_BASE", "FEATURE_CUSTOM", "FEATURE_TOOL"}
    | {f"FLAG_{name}" for name in ("CUSTOM_SCRIPT", "DISABLE_REMOTE_CONTROL_CHECK", "NO_EXT_FT", "NO_WAIT")}
    | {f"FLAG_{name}" for name in ("UPLOAD_SCRIPT", "UPPER_RANGE_REGISTERS", "USE_EXT_UR_CAP", "VERBOSE")},
    "script": {"setScriptFile"},  # bound without its argument: ur_rtde 1.6.5 crashes
    "secondary": {"run"},  # the loops of their threads
    "realtime": {"run", "rtstruct540", "rtstruct692"},
}

# --- urx 0.11.0 knows robot modes of 38 and 46 bytes; an e-Series controller sends 47, so that it never calls the robot
# running and no move waits for its end.
STOPPED = Refused("Robot stopped")
AHEAD = [0.1, *HOME[1:]]

SECONDARY = [
    Row("secondary", "wait"),
    Row("secondary", "get_all_data", gives=lambda data: {"RobotModeData", "JointData", "CartesianInfo"} <= data.keys()),
    Row("secondary", "get_cartesian_info", (True,), gives=lambda data: math.isfinite(data["X"])),
    Row(
        "secondary", "get_joint_data", (True,), gives=lambda data: data["V_actual0"] == 48.0 and data["T_motor0"] > 15.0
    ),
    Row("secondary", "get_digital_out", (0,), gives=0),
    Row("secondary", "get_digital_out_bits", gives=0),
    Row("secondary", "get_digital_in", (0,), gives=0),
    Row("secondary", "get_digital_in_bits", gives=0),
    Row("secondary", "get_analog_in", (0,), gives=near(0.0, 1e-9)),
    Row("secondary", "get_analog_inputs", gives=near([0.0, 0.0], 1e-9)),
    Row("secondary", "is_program_running", gives=False),
    Row("secondary", "send_program", (f"movej({HOME}, a=6, v=2)",)),
]
REALTIME = [
    Row("realtime", "wait"),
    Row("realtime", "q_actual", (True,), gives=near(HOME, ARRIVED_RAD), until="-1.5"),
    Row("realtime", "getActual", (True,), gives=numbers(6)),
    Row("realtime", "q_target", (True,), gives=numbers(6)),
    Row("realtime", "getTarget", (True,), gives=numbers(6)),
    Row("realtime", "tcf_pose", (True,), gives=near(NOW.pose, 0.1)),
    Row("realtime", "getTCF", (True,), gives=numbers(6)),
    Row("realtime", "tcf_force", (True,), gives=near(ZEROS, 1e-9)),
    Row("realtime", "getTCFForce", (True,), gives=near(ZEROS, 1e-9)),
    Row("realtime", "get_all_data", gives=lambda data: data["ctrltimestamp"] > 0.0),
    Row("realtime", "start_buffering"),
    Row("realtime", "pop_buffer", gives=lambda item: len(item) == 4),
    Row("realtime", "try_pop_buffer", gives=lambda item: item is None or len(item) == 4),
    Row("realtime", "get_buffer", gives=lambda items: isinstance(items, list)),
    Row("realtime", "stop_buffering"),
    Row("realtime", "set_csys", ({"transform": ZEROS},)),
]
ROBOT = [
    Row("robot", "is_running", gives=False),
    Row("robot", "is_program_running", gives=lambda value: value in (True, False)),
    Row("robot", "getj", (True,), gives=near(HOME, 0.5)),
    Row("robot", "getl", (True,), gives=numbers(6)),
    Row("robot", "get_pose", gives=lambda value: value is not None),
    Row("robot", "get_pos", gives=numbers(3)),
    Row("robot", "get_orientation", gives=lambda value: value is not None),
    Row("robot", "get_tcp_force", gives=near(ZEROS, 1e-9)),
    Row("robot", "get_force", gives=near(0.0, 1e-9)),
    Row("robot", "get_realtime_monitor", gives=holds("URRTMonitor")),
    Row("robot", "get_analog_in", (0,), gives=near(0.0, 1e-9)),
    Row("robot", "get_analog_inputs", gives=near([0.0, 0.0], 1e-9)),
    Row("robot", "get_digital_in", (0,), gives=0),
    Row("robot", "get_digital_in_bits", gives=0),
    Row("robot", "get_digital_out", (0,), gives=0),
    Row("robot", "get_digital_out_bits", gives=0),
    *(Row("robot", name, gives=numbers_or_zero) for name in ("x", "y", "z") for numbers_or_zero in [math.isfinite]),
    *(Row("robot", name, gives=0) for name in ("rx", "ry", "rz", "x_t", "y_t", "z_t", "rx_t", "ry_t", "rz_t")),
    Row("robot", "send_program", ("set_standard_digital_out(2, True)",)),
    Row("robot", "send_message", ("hello",)),
    Row("robot", "set_tcp", (ZEROS,)),
    Row("robot", "set_payload", (TOOL_KG,)),
    Row("robot", "set_gravity", ([0.0, 0.0, 9.82],)),
    Row("robot", "set_digital_out", (3, True)),
    Row("robot", "set_analog_out", (0, 0.5)),
    Row("robot", "set_tool_voltage", (12,)),
    Row("robot", "set_simulation", (False,)),
    Row("robot", "set_freedrive", (False,)),
    Row("robot", "set_csys", ({"transform": ZEROS},)),
    Row("robot", "movej", (AHEAD, 6.0, 2.0, False)),
    Row("robot", "movej", (HOME, 6.0, 2.0), gives=STOPPED),
    *(Row("robot", name, (NOW.pose, 2.0, 0.5, False)) for name in ("movel", "movep", "servoc")),
    *(Row("robot", name, ([0.0, 0.0, 0.001, 0.0, 0.0, 0.0], 2.0, 0.5, False)) for name in ("movel_tool",)),
    Row("robot", "movec", (NOW.pose, NOW.pose, 2.0, 0.5, False)),
    Row("robot", "movels", ([NOW.pose, NOW.pose], 2.0, 0.5, 0.01, False)),
    Row("robot", "movex", ("movel", NOW.pose, 2.0, 0.5, False)),
    Row("robot", "movex_tool", ("movel", [0.0, 0.0, 0.001, 0.0, 0.0, 0.0], 2.0, 0.5, False)),
    Row("robot", "movexs", ("movel", [NOW.pose, NOW.pose], 2.0, 0.5, 0.01, False)),
    Row("robot", "set_pose", ({"transform": NOW.pose}, 2.0, 0.5, False)),
    Row("robot", "set_pos", (NOW.pose[:3], 2.0, 0.5, False)),
    Row("robot", "set_orientation", (NOW.pose[3:], 2.0, 0.5, False)),
    Row("robot", "add_pose_base", ({"transform": ZEROS}, 2.0, 0.5, False)),
    Row("robot", "add_pose_tool", ({"transform": ZEROS}, 2.0, 0.5, False)),
    Row("robot", "translate", ([0.0, 0.0, 0.001], 2.0, 0.5, False)),
    Row("robot", "translate_tool", ([0.0, 0.0, 0.001], 2.0, 0.5, False)),
    *(Row("robot", name, (0.001, 2.0, 0.5), gives=STOPPED) for name in ("up", "down", "back")),
    Row("robot", "speedj", ([0.01, *ZEROS[1:]], 2.0, 0.01)),
    Row("robot", "speedl", ([0.01, *ZEROS[1:]], 2.0, 0.01)),
    Row("robot", "speedl_tool", ([0.01, *ZEROS[1:]], 2.0, 0.01)),
    Row("robot", "speedx", ("speedj", [0.01, *ZEROS[1:]], 2.0, 0.01)),
    *(Row("robot", name) for name in ("stopj", "stopl", "stop")),
    Row("robot", "new_csys_from_xpy", gives=Refused("EOFError")),  # asks the operator
    Row("realtime", "stop"),
    Row("realtime", "close"),
    Row("secondary", "close"),
    Row("robot", "close"),
]
URX = [*SECONDARY, *REALTIME, *ROBOT]

TABLES = {"ur_rtde": (UR_RTDE, Path(sys.executable)), "urx": (URX, CLIENTS)}


@dataclass(frozen=True)
class Session:
    """What the client's process reported."""

    results: list[dict[str, Any]]
    members: dict[str, list[str]]


@pytest.fixture(scope="module", params=TABLES)
def family(request: pytest.FixtureRequest) -> str:
    if not TABLES[request.param][1].exists():
        pytest.skip("no environment for third-party clients: make clients")
    return request.param


@pytest.fixture(scope="module")
def session(family: str, fresh_emulated, tmp_path_factory: pytest.TempPathFactory) -> Session:
    """The whole table of a client, called once."""
    table, python = TABLES[family]
    folder = tmp_path_factory.mktemp(family)
    (folder / "custom.script").write_text(
        "def lit():\n  write_output_integer_register(0, 1)\n  set_standard_digital_out(4, True)\n"
        "  write_output_integer_register(0, 2)\nend\n"
    )
    steps = json.dumps([row.step for row in table]).replace("@custom", str(folder / "custom"))
    command = [str(python), "-W", "ignore", str(CALLER), family, fresh_emulated.host, str(fresh_emulated.control[1])]
    done = subprocess.run(command, input=steps, capture_output=True, text=True, timeout=300.0, check=False)
    members, *results = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    assert done.returncode == 0, f"crashed in {table[len(results)]}: {done.stderr[-2000:]}"
    return Session(results, members)


def test_every_call_works_or_is_refused_at_once(family: str, session: Session) -> None:
    table = TABLES[family][0]
    wrong = [
        f"{row.on}.{row.call}{row.args}: {result}"
        for row, result in zip(table, session.results, strict=False)
        if not row.agrees(result)
    ]
    assert not wrong, "\n".join(wrong)
    assert len(session.results) == len(table)  # a call that hangs ends the session


def test_the_table_holds_every_public_method(family: str, session: Session) -> None:
    called: dict[str, set[str]] = {}
    for row in TABLES[family][0]:
        called.setdefault(row.on, set()).add(row.call)
    missing = {
        name: set(members) - called[name] - NOT_CALLED.get(name, set()) for name, members in session.members.items()
    }
    assert missing == {name: set() for name in session.members}
