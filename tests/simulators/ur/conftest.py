"""A controller over a world that follows every set-point at once, and one in its own process over the real world."""

import json
import socket
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from simulators.ur.controller_kinematics import NominalArm
from simulators.ur.emulator import UrController, arm_controller
from simulators.ur.registers import Memory
from simulators.wire import TICK_S

RIG_PATH = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"
START_RAD = np.array([0.0, -1.5, 1.5, -1.5, -1.5, 0.0])
SERVE = """
import json, sys, tomllib
from simulators.serve import ServeOptions, serve
rig = tomllib.loads(open(sys.argv[1]).read())
rig["devices"] = {"robot": rig["devices"]["robot"]}
options = ServeOptions(robot_host="auto", time_scale=float(sys.argv[2]), links=False, end_with_stdin=True)
serve(rig, options, lambda where: print(json.dumps(where), flush=True))
"""


@dataclass(frozen=True)
class Joints:
    q_rad: np.ndarray
    qd_rad_s: np.ndarray
    torque_nm: np.ndarray
    temperature_degC: np.ndarray


class FollowingWorld:
    """Stands where it was commanded one tick ago."""

    n_joints = 6

    def __init__(self, arm: NominalArm) -> None:
        self.arm, self.time_s = arm, 0.0
        self._now_rad, self._next_rad = START_RAD.copy(), START_RAD.copy()
        self._speed_rad_s = np.zeros(6)

    def command(self, q_rad: np.ndarray) -> None:
        self._next_rad = np.array(q_rad, dtype=float)

    def advance(self, until_s: float) -> None:
        self._speed_rad_s = (self._next_rad - self._now_rad) / (until_s - self.time_s)
        self._now_rad, self.time_s = self._next_rad, until_s

    def mass_matrix_kg_m2(self, q_rad: np.ndarray) -> np.ndarray:
        return np.diag(np.arange(6.0) + 1.0)

    def load_nm(self, q_rad: np.ndarray, qd_rad_s: np.ndarray) -> np.ndarray:
        return np.arange(6.0) + np.asarray(qd_rad_s) ** 2

    def T_base_flange(self) -> np.ndarray:
        frame = self.arm.forward(self._now_rad.tolist())[0]
        pose = np.eye(4)
        pose[:3] = np.array(frame).reshape(4, 3).T
        return pose

    def joints(self) -> Joints:
        return Joints(self._now_rad, self._speed_rad_s, np.arange(6.0), np.full(6, 30.0))


class Bench:
    """A controller whose time is run by the test."""

    def __init__(self, rig: dict) -> None:
        self.world = FollowingWorld(NominalArm.from_rig(rig))
        self.arm = arm_controller(self.world, rig)
        self.controller = UrController(self.arm, Memory())
        self.trace_rad: list[np.ndarray] = []

    def run(self, seconds: float) -> None:
        self.run_until(lambda: False, seconds)

    def run_until(self, done: Callable[[], bool], limit_s: float) -> float:
        """Emulated seconds until `done`, at most the limit."""
        start_s = self.world.time_s
        while not done() and self.world.time_s < start_s + limit_s - 1e-9:
            t_s = self.world.time_s
            self.controller.before_step(t_s)
            self.world.advance(round(t_s / TICK_S + 1) * TICK_S)
            self.controller.after_step(t_s)
            self.trace_rad.append(self.arm.setpoint.q_rad)
        return self.world.time_s - start_s

    def settle(self, limit_s: float = 30.0) -> float:
        took_s = self.run_until(lambda: not self.arm.moving, limit_s)
        assert not self.arm.moving
        return took_s


@pytest.fixture(scope="session")
def rig() -> dict:
    return tomllib.loads(RIG_PATH.read_text())


@pytest.fixture
def bench(rig: dict) -> Bench:
    return Bench(rig)


@dataclass(frozen=True)
class Emulated:
    """Where a controller in another process listens, and its side channel."""

    host: str
    control: tuple[str, int]

    def do(self, verb: str, **arguments: object) -> object:
        with socket.create_connection(self.control, 5.0) as line:
            line.sendall(json.dumps({"do": verb, "with": arguments}).encode() + b"\n")
            answer = json.loads(line.makefile().readline())
        assert answer["ok"], answer
        return answer["result"]


@contextmanager
def emulator_process(time_scale: float) -> Iterator[Emulated]:
    """Real world and wires, at so many emulated seconds a second."""
    command = [sys.executable, "-c", SERVE, str(RIG_PATH), str(time_scale)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        where = json.loads(process.stdout.readline())
        yield Emulated(where["robot"]["host"], (where["control"]["host"], where["control"]["port"]))
        process.stdin.close()
        process.wait(10.0)


@pytest.fixture(scope="session")
def emulated() -> Iterator[Emulated]:
    """At twice real time."""
    with emulator_process(2.0) as where:
        yield where


@pytest.fixture(scope="module")
def fresh_emulated() -> Iterator[Emulated]:
    """Another, which nobody has used before this file's tests."""
    with emulator_process(2.0) as where:
        yield where
