"""Dashboard server on port 29999: one ASCII line in, one line out.

Programs are texts of URScript that were put on the controller by name (side channel, `robot.store`): they are loaded,
played, paused and stopped. What it does not imitate: installations, program trees, flight reports and support files,
pop-ups beyond their replies, what local control and user roles forbid, and `shutdown`, which is answered without
effect.
Source: Universal Robots, "Dashboard Server e-Series, port 29999" (commands and replies); where the manual leaves the
wording open, as ur_rtde 1.6.5 and Universal_Robots_Client_Library match it.
"""

import re
from collections.abc import Callable

from simulators.ur.motion import ArmController, MoveRefused
from simulators.ur.program import Program, ProgramRunner
from simulators.ur.script_program import ScriptRefused
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
UNNAMED = "<unnamed>"  # the program of a controller that has loaded none; a text from a script port has no name
FOLDER = "/programs/"
NO_MODE = "NONE"  # the operational mode is the pendant's affair


class Dashboard:
    """What the dashboard answers and does; shared by all connections."""

    def __init__(
        self, arm: ArmController, runner: ProgramRunner, compile_text: Callable[[str], Program], polyscope: str,
        serial_number: str, model: str,
    ) -> None:  # fmt: skip
        """`compile_text` raises ScriptRefused or MoveRefused for a text that the controller cannot run."""
        self._arm, self._runner, self._compile = arm, runner, compile_text
        self._serial_number, self._model = serial_number, model
        self.polyscope = polyscope
        self.programs: dict[str, str] = {}  # on the disk, by file name
        self._loaded = ""
        self._operational_mode, self._user_role = NO_MODE, "NONE"
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
        return f"URSoftware {self.polyscope} (Mar 01 2022)"

    def short_version(self, text: str) -> str:
        return self.polyscope

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
        return f"{names.get(self._runner.state, 'STOPPED')} {self._loaded or UNNAMED}"

    def loaded_program(self, text: str) -> str:
        return f"Loaded program: {FOLDER}{self._loaded}" if self._loaded else "No program loaded"

    def program_saved(self, text: str) -> str:
        return f"true {self._loaded}" if self._loaded else f"false {UNNAMED}"

    def operational_mode(self, text: str) -> str:
        return self._operational_mode

    def user_role(self, text: str) -> str:
        return self._user_role

    # --- verbs

    def load(self, text: str) -> str:
        """Ends the running program when there is such a file."""
        name = text.strip().removeprefix(FOLDER)
        if name not in self.programs:
            return f"File not found: {text.strip()}"
        try:
            self._compile(self.programs[name]).halt()
        except (ScriptRefused, MoveRefused) as refused:
            self._runner.fail(str(refused))
            return f"Error while loading program: {text.strip()}"
        self._runner.stop()
        self._loaded = name
        return f"Loading program: {FOLDER}{name}"

    def play(self, text: str) -> str:
        if self._runner.resume():
            return "Starting program"
        if not self._loaded or not self._arm.power.ready or self._runner.program is not None:
            return "Failed to execute: play"
        try:
            self._runner.start(self._compile(self.programs[self._loaded]), delay_s=0.0)  # answers when it runs
        except (ScriptRefused, MoveRefused) as refused:  # the text was replaced since it was loaded
            self._runner.fail(str(refused))
            return "Failed to execute: play"
        return "Starting program"

    def set_operational_mode(self, text: str) -> str:
        wanted = text.strip().upper()
        if wanted not in ("MANUAL", "AUTOMATIC"):
            return f"Failed setting operational mode: {text.strip()}"
        self._operational_mode = wanted
        return f"Setting operational mode: {wanted}"

    def clear_operational_mode(self, text: str) -> str:
        self._operational_mode = NO_MODE
        return "operational mode is no longer controlled by Dashboard Server"

    def set_user_role(self, text: str) -> str:
        wanted = text.strip().upper()
        if wanted not in ("PROGRAMMER", "OPERATOR", "NONE", "LOCKED", "RESTRICTED"):
            return f"Failed setting user role: {text.strip()}"
        self._user_role = wanted
        return f"Setting user role: {wanted}"

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
    _command("load (?P<text>.*)", Dashboard.load),
    _command("get loaded program", Dashboard.loaded_program),
    _command("isprogramsaved", Dashboard.program_saved),
    _command("popup (?P<text>.*)", _says("showing popup")),
    _command("close popup", _says("closing popup")),
    _command("addtolog (?P<text>.*)", _says("Added log message")),
    _command("setuserrole (?P<text>.*)", Dashboard.set_user_role),
    _command("getuserrole", Dashboard.user_role),
    _command("get operational mode", Dashboard.operational_mode),
    _command("set operational mode (?P<text>.*)", Dashboard.set_operational_mode),
    _command("clear operational mode", Dashboard.clear_operational_mode),
    _command("savelog", _says("Log saved to disk")),
    _command("generate flight report ?(?P<text>.*)", _says("Error: no flight report was recorded")),
    _command("generate support file ?(?P<text>.*)", _says("Error: no support file can be written to {text}")),
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
