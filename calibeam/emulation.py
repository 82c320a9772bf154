"""The emulators as a child process of their own, and their side channel."""

import json
import select
import socket
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

READY_S = 30.0  # importing the physics takes 1 s on a quiet machine
ANSWER_S = 5.0


class EmulationError(Exception):
    """The emulators did not start, ended, or refused; the message holds what they said."""


def ask_emulators(host: str, port: int, verb: str, arguments: Mapping[str, Any]) -> Any:
    """One verb of the emulators' side channel; its result. EmulationError when it refuses or does not answer."""
    try:
        with socket.create_connection((host, port), timeout=ANSWER_S) as line:
            line.sendall(json.dumps({"do": verb, "with": arguments}).encode() + b"\n")
            with line.makefile("r") as answers:
                answer = json.loads(answers.readline())
    except (OSError, ValueError) as error:
        raise EmulationError(f"the emulators do not answer on {host}:{port}: {error}") from error
    if not answer["ok"]:
        raise EmulationError(f"the emulators refused {verb}: {answer['error']}")
    return answer["result"]


@dataclass
class Emulation:
    """Runs `calibeam emulate` until closed. It ends by itself when this process dies, whatever the way."""

    rig: Path
    seed: int | None = None
    time_scale: float | None = None
    truth: Path | None = None
    links: bool = False
    address: Mapping[str, Any] = field(default_factory=dict[str, Any])
    _process: subprocess.Popen[str] | None = None

    def __enter__(self) -> Self:
        command = [sys.executable, "-m", "calibeam", "emulate", str(self.rig), "--json", "--end-with-stdin"]
        command += ["--robot-host", "auto"]
        command += [] if self.links else ["--no-links"]
        command += [] if self.seed is None else ["--seed", str(self.seed)]
        command += [] if self.time_scale is None else ["--time-scale", str(self.time_scale)]
        command += [] if self.truth is None else ["--truth", str(self.truth)]
        # A session of its own: Ctrl-C shall reach the program, which stops the arm, and not the arm's controller.
        self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and arguments
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        try:
            self.address = self._announcement(self._process)
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the emulators; safe in every state."""
        process, self._process = self._process, None
        if process is None:
            return
        process.terminate()
        try:
            process.communicate(timeout=ANSWER_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()

    def place_fixture(self, placement: int) -> None:
        """Move the emulated fixture, as a person would on site."""
        self.ask("fixture.place", id=placement)

    def ask(self, verb: str, **arguments: Any) -> Any:
        """One verb of the side channel; its result. EmulationError when it refuses or does not answer."""
        return ask_emulators(
            str(self.address["control"]["host"]), int(self.address["control"]["port"]), verb, arguments
        )

    def _announcement(self, process: subprocess.Popen[str]) -> Mapping[str, Any]:
        out = process.stdout
        ready = [] if out is None else select.select([out], [], [], READY_S)[0]
        line = out.readline() if out is not None and ready else ""
        if line:
            return json.loads(line)
        process.kill()
        _, said = process.communicate()
        last = said.strip().splitlines()[-1] if said.strip() else f"nothing within {READY_S:.0f} s"
        raise EmulationError(f"the emulators did not start: {last}")
