"""Unmodified ur_rtde (receive, control, dashboard) against the emulator in another process, at twice real time."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest
from dashboard_client import DashboardClient
from rtde_control import RTDEControlInterface
from rtde_io import RTDEIOInterface
from rtde_receive import RTDEReceiveInterface

from drivers.ur.control import UrControl

HOME = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0]


def wait_for(happened: Callable[[], bool], limit_s: float = 30.0) -> None:
    """Polls; ur_rtde has no event to wait for."""
    end_s = time.monotonic() + limit_s
    while not happened():
        assert time.monotonic() < end_s
        time.sleep(2e-4)


@pytest.fixture
def dashboard(emulated) -> Iterator[DashboardClient]:
    client = DashboardClient(emulated.host)
    client.connect()
    yield client
    client.disconnect()


@pytest.fixture
def receive(emulated) -> Iterator[RTDEReceiveInterface]:
    client = RTDEReceiveInterface(emulated.host, rt_priority=-1)
    yield client
    client.disconnect()


@pytest.fixture
def control(emulated, dashboard) -> Iterator[RTDEControlInterface]:
    client = RTDEControlInterface(emulated.host, rt_priority=-1)
    yield client
    client.stopScript()
    client.disconnect()


def test_receive_gets_a_fresh_sample_every_cycle(receive) -> None:
    seen: set[float] = set()
    wait_for(lambda: seen.add(receive.getTimestamp()) or len(seen) >= 600)
    cycles = sorted(round(time_s / 0.002) for time_s in seen)
    assert [0.002 * cycle for cycle in cycles] == pytest.approx(sorted(seen), abs=1e-9)
    # Polled, and the client keeps only the latest: a busy machine skips some, but one after the other is often seen.
    assert sum(after - before == 1 for before, after in pairwise(cycles)) > 10
    assert receive.getRobotMode() == 7
    assert receive.getSafetyMode() == 1
    assert len(receive.getActualTCPPose()) == 6


def test_moves_arrive(control, receive) -> None:
    assert control.moveJ(HOME, 2.0, 6.0)
    assert receive.getActualQ() == pytest.approx(HOME, abs=2e-5)
    pose = receive.getActualTCPPose()
    target = [pose[0], pose[1], pose[2] + 0.05, *pose[3:]]
    assert control.moveL(target, 0.5, 2.0)
    assert receive.getActualTCPPose() == pytest.approx(target, abs=2e-5)
    assert control.getInverseKinematics(pose) == pytest.approx(HOME, abs=1e-4)
    assert control.moveJ([[*HOME, 2.0, 6.0, 0.0], [0.2, *HOME[1:], 2.0, 6.0, 0.0]], False)
    assert receive.getActualQ() == pytest.approx([0.2, *HOME[1:]], abs=2e-5)


def test_an_asynchronous_move_can_be_watched_and_stopped(control, receive) -> None:
    control.moveJ(HOME, 2.0, 6.0)
    assert control.moveJ([2.0, *HOME[1:]], 1.0, 6.0, True)
    wait_for(lambda: receive.getActualQ()[0] > 0.2)
    assert control.getAsyncOperationProgress() >= 0
    control.stopJ(6.0)
    wait_for(lambda: abs(receive.getActualQd()[0]) < 1e-3)
    assert receive.getActualQ()[0] < 1.5
    assert control.getAsyncOperationProgress() < 0


def test_servo_loop_follows(control, receive) -> None:
    control.moveJ(HOME, 2.0, 6.0)
    for step in range(250):
        period = control.initPeriod()
        assert control.servoJ([0.0004 * step, *HOME[1:]], 0.0, 0.0, 0.002, 0.05, 500.0)
        control.waitPeriod(period)
    wait_for(lambda: receive.getActualQ()[0] == pytest.approx(0.0004 * 249, abs=1e-4))
    assert control.servoStop()


def test_speed_command_moves_until_it_is_stopped(control, receive) -> None:
    control.moveJ(HOME, 2.0, 6.0)
    assert control.speedJ([0.5, 0, 0, 0, 0, 0], 5.0)
    wait_for(lambda: receive.getActualQ()[0] > 0.1)
    assert receive.getActualQd()[0] == pytest.approx(0.5, abs=0.02)
    assert control.speedStop(5.0)
    wait_for(lambda: abs(receive.getActualQd()[0]) < 1e-3)


def test_protective_stop_and_the_way_back(emulated, control, receive, dashboard) -> None:
    control.moveJ(HOME, 2.0, 6.0)
    assert control.moveJ([2.0, *HOME[1:]], 1.0, 6.0, True)
    emulated.do("robot.protective_stop")
    wait_for(receive.isProtectiveStopped)
    assert dashboard.safetystatus() == "Safetystatus: PROTECTIVE_STOP"
    assert not control.moveJ(HOME, 2.0, 6.0)
    dashboard.closeSafetyPopup()
    dashboard.unlockProtectiveStop()
    wait_for(lambda: not receive.isProtectiveStopped())
    assert control.reuploadScript()
    wait_for(control.isProgramRunning)
    assert control.moveJ(HOME, 2.0, 6.0)


def test_outputs_and_speed_slider_through_the_io_client(emulated, receive) -> None:
    io = RTDEIOInterface(emulated.host)
    assert io.setStandardDigitalOut(3, True)
    wait_for(lambda: receive.getDigitalOutState(3))
    assert io.setStandardDigitalOut(3, False)
    wait_for(lambda: not receive.getDigitalOutState(3))
    assert io.setSpeedSlider(0.5)
    wait_for(lambda: receive.getTargetSpeedFraction() == 0.5)
    assert io.setSpeedSlider(1.0)
    wait_for(lambda: receive.getSpeedScaling() == 1.0)
    io.disconnect()


def test_a_dropped_receiver_notices_and_reconnects(emulated, receive) -> None:
    emulated.do("robot.disconnect")
    wait_for(lambda: not receive.isConnected())
    assert receive.reconnect()
    before_s = receive.getTimestamp()
    wait_for(lambda: receive.getTimestamp() > before_s)


def test_dashboard_switches_off_and_on(dashboard) -> None:
    dashboard.powerOff()
    wait_for(lambda: "POWER_OFF" in dashboard.robotmode())
    dashboard.powerOn()
    dashboard.brakeRelease()
    wait_for(lambda: "RUNNING" in dashboard.robotmode())
    assert dashboard.isInRemoteControl()
    assert dashboard.polyscopeVersion() == "5.12.0.1101"


TRAVELS = """
import sys
from rtde_control import RTDEControlInterface
control = RTDEControlInterface(sys.argv[1], rt_priority=-1)
home = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0]
control.moveJ(home, 2.0, 6.0)
print("begins", flush=True)
control.moveJ([[base, *home[1:], 1.0, 6.0, 0.02] for base in (1.0, 0.2, 1.0)] + [[0.0, *home[1:], 1.0, 6.0, 0.0]])
"""


@pytest.fixture
def killed_in_mid_path(emulated, receive) -> None:
    """A client in a process of its own that waits for the end of its path."""
    with subprocess.Popen([sys.executable, "-c", TRAVELS, emulated.host], stdout=subprocess.PIPE, text=True) as client:
        assert client.stdout is not None
        assert client.stdout.readline() == "begins\n"
        wait_for(lambda: receive.getActualQ()[0] > 0.2)
        client.kill()


def test_a_client_killed_in_mid_path_keeps_the_next_one_out_no_longer_than_its_path(
    killed_in_mid_path, control, receive
) -> None:
    assert control.moveJ(HOME, 2.0, 6.0)
    assert receive.getActualQ() == pytest.approx(HOME, abs=2e-5)


def test_a_client_killed_in_mid_path_is_stopped_by_our_own_control(killed_in_mid_path, emulated, receive) -> None:
    control = UrControl(emulated.host)
    control.connect()
    assert receive.getActualQ()[0] > 0.1  # in the middle: its path ends at 0
    control.move_joints(HOME, 2.0, 6.0)
    control.close()
    assert receive.getActualQ() == pytest.approx(HOME, abs=2e-5)
