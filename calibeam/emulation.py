"""The emulators as a child process of their own, and their side channel."""

import sys
from pathlib import Path

from simulators.process import EmulatorProcess, EmulatorsError, ask_emulators

__all__ = ["Emulation", "EmulationError", "ask_emulators"]

EmulationError = EmulatorsError


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
