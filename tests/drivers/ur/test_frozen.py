"""Processes that are killed or frozen while the arm moves: how long it goes on by the controller's own time stamps, and
that nothing of before a freeze is carried out after it.

The controller runs at half of real time, so that what a busy machine adds counts half.
"""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from drivers.errors import DeviceError, DeviceLost, DeviceStale
from drivers.ur.control import WATCHDOG_HZ, UrControl
from drivers.ur.reader import UrReader

from .conftest import RIG_PATH, SERVE, Emulated

TIME_SCALE = 0.5
HOME = np.array([0.0, -1.5, 1.5, -1.5, -1.5, 0.0])
FAR = HOME + np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
SPEED_RAD_S = 0.5
MOVES_RAD_S = 1e-3
AT_REST_S = 0.5  # emulated, from a kill or a freeze
STANDS_S = 0.3  # emulated, without a motion: longer than any command takes to begin
CLIENT = """
import sys
from drivers.errors import DeviceError
from drivers.ur.control import WATCHDOG_HZ, UrControl
control = UrControl(sys.argv[1], watchdog_hz=WATCHDOG_HZ / float(sys.argv[2]))
control.connect()
for _ in range(2):
    try:
        control.move_joints(eval(sys.argv[3]), float(sys.argv[4]), 3.0)
    except DeviceError as error:
        print(error, flush=True)
"""


class Seen:
    """What the controller streams, read as it comes."""

    def __init__(self, host: str) -> None:
        self._reader = UrReader(host)
        self._reader.connect()
        self.stamp_s, self.moved_s = 0.0, 0.0  # newest, and the newest in which a joint moved

    def read(self) -> np.ndarray:
        block = self._reader.read(2.0)
        speed = np.abs(block.values["actual_qd_rad_s"]).max(axis=1)
        self.stamp_s = float(block.device_s[-1])
        if (moving := block.device_s[speed > MOVES_RAD_S]).size:
            self.moved_s = float(moving[-1])
        return speed

    def until_moving(self) -> None:
        while self.read()[-1] < 0.9 * SPEED_RAD_S:
            pass

    def until_standing(self) -> None:
        while self.stamp_s - self.moved_s < STANDS_S:
            self.read()

    def close(self) -> None:
        self._reader.close()


@pytest.fixture(scope="module")
def process() -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-c", SERVE, str(RIG_PATH), str(TIME_SCALE)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        yield process
        assert process.stdin is not None
        process.stdin.close()
        process.wait(10.0)


@pytest.fixture(scope="module")
def controller(process) -> Emulated:
    where = json.loads(process.stdout.readline())
    return Emulated(where["robot"]["host"], (where["control"]["host"], where["control"]["port"]))


@pytest.fixture
def control(controller) -> Iterator[UrControl]:
    control = UrControl(controller.host, watchdog_hz=WATCHDOG_HZ / TIME_SCALE)
    control.connect()
    control.move_joints(HOME, 2.0, 10.0)
    yield control
    control.close()


@pytest.fixture
def seen(controller) -> Iterator[Seen]:
    seen = Seen(controller.host)
    yield seen
    seen.close()


def moving(act: Callable[[], object]) -> tuple[threading.Thread, list[DeviceError]]:
    failed: list[DeviceError] = []

    def run() -> None:
        try:
            act()
        except DeviceError as error:
            failed.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    return thread, failed


@pytest.mark.parametrize(
    ("number", "error", "says"), [(signal.SIGKILL, DeviceLost, "SIGKILL"), (signal.SIGSTOP, DeviceStale, "was frozen")]
)
def test_a_control_child_that_is_killed_or_frozen(control, seen, number, error, says) -> None:
    assert control._child is not None
    thread, failed = moving(lambda: control.move_joints(FAR, SPEED_RAD_S, 3.0))
    seen.until_moving()
    os.kill(control._child.pid, number)
    begin_s = seen.stamp_s
    seen.until_standing()
    thread.join(10.0)
    assert seen.moved_s - begin_s <= AT_REST_S
    assert isinstance(failed[0], error)
    assert says in str(failed[0])
    with pytest.raises(DeviceLost, match="not connected"):  # it is not started again by itself
        control.move_joints(HOME, 2.0, 10.0)


def test_a_program_that_is_frozen(controller, control, seen) -> None:
    """Its child brakes; after the thaw neither the motion that was under way goes on, nor does the next one begin."""
    control.close()
    arguments = [controller.host, str(TIME_SCALE), str(FAR.tolist()), str(SPEED_RAD_S)]
    client = subprocess.Popen([sys.executable, "-c", CLIENT, *arguments], stdout=subprocess.PIPE, text=True)
    try:
        seen.until_moving()
        os.kill(client.pid, signal.SIGSTOP)
        begin_s = seen.stamp_s
        seen.until_standing()
        rest_s = seen.moved_s
        os.kill(client.pid, signal.SIGCONT)
        said, _ = client.communicate(timeout=20.0)
    finally:
        client.kill()
        client.wait()
    thawed_s = seen.stamp_s
    while seen.stamp_s - thawed_s < STANDS_S:
        seen.read()
    assert rest_s - begin_s <= AT_REST_S
    assert seen.moved_s == rest_s
    first, second = said.splitlines()
    assert "was frozen; the arm was braked, and what was commanded before is not carried out" in first
    assert "not connected" in second


def test_a_controller_that_is_frozen(process, controller, control, seen) -> None:
    """The stop waits in its dashboard before it goes on: it carries no motion of before the freeze to its end."""
    thread, failed = moving(lambda: control.move_joints(FAR, SPEED_RAD_S, 3.0))
    seen.until_moving()
    begin_s = seen.stamp_s  # emulated time stands from here on
    os.kill(process.pid, signal.SIGSTOP)
    thread.join(20.0)
    seen.close()
    os.kill(process.pid, signal.SIGCONT)
    assert isinstance(failed[0], DeviceStale | DeviceLost)
    after = Seen(controller.host)
    after.moved_s = after.stamp_s
    after.until_standing()
    rest_s = after.moved_s
    after.close()
    assert rest_s - begin_s <= AT_REST_S
