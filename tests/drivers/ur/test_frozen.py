"""Processes that are killed or frozen while the arm moves: how long it goes on by the controller's own time stamps, and
that nothing of before a freeze is carried out after it.

The controller runs at a quarter of real time, so that what a busy machine adds counts a quarter. Its watchdog does not:
alone it would stop the arm too late for these tests.
"""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pytest

from drivers.errors import DeviceError, DeviceLost, DeviceStale
from drivers.ur.control import UrControl
from drivers.ur.reader import UrReader

from .conftest import RIG_PATH, SERVE, Emulated

TIME_SCALE = 0.25
HOME = np.array([0.0, -1.5, 1.5, -1.5, -1.5, 0.0])
FAR = HOME + np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
SPEED_RAD_S = 0.5
MOVES_RAD_S = 1e-3
AT_REST_S = 0.5  # emulated, from a kill or a freeze; the watchdog waits 1 s
STANDS_S = 0.3  # emulated, without a motion: longer than any command takes to begin
CLIENT = """
import sys
from drivers.errors import DeviceError
from drivers.ur.control import UrControl
control = UrControl(sys.argv[1])
control.connect()
for _ in range(2):
    try:
        control.move_joints(eval(sys.argv[2]), float(sys.argv[3]), 3.0)
    except DeviceError as error:
        print(error, flush=True)
"""


class Seen:
    """What the controller streams, read as it comes."""

    def __init__(self, host: str) -> None:
        self._reader = UrReader(host)
        self._reader.connect()
        self.stamp_s, self.moved_s = 0.0, 0.0  # newest, and the newest in which a joint moved
        self.turned_rad = 0.0  # newest reading of the joint that moves

    def read(self) -> np.ndarray:
        block = self._reader.read(2.0)
        speed = np.abs(block.values["actual_qd_rad_s"]).max(axis=1)
        self.stamp_s = float(block.device_s[-1])
        self.turned_rad = float(block.values["actual_q_rad"][-1][0])
        if (moving := block.device_s[speed > MOVES_RAD_S]).size:
            self.moved_s = float(moving[-1])
        return speed

    def until_moving(self, goes_on: Callable[[], bool], failed: Sequence[DeviceError] = ()) -> None:
        """Ends the test at once, with its error, where the motion has ended instead."""
        while self.read()[-1] < 0.9 * SPEED_RAD_S:
            assert goes_on(), failed

    def until_standing(self, from_s: float) -> None:
        """Until no joint has moved for a while; not before this stamp."""
        while self.stamp_s - max(self.moved_s, from_s) < STANDS_S:
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
    control = UrControl(controller.host)
    control.connect()
    control.move_joints(HOME, 2.0, 10.0)
    yield control
    control.close()


@pytest.fixture
def seen(controller) -> Iterator[Seen]:
    seen = Seen(controller.host)
    yield seen
    seen.close()


def now_s(controller: Emulated) -> float:
    """Emulated time, as in the stamps."""
    time_s = controller.do("world.time")
    assert isinstance(time_s, float)
    return time_s


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
def test_a_control_child_that_is_killed_or_frozen(controller, control, seen, number, error, says) -> None:
    assert control._child is not None
    thread, failed = moving(lambda: control.move_joints(FAR, SPEED_RAD_S, 3.0))
    seen.until_moving(thread.is_alive, failed)
    begin_s = now_s(controller)
    os.kill(control._child.pid, number)
    seen.until_standing(begin_s)
    thread.join()
    assert seen.moved_s - begin_s <= AT_REST_S
    assert isinstance(failed[0], error)
    assert says in str(failed[0])
    with pytest.raises(DeviceLost, match="not connected"):  # it is not started again by itself
        control.move_joints(HOME, 2.0, 10.0)


def test_a_program_that_is_frozen(controller, control, seen) -> None:
    """Its child brakes; after the thaw neither the motion that was under way goes on, nor does the next one begin."""
    control.close()
    arguments = [controller.host, str(FAR.tolist()), str(SPEED_RAD_S)]
    client = subprocess.Popen([sys.executable, "-c", CLIENT, *arguments], stdout=subprocess.PIPE, text=True)
    try:
        seen.until_moving(lambda: client.poll() is None)
        begin_s = now_s(controller)
        os.kill(client.pid, signal.SIGSTOP)
        seen.until_standing(begin_s)
        rest_s = seen.moved_s
        os.kill(client.pid, signal.SIGCONT)
        said, _ = client.communicate(timeout=60.0)
    finally:
        client.kill()
        client.wait()
    seen.until_standing(now_s(controller))  # also after both calls have ended
    assert rest_s - begin_s <= AT_REST_S
    assert seen.moved_s == rest_s
    first, second = said.splitlines()
    assert "was frozen; the arm was braked, and what was commanded before is not carried out" in first
    assert "not connected" in second


def test_a_controller_that_is_frozen(process, controller, control, seen) -> None:
    """The stop waits in its dashboard before it goes on: it carries no motion of before the freeze to its end."""
    thread, failed = moving(lambda: control.move_joints(FAR, SPEED_RAD_S, 3.0))
    seen.until_moving(thread.is_alive, failed)
    begin_s = now_s(controller)
    os.kill(process.pid, signal.SIGSTOP)  # emulated time stands from here on
    try:
        thread.join()
    finally:
        os.kill(process.pid, signal.SIGCONT)
    seen.close()
    assert isinstance(failed[0], DeviceStale | DeviceLost)
    after = Seen(controller.host)
    after.until_standing(now_s(controller))
    after.close()
    assert after.moved_s - begin_s <= AT_REST_S
    # The same by the way, for the arm may have come to rest before the recorder was connected.
    assert after.turned_rad - seen.turned_rad <= SPEED_RAD_S * (AT_REST_S + begin_s - seen.stamp_s)
