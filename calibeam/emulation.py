"""The emulators as a child process of their own, and their side channel."""

import sys
from ipaddress import ip_address
from pathlib import Path

from acquisition.recording.rig.devices import RobotDevice
from simulators.process import EmulatorProcess, EmulatorsError, ask_emulators

__all__ = ["Emulation", "EmulationError", "ask_emulators", "moves_nothing_real"]

EmulationError = EmulatorsError
TERMINALS = "/dev/pts"  # where pseudo-terminals are


class Emulation(EmulatorProcess):
    """Runs `calibeam emulate` until closed. It ends by itself when this process dies, whatever the way."""

    def __init__(
        self,
        rig: Path,
        seed: int | None = None,
        time_scale: float | None = None,
        truth: Path | None = None,
        links: bool = False,
    ) -> None:
        self.time_scale = time_scale
        command = [sys.executable, "-m", "calibeam", "emulate", str(rig), "--json", "--end-with-stdin"]
        command += ["--robot-host", "auto"]
        command += [] if links else ["--no-links"]
        command += [] if seed is None else ["--seed", str(seed)]
        command += [] if time_scale is None else ["--time-scale", str(time_scale)]
        command += [] if truth is None else ["--truth", str(truth)]
        super().__init__(command)

    def place_fixture(self, placement: int) -> None:
        """Move the emulated fixture, as a person would on site."""
        self.ask("fixture.place", id=placement)


def moves_nothing_real(robot: RobotDevice) -> bool:
    """Whether the controller can only be an emulator: on loopback, or behind a pseudo-terminal."""
    if robot.host is None:
        return robot.serial_port is not None and Path(robot.serial_port).resolve().is_relative_to(TERMINALS)
    try:
        return robot.host == "localhost" or ip_address(robot.host).is_loopback
    except ValueError:
        return False
