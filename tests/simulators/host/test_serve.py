"""The emulators as a process of their own: announced, reachable, and gone without a trace when told to stop."""

import contextlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

from simulators.host.loop import STALL_S
from simulators.wire import TICK_S
from simulators.world.truth import read_truth, truth_of

START_LIMIT_S = 30.0
RIG = """
[arm]
joint = [{ a_m = 0.3, alpha_rad = 0.0, d_m = 0.1, mass_kg = 1.0 }, { a_m = 0.2, alpha_rad = 0.0, d_m = 0.0 }]
[tool]
laser_origin_m = [0, 0, 0]
laser_direction = [0, 0, 1]
[fixture]
half_size_m = 0.01
psd2_in_psd1 = { origin_m = [0, 0.1, 0.1] }
[[placement]]
id = 1
psd1_in_base = { origin_m = [0.5, 0, 0] }
[devices.psd]
port = "%(folder)s/links/psd"
[devices.encoders]
channel = "%(folder)s/links/can"
bitrate = 500000
[devices.robot]
host = "127.0.0.1"
[emulation]
seed = 3
joint_zero_max_rad = 0.03
"""


class Served:
    """A served rig, with what it announced."""

    def __init__(self, folder: Path, rig: str = RIG, **options) -> None:
        path = folder / "rig.toml"
        path.write_text(rig % {"folder": folder})
        options = {"rig": str(path), "robot_port": free_port(), **options}
        self.process = subprocess.Popen(
            [sys.executable, str(Path(__file__).parent / "served.py"), json.dumps(options)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        ready, _, _ = select.select([self.process.stdout], [], [], START_LIMIT_S)
        line = self.process.stdout.readline() if ready else b""
        self.where = json.loads(line) if line else None
        self.robot_port = options["robot_port"]

    def ask(self, **request):
        with socket.create_connection((self.where["control"]["host"], self.where["control"]["port"]), 5.0) as client:
            client.sendall(json.dumps(request).encode() + b"\n")
            return json.loads(client.makefile().readline())

    def end(self) -> tuple[int, str]:
        """Exit code and what was said on stderr."""
        try:
            _, said = self.process.communicate(timeout=START_LIMIT_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.communicate()
            raise
        return self.process.returncode, said.decode()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def served(tmp_path: Path):
    with contextlib.ExitStack() as cleanup:

        def start(**options) -> Served:
            started = Served(tmp_path, **options)
            cleanup.callback(kill, started.process)
            return started

        yield start


def kill(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.communicate()


def test_everything_is_announced_reachable_and_cleaned_up(served, tmp_path: Path):
    on = served(truth_path=str(tmp_path / "aside" / "truth.json"), seed=11)
    assert on.where["psd"] == {"port": str(tmp_path / "links" / "psd")}
    assert on.where["can"] == {"interface": "slcan", "channel": str(tmp_path / "links" / "can"), "bitrate": 500000}
    assert on.where["robot"] == {"host": "127.0.0.1"}
    with socket.create_connection(("127.0.0.1", on.robot_port), 5.0) as client:
        client.sendall(b"hello")
        assert client.recv(100) == b"HELLO"
    assert on.ask(do="encoders.count") == {"ok": True, "result": 2}
    assert on.ask(do="fixture.place", **{"with": {"id": 0}}) == {"ok": True, "result": None}
    assert "the rig has 1" in on.ask(do="fixture.place", **{"with": {"id": 5}})["error"]
    assert read_truth(tmp_path / "aside" / "truth.json").seed == 11
    on.process.send_signal(signal.SIGTERM)
    assert on.end() == (0, "")
    assert list((tmp_path / "links").iterdir()) == []


def test_seed_of_the_rig_holds_unless_stated_otherwise(served, tmp_path: Path):
    served(truth_path=str(tmp_path / "truth.json"))
    rig = tomllib.loads(RIG % {"folder": tmp_path})
    assert read_truth(tmp_path / "truth.json") == truth_of(rig, 3)


def test_interrupt_ends_it_cleanly(served):
    on = served(links=False)
    on.process.send_signal(signal.SIGINT)
    assert on.end() == (0, "")


def test_without_links_the_terminals_are_named_themselves(served, tmp_path: Path):
    on = served(links=False)
    assert os.path.exists(on.where["psd"]["port"])
    assert not (tmp_path / "links").exists()


def test_it_ends_with_its_parent_when_asked(served, tmp_path: Path):
    on = served(end_with_stdin=True)
    on.process.stdin.close()
    on.process.stdin = None
    assert on.end() == (0, "")
    assert list((tmp_path / "links").iterdir()) == []


def test_two_at_once_share_no_address(served):
    one = served(robot_host="auto", links=False)
    two = served(robot_host="auto", links=False, robot_port=one.robot_port)
    hosts = [one.where["robot"]["host"], two.where["robot"]["host"]]
    assert len(set(hosts)) == 2
    assert all(host.startswith("127.0.0.") and host != "127.0.0.1" for host in hosts)


def test_busy_robot_address_is_named(served):
    one = served(links=False)
    two = served(links=False, robot_port=one.robot_port)
    code, said = two.end()
    assert code != 0
    assert f"rtde: 127.0.0.1:{one.robot_port} is in use by another program" in said


def test_device_that_the_rig_does_not_have_is_not_emulated(served):
    on = served(rig=RIG.replace("[devices.psd]", "[elsewhere.psd]"), links=False)
    assert sorted(on.where) == ["can", "control", "robot"]


def test_emulated_time_runs_at_the_scale_that_was_asked_for(served):
    """Twenty emulated seconds for each real one that the machine did not stall, within what may be caught up."""
    on = served(links=False, time_scale=20.0)
    before_s = time.monotonic()
    first = on.ask(do="host.pace")["result"]
    for _ in range(10000):
        between_s = time.monotonic()
        last = on.ask(do="host.pace")["result"]
        if last["ticks"] >= first["ticks"] + 2500:  # five emulated seconds
            break
    after_s = time.monotonic()
    emulated_s = TICK_S * (last["ticks"] - first["ticks"])
    lost_s = last["lost_s"] - first["lost_s"]
    assert emulated_s >= 5.0
    assert emulated_s <= 20.0 * (after_s - before_s - lost_s + STALL_S)
    assert emulated_s >= 20.0 * (between_s - before_s - lost_s - STALL_S)


@pytest.mark.parametrize("time_scale", [0.0, -1.0])
def test_time_that_stands_still_is_refused(served, time_scale):
    on = served(links=False, time_scale=time_scale)
    code, said = on.end()
    assert code != 0
    assert "give emulated seconds per real second, above 0" in said
