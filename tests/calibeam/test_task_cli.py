"""`calibeam task` on an emulated controller: taught from recorded poses, run with a hand, a part and a belt."""

import csv
import math
import re
import threading
from collections.abc import Generator
from pathlib import Path

import numpy as np
import pytest

from acquisition.motion.kinematics import transform
from acquisition.motion.task.task_file import read_task
from acquisition.recording.rig import load_rig
from calibeam.cli import run
from calibeam.devices.robot import robot_of
from calibeam.emulation import Emulation
from calibeam.motion.gate_of_rig import solver_of
from drivers.clock import SystemClock
from simulators.encoders.emulator import build
from simulators.host.loop import Host

ROOT = Path(__file__).parents[2]
RIG = ROOT / "rigs" / "ur5e-dual-psd.toml"
HOME_RAD = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
PIN = transform((-0.45, -0.25, 0.25), (3.1, 0.1, 0.05))
PATIENCE_S = 20.0
BELT_RAD_S, M_PER_TURN = 0.5, 0.25  # 20 mm/s
CELL = """[transform]
E = {{ origin_m = [0.0, 0.0, 0.15] }}
P = {{ untaught = true }}  # the pin
UP = {{ origin_m = [0.0, 0.0, -0.08] }}
BELT = {{ origin_m = [-0.50, -0.20, 0.30], belt_direction = [0.0, 1.0, 0.0] }}
PART = {{ unread = true }}
[position]
"at pin" = "T6 E = P"
"over pin" = "T6 E = P UP"
"at part" = "T6 E = BELT PART"
[[teach]]
transform = "P"
at = "at pin"
[hand]
output = "standard 5"
[read.PART]
file = "part.toml"
[belt]
m_per_turn = {turn}
[belt.encoder]
driver = "can-dbc"
interface = "slcan"
channel = "{channel}"
dbc = "{dbc}"
signals = ["ENCODER1.Angle"]
"""
PIN_STEPS = """[[step]]
do = "move"
to = "over pin"
[[step]]
do = "move"
to = "at pin"
by = "line"
[[step]]
do = "grasp"
"""
BELT_STEPS = """[[step]]
do = "read"
transform = "PART"
[[step]]
do = "move"
to = "at part"
[[step]]
do = "release"
"""


