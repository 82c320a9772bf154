"""Dashboard server on port 29999: one ASCII line in, one line out.

What it does not imitate: stored programs (there are none to load), installations, user roles, operational modes,
pop-ups beyond their replies, and `shutdown`, which is answered without effect.
Source: Universal Robots, "Dashboard Server e-Series"; replies as ur_rtde 1.6.5 and others match them.
"""

import re
from collections.abc import Callable

from simulators.ur.motion import ArmController
from simulators.ur.program import ProgramRunner
from simulators.ur.states import RobotMode, RuntimeState, SafetyMode

BANNER = b"Connected: Universal Robots Dashboard Server\n"
MAX_LINE_BYTES = 4096
SAFETY_NAMES = {
    SafetyMode.NORMAL: "NORMAL",
    SafetyMode.REDUCED: "REDUCED",
    SafetyMode.PROTECTIVE_STOP: "PROTECTIVE_STOP",
    SafetyMode.ROBOT_EMERGENCY_STOP: "ROBOT_EMERGENCY_STOP",
}
MODE_NAMES = {mode: mode.name for mode in RobotMode}
PROGRAM = "rtde_control.urp"  # the name under which an uploaded program shows


class Dashboard:
    """What the dashboard says and does; shared by all connections."""

    def __init__(
        self, arm: ArmController, runner: ProgramRunner, polyscope: str, serial_number: str, model: str
    ) -> None:
        self._arm, self._runner = arm, runner
        self._polyscope, self._serial_number, self._model = polyscope, serial_number, model
        self.remote_control = True

    def accept(self) -> "DashboardWire":
        return DashboardWire(self.answer)

    def answer(self, line: str) -> str:
        """The reply to one command, matched without regard to case."""
        for pattern, verb in _COMMANDS:
            match = pattern.fullmatch(line.strip())
            if match is not None:
                return verb(self, match.groupdict().get("text") or "")
        return f"could not understand: '{line.strip()}'"

    # --- questions

    def version(self, text: str) -> str:
        return f"URSoftware {self._polyscope} (Mar 01 2022)"

    def short_version(self, text: str) -> str:
        return self._polyscope

    def serial_number(self, text: str) -> str:
        return self._serial_number

    def model(self, text: str) -> str:
        return self._model

    def in_remote_control(self, text: str) -> str:
        return "true" if self.remote_control else "false"

    def robot_mode(self, text: str) -> str:
        return f"Robotmode: {MODE_NAMES[self._arm.power.robot_mode]}"

    def safety_mode(self, text: str) -> str:
        return f"Safetymode: {SAFETY_NAMES[self._arm.power.safety_mode]}"

    def safety_status(self, text: str) -> str:
        return f"Safetystatus: {SAFETY_NAMES[self._arm.power.safety_mode]}"

    def running(self, text: str) -> str:
        return f"Program running: {'true' if self._runner.state is RuntimeState.PLAYING else 'false'}"

    def program_state(self, text: str) -> str:
        names = {RuntimeState.PLAYING: "PLAYING", RuntimeState.PAUSED: "PAUSED"}
        return f"{names.get(self._runner.state, 'STOPPED')} {PROGRAM}"

    # --- verbs

    def play(self, text: str) -> str:
        return "Starting program" if self._runner.resume() else "Failed to execute: play"

    def pause(self, text: str) -> str:
        return "Pausing program" if self._runner.pause() else "Failed to execute: pause"

    def stop(self, text: str) -> str:
        self._runner.stop()
        self._arm.stop()
        return "Stopped"

    def power_on(self, text: str) -> str:
        return "Powering on" if self._arm.power.power_on() else "Failed to execute: power on"

    def power_off(self, text: str) -> str:
        self._runner.stop()
        self._arm.stop()
        self._arm.power.power_off()
        return "Powering off"

    def brake_release(self, text: str) -> str:
        return "Brake releasing" if self._arm.power.brake_release() else "Failed to execute: brake release"

    def unlock(self, text: str) -> str:
        if self._arm.unlock():
            return "Protective stop releasing"
        return "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop before unlocking"  # noqa: E501


def _says(reply: str) -> Callable[[Dashboard, str], str]:
    return lambda dashboard, text: reply.format(text=text)


def _command(
    pattern: str, verb: Callable[[Dashboard, str], str]
) -> tuple[re.Pattern[str], Callable[[Dashboard, str], str]]:
    return re.compile(pattern, re.IGNORECASE), verb


_COMMANDS = (
    _command("polyscopeversion", Dashboard.version),
    _command("version", Dashboard.short_version),
    _command("get serial number", Dashboard.serial_number),
    _command("get robot model", Dashboard.model),
    _command("is in remote control", Dashboard.in_remote_control),
    _command("robotmode", Dashboard.robot_mode),
    _command("safetymode", Dashboard.safety_mode),
    _command("safetystatus", Dashboard.safety_status),
    _command("running", Dashboard.running),
    _command("programstate", Dashboard.program_state),
    _command("play", Dashboard.play),
    _command("pause", Dashboard.pause),
    _command("stop", Dashboard.stop),
    _command("power on", Dashboard.power_on),
    _command("power off", Dashboard.power_off),
    _command("brake release", Dashboard.brake_release),
    _command("unlock protective stop", Dashboard.unlock),
    _command("close safety popup", _says("closing safety popup")),
    _command("restart safety", _says("Restarting safety")),
    _command("load installation (?P<text>.*)", _says("File not found: {text}")),
    _command("load (?P<text>.*)", _says("File not found: {text}")),
    _command("get loaded program", _says("No program loaded")),
    _command("isprogramsaved", _says("false <unnamed>")),
    _command("popup (?P<text>.*)", _says("showing popup")),
    _command("close popup", _says("closing popup")),
    _command("addtolog (?P<text>.*)", _says("Added log message")),
    _command("setuserrole (?P<text>.*)", _says("Setting user role: {text}")),
    _command("get operational mode", _says("NONE")),
    _command("set operational mode (?P<text>.*)", _says("Setting operational mode: {text}")),
    _command("clear operational mode", _says("operational mode is no longer controlled by Dashboard Server")),
    _command("quit", _says("Disconnected")),
    _command("shutdown", _says("Shutting down")),
)


class DashboardWire:
    """One client's connection; the first thing it gets is the banner."""

    def __init__(self, answer: Callable[[str], str]) -> None:
        self._answer = answer
        self._line = b""
        self._greeted = False
        self.closing = False

    def handle(self, data: bytes) -> bytes:
        *lines, self._line = (self._line + data).split(b"\n")
        self._line = self._line[-MAX_LINE_BYTES:]
        self.closing = self.closing or any(line.strip().lower() == b"quit" for line in lines)
        replies = [self._answer(line.decode("ascii", errors="replace")) for line in lines]
        return self.due() + "".join(f"{reply}\n" for reply in replies).encode()

    def due(self) -> bytes:
        greeting = b"" if self._greeted else BANNER
        self._greeted = True
        return greeting

    def refusal(self, request: bytes) -> bytes | None:
        """For injected faults: the reply to a command that it does not know."""
        words = request.decode("ascii", errors="replace").strip()
        return self.due() + f"could not understand: '{words}'\n".encode() if request.endswith(b"\n") else None
