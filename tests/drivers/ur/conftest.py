"""An emulated controller in another process, and a server that says what a test tells it to."""

import json
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

RIG_PATH = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"
SERVE = """
import json, sys, tomllib
from simulators.serve import ServeOptions, serve
rig = tomllib.loads(open(sys.argv[1]).read())
rig["devices"] = {"robot": rig["devices"]["robot"]}
options = ServeOptions(robot_host="auto", time_scale=float(sys.argv[2]), links=False, end_with_stdin=True)
serve(rig, options, lambda where: print(json.dumps(where), flush=True))
"""


@dataclass(frozen=True)
class Emulated:
    """Where the controller listens, and its side channel."""

    host: str
    control: tuple[str, int]

    def do(self, verb: str, **arguments: object) -> object:
        with socket.create_connection(self.control, 5.0) as line:
            line.sendall(json.dumps({"do": verb, "with": arguments}).encode() + b"\n")
            answer = json.loads(line.makefile().readline())
        assert answer["ok"], answer
        return answer["result"]


@pytest.fixture(scope="session")
def emulated_process() -> Iterator[Emulated]:
    """Real world and wires at four times real time."""
    command = [sys.executable, "-c", SERVE, str(RIG_PATH), "4"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        where = json.loads(process.stdout.readline())
        yield Emulated(where["robot"]["host"], (where["control"]["host"], where["control"]["port"]))
        process.stdin.close()
        process.wait(10.0)


@pytest.fixture
def emulated(emulated_process: Emulated) -> Iterator[Emulated]:
    """Left as it was found: unlocked, talking."""
    yield emulated_process
    emulated_process.do("robot.silence", on=False)
    emulated_process.do("robot.unlock")
    emulated_process.do("robot.remote_control", on=True)


class Scripted:
    """Listens on a port of the system's choice; each connection is handled by the function of the test."""

    def __init__(self, talk: Callable[[socket.socket], None]) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._talk = talk
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            with client:
                client.settimeout(5.0)
                self._talk(client)

    def close(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._thread.join(10.0)
        assert not self._thread.is_alive()


@pytest.fixture
def scripted() -> Iterator[Callable[[Callable[[socket.socket], None]], Scripted]]:
    servers: list[Scripted] = []

    def start(talk: Callable[[socket.socket], None]) -> Scripted:
        servers.append(Scripted(talk))
        return servers[-1]

    yield start
    for server in servers:
        server.close()