class Shaft:
    """The belt's drive, turning."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def link_encoders_rad(self) -> np.ndarray:
        return np.array([BELT_RAD_S * self.time_s])


@pytest.fixture(scope="module")
def belt() -> Generator[str]:
    """The channel of an encoder that sends by itself."""
    world = Shaft()
    device = {"driver": "can-dbc", "signals": ["ENCODER1.Angle"], "sync_hz": 100.0, "channel": "can0"}
    host = Host(build(world, {"devices": {"encoders": device}}), world)
    stop = threading.Event()
    thread = threading.Thread(target=host.run, args=(stop.is_set,))
    thread.start()
    yield host.serial_address("can")
    stop.set()
    thread.join()
    host.close()


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Generator[Path]:
    with Emulation(RIG) as emulation:
        path = tmp_path_factory.mktemp("rig") / "rig.toml"
        path.write_text(
            re.sub(r'host = "127.0.0.2"', f'host = "{emulation.address["robot"]["host"]}"', RIG.read_text())
        )
        yield path


def outputs_and_joints(rig: Path) -> tuple[int, np.ndarray]:
    device = load_rig(rig).devices.robot
    assert device is not None
    reader = robot_of(device, SystemClock()).reader
    reader.connect()
    try:
        values = reader.read(PATIENCE_S).values
    finally:
        reader.close()
    return int(values["digital_outputs"][-1]), values["actual_q_rad"][-1]


def cell(folder: Path, channel: str, steps: str) -> Path:
    file = folder / "cell.toml"
    file.write_text(CELL.format(turn=M_PER_TURN, channel=channel, dbc=ROOT / "rigs" / "encoders-plain.dbc") + steps)
    return file


def test_a_task_is_taught_run_and_gripped(rig: Path, belt: str, tmp_path: Path, capsys) -> None:
    file, taught, plans = cell(tmp_path, belt, PIN_STEPS), tmp_path / "taught.toml", tmp_path / "plans"
    command = ["task", "run", str(file), "--rig", str(rig), "--yes", "--out", str(plans)]
    assert run(command) == 1
    assert "P is not taught: `calibeam task teach`, with the arm placed at 'at pin'" in capsys.readouterr().out

    solver = solver_of(load_rig(rig))
    truth = read_task(file).graph.with_value("P", PIN)
    poses = tmp_path / "poses.csv"
    with poses.open("w", newline="") as sink:
        rows = csv.writer(sink)
        rows.writerow(["at", *(f"q{i}_rad" for i in range(1, 7))])
        rows.writerow(["at pin", *solver.nearest(truth.solve("at pin", "T6"), HOME_RAD)])
    assert run(["task", "teach", str(file), "--rig", str(rig), "--poses", str(poses), "--out", str(taught)]) == 0
    np.testing.assert_allclose(read_task(taught).graph.value("P"), PIN, atol=1e-6)

    command[2] = str(taught)
    assert run([*command[:-3], "--dry-run", "--out", str(plans)]) == 0
    assert "nothing was moved" in capsys.readouterr().out
    assert outputs_and_joints(rig)[0] & 1 << 5 == 0
    assert run(command) == 0
    lines = capsys.readouterr().out
    assert "the program ran to its end: 1 motion," in lines
    off = re.search(r"off the plan: largest ([0-9.]+) mm, rms ([0-9.]+) mm", lines)
    assert off is not None
    assert 0.0 < float(off[2]) < float(off[1])
    assert "solved at 100 Hz (10 x structural_hz 10 Hz of the rig file), sent at 500 Hz (15 x: 150 Hz, enough)" in lines
    word, q_rad = outputs_and_joints(rig)
    assert word & 1 << 5
    tool = solver.flange(q_rad) @ transform((0.0, 0.0, 0.15))
    np.testing.assert_allclose(tool[:3, 3], PIN[:3, 3], atol=1e-4)  # settled, within a few counts of a joint encoder


def test_a_part_on_a_belt_is_met_where_the_belts_encoder_has_brought_it(rig: Path, belt: str, tmp_path: Path) -> None:
    file, part = cell(tmp_path, belt, BELT_STEPS), transform((0.05, 0.02, 0.0), (math.pi, 0.0, 0.0))
    (tmp_path / "part.toml").write_text("origin_m = [0.05, 0.02, 0.0]\nrotation_rad = [3.141592653589793, 0.0, 0.0]\n")
    text = file.read_text().replace("P = { untaught = true }", "P = {}")
    file.write_text(text)
    assert run(["task", "run", str(file), "--rig", str(rig), "--yes", "--out", str(tmp_path)]) == 0
    word, q_rad = outputs_and_joints(rig)
    assert word & 1 << 5 == 0
    graph = read_task(file).graph.with_value("PART", part)
    tool = solver_of(load_rig(rig)).flange(q_rad) @ transform((0.0, 0.0, 0.15))
    begin_m, tip_m = (graph.value("BELT") @ part)[:3, 3], tool[:3, 3]
    along_m, across_m = tip_m[1] - begin_m[1], np.hypot(tip_m[0] - begin_m[0], tip_m[2] - begin_m[2])
    assert 0.01 < along_m < 0.5  # the belt runs along the base's y at 20 mm/s
    assert across_m < 1e-4


def test_a_task_with_nothing_left_to_teach_opens_no_device(tmp_path: Path, capsys) -> None:
    file = tmp_path / "cell.toml"
    file.write_text('[transform]\nP = {}\n[position]\nat = "T6 = P"\n')
    assert run(["task", "teach", str(file), "--rig", str(RIG), "--out", str(tmp_path / "taught.toml")]) == 0
    assert "nothing is left to teach" in capsys.readouterr().out
