"""The emulators as a child process, for programs and tests of any project.

with Emulators(tomllib.loads(text)) as emulators:
emulators.address["psd"]["port"]                      # where each device is: docs/protocols/side-channel.md
emulators.inject("psd", "checksum", count=3)          # and what goes wrong there
"""

import json
import select
import socket
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import IO, Any, Self

READY_S = 30.0  # importing the physics takes 1 s on a quiet machine
ANSWER_S = 5.0
SAID_LINES = 50  # of standard error that are remembered


class EmulatorsError(Exception):
    """The emulators did not start, ended, or refused; the message holds what they reported."""


def ask_emulators(host: str, port: int, verb: str, arguments: Mapping[str, Any], token: str | None = None) -> Any:
    """One verb of the emulators' side channel; its result. EmulatorsError when it refuses or does not answer."""
    request = {"do": verb, "with": arguments, **({} if token is None else {"token": token})}
    try:
        with socket.create_connection((host, port), timeout=ANSWER_S) as line:
            line.sendall(json.dumps(request).encode() + b"\n")
            with line.makefile("r") as answers:
                answer = json.loads(answers.readline())
    except (OSError, ValueError) as error:
        raise EmulatorsError(f"the emulators do not answer on {host}:{port}: {error}") from error
    if not answer["ok"]:
        raise EmulatorsError(f"the emulators refused {verb}: {answer['error']}")
    return answer["result"]


class EmulatorProcess:
    """Any command that announces emulators as one line of JSON and ends when its standard input does."""

    def __init__(self, command: Sequence[str], first_line: str = "") -> None:
        self.address: Mapping[str, Any] = {}
        self._command, self._first_line = list(command), first_line
        self._process: subprocess.Popen[str] | None = None
        self._said: deque[str] = deque(maxlen=SAID_LINES)
        self._listener: threading.Thread | None = None

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def start(self) -> None:
        """Returns when every port is open. EmulatorsError with the child's last words when it does not come so far."""
        # A session of its own: Ctrl-C shall reach the program, which stops the arm, and not the arm's controller.
        process = subprocess.Popen(  # noqa: S603 - our own interpreter and arguments
            self._command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self._process = process
        # Read while it runs: a pipe that nobody reads fills, and then the emulators would wait for its reader.
        self._listener = threading.Thread(target=self._listen, args=(process.stderr,), name="emulators", daemon=True)
        self._listener.start()
        try:
            self.address = self._announcement(process)
        except BaseException:
            self.close()
            raise

    @property
    def said(self) -> str:
        """The last lines of its standard error, for example faults of clients on the wire."""
        return "\n".join(self._said)

    @property
    def alive(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def ask(self, verb: str, **arguments: Any) -> Any:
        """One verb of the side channel; its result. EmulatorsError when it refuses, or has ended (with last words)."""
        control = self.address["control"]
        try:
            return ask_emulators(control["host"], control["port"], verb, arguments, control.get("token"))
        except EmulatorsError as error:
            if self.alive:
                raise
            raise EmulatorsError(f"the emulators have ended: {self._last_words()}") from error

    def inject(
        self,
        device: str,
        kind: str,
        *,
        count: int | None = None,
        every: int = 1,
        port: str | None = None,
        **settings: float,
    ) -> None:
        """Makes trouble at "psd", "can" or "robot"; after `count` strikes it clears itself (None: never)."""
        self.ask("fault.inject", device=device, kind=kind, count=count, every=every, port=port, **settings)

    def clear(self, device: str | None = None) -> None:
        """Ends all trouble, or that of one device."""
        self.ask("fault.clear", device=device)

    def close(self) -> None:
        """End the emulators; safe in every state."""
        process, self._process = self._process, None
        if process is None:
            return
        process.terminate()
        try:
            process.wait(ANSWER_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if self._listener is not None:
            self._listener.join(ANSWER_S)
        for stream in (process.stdin, process.stdout, process.stderr):
            if stream is not None:
                stream.close()

    def _listen(self, stream: IO[str]) -> None:
        for line in stream:
            self._said.append(line.rstrip("\n"))

    def _announcement(self, process: subprocess.Popen[str]) -> Mapping[str, Any]:
        if process.stdin is not None and self._first_line:
            process.stdin.write(self._first_line + "\n")
            process.stdin.flush()
        out = process.stdout
        ready = [] if out is None else select.select([out], [], [], READY_S)[0]
        line = out.readline() if out is not None and ready else ""
        if line:
            return json.loads(line)
        process.kill()
        process.wait()
        if self._listener is not None:
            self._listener.join(ANSWER_S)
        raise EmulatorsError(f"the emulators did not start: {self._last_words()}")

    def _last_words(self) -> str:
        return next((line for line in reversed(self._said) if line.strip()), f"nothing within {READY_S:.0f} s")


class Emulators(EmulatorProcess):
    """The devices of a rig, as `tomllib` reads it (plain SI numbers); no rig file and no command line is needed."""

    def __init__(self, rig: Mapping[str, Any], **options: Any) -> None:
        """`options`: those of simulators.serve.ServeOptions, for example time_scale=4.0, links=False."""
        chosen = {"robot_host": "auto", "end_with_stdin": True, **options}
        super().__init__([sys.executable, "-m", "simulators"], json.dumps({"rig": rig, "options": chosen}))
