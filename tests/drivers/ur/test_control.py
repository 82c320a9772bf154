import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drivers.errors import DeviceLost, DeviceRefused, DeviceStale
from drivers.ur.control import UrControl
from drivers.ur.reader import UrReader

HOME = np.array([0.0, -1.5, 1.5, -1.5, -1.5, 0.0])
FAR = HOME + np.array([2.5, 0.0, 0.0, 0.0, 0.0, 0.0])
RIG_PATH = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"
SLOW_RAD_S = 0.1  # FAR takes six seconds at four times real time: whoever stops on the way may be late by seconds
PATIENCE_S = 30.0


@pytest.fixture
def control(emulated):
    control = UrControl(emulated.host)
    control.connect()
    control.move_joints(HOME, 2.0, 10.0)
    yield control
    control.close()


@pytest.fixture
def watch(emulated):
    """A recorder beside the control: it sees what the arm really does."""
    reader = UrReader(emulated.host)
    reader.connect()
    yield Watch(reader)
    reader.close()


class Watch:
    def __init__(self, reader: UrReader) -> None:
        self._reader = reader

    def until(self, happened: Callable[[np.ndarray, np.ndarray], bool]) -> np.ndarray:
        """Reads until (q, qd) of some sample satisfy it; the joints then."""
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            block = self._reader.read(1.0)
            for q, qd in zip(block.values["actual_q_rad"], block.values["actual_qd_rad_s"], strict=True):
                if happened(q, qd):
                    return q
        raise AssertionError("it did not happen")

    def until_moving(self) -> None:
        self.until(lambda q, qd: abs(qd[0]) > 0.5 * SLOW_RAD_S)

    def until_standing(self) -> np.ndarray:
        return self.until(lambda q, qd: np.abs(qd).max() < 1e-4)


def joints_now(emulated) -> tuple[np.ndarray, np.ndarray]:
    """Position and speed as a recorder sees them that connects now."""
    reader = UrReader(emulated.host)
    reader.connect()
    block = reader.read(1.0)
    reader.close()
    return block.values["actual_q_rad"][0], block.values["actual_qd_rad_s"][0]


def during(action: Callable[[], object]) -> threading.Thread:
    thread = threading.Thread(target=action)
    thread.start()
    return thread


def test_a_move_blocks_until_the_arm_has_arrived(emulated, control) -> None:
    control.move_joints(HOME + 0.1, 2.0, 10.0)
    q_rad, qd_rad_s = joints_now(emulated)
    assert q_rad == pytest.approx(HOME + 0.1, abs=2e-5)
    assert np.abs(qd_rad_s).max() < 1e-3


def test_servo_set_points_are_followed_until_servo_stop(control, watch) -> None:
    for step in range(100):
        control.servo_joints(HOME + 0.0005 * step)
    watch.until(lambda q, qd: bool(np.abs(q - HOME - 0.0005 * 99).max() < 1e-3))
    control.servo_stop()
    watch.until_standing()


def test_stop_from_another_thread_ends_a_move_at_once(control, watch) -> None:
    def stop() -> None:
        watch.until_moving()
        control.stop()

    thread = during(stop)
    with pytest.raises(DeviceRefused, match=r"ended by stop\(\)"):
        control.move_joints(FAR, SLOW_RAD_S, 3.0)
    thread.join()
    assert watch.until_standing()[0] < 2.0
    control.move_joints(HOME, 2.0, 10.0)  # the same connection goes on


def test_stop_of_a_hung_child_goes_through_the_dashboard(control, watch) -> None:
    assert control._child is not None
    pid = control._child.pid

    def hang_and_stop() -> None:
        watch.until_moving()
        os.kill(pid, signal.SIGSTOP)
        control.stop()

    thread = during(hang_and_stop)
    with pytest.raises((DeviceRefused, DeviceStale), match="connect again"):  # whoever notices it first
        control.move_joints(FAR, SLOW_RAD_S, 3.0)
    thread.join()
    assert watch.until_standing()[0] < 2.0
    control.connect()
    control.move_joints(HOME, 2.0, 10.0)


def test_a_stop_of_a_child_that_another_thread_has_given_up_goes_through_the_dashboard(control) -> None:
    assert control._child is not None
    control._child.kill()
    control._child.release()
    control.stop()
    assert control._child is None


def test_after_hold_every_motion_is_refused_until_connect(control) -> None:
    control.hold()
    with pytest.raises(DeviceRefused, match=r"stop\(\)"):
        control.move_joints(HOME + 0.1, 2.0, 10.0)
    with pytest.raises(DeviceRefused, match=r"stop\(\)"):
        control.servo_joints(HOME)
    control.connect()
    control.move_joints(HOME + 0.1, 2.0, 10.0)


def test_stop_works_without_a_connection(emulated) -> None:
    UrControl(emulated.host).stop()


def test_stop_with_nobody_there_says_so() -> None:
    with pytest.raises(DeviceLost, match="emergency stop"):
        UrControl("127.250.1.1").stop()


def test_a_protective_stop_in_mid_move_is_named_with_its_remedy(emulated, control, watch) -> None:
    def push() -> None:
        watch.until_moving()
        emulated.do("robot.protective_stop")

    thread = during(push)
    with pytest.raises(DeviceRefused, match="PROTECTIVE_STOP; clear the cause, unlock on the pendant"):
        control.move_joints(FAR, SLOW_RAD_S, 3.0)
    thread.join()
    with pytest.raises(DeviceRefused, match="PROTECTIVE_STOP"):
        control.connect()
    emulated.do("robot.unlock")
    control.connect()
    control.move_joints(HOME, 2.0, 10.0)


def test_a_killed_child_is_lost_and_the_arm_stops(control, watch) -> None:
    assert control._child is not None
    pid = control._child.pid

    def kill() -> None:
        watch.until_moving()
        os.kill(pid, signal.SIGKILL)

    thread = during(kill)
    with pytest.raises(DeviceLost, match="signal SIGKILL"):
        control.move_joints(FAR, SLOW_RAD_S, 3.0)
    thread.join()
    assert watch.until_standing()[0] < 2.0
    with pytest.raises(DeviceLost, match="not connected"):
        control.move_joints(HOME, 2.0, 10.0)


def test_a_controller_that_drops_its_clients_is_lost(emulated, control, watch) -> None:
    def drop() -> None:
        watch.until_moving()
        emulated.do("robot.disconnect")

    thread = during(drop)
    with pytest.raises(DeviceLost):
        control.move_joints(FAR, SLOW_RAD_S, 3.0)
    thread.join()
    control.connect()
    control.move_joints(HOME, 2.0, 10.0)


def test_a_silent_controller_does_not_hang_a_move(emulated, control) -> None:
    emulated.do("robot.silence", on=True)
    # Not "has not ended within": that is the limit of two minutes that this way would have.
    with pytest.raises((DeviceStale, DeviceLost), match=r"has sent nothing new|is silent for|has lost the"):
        control.move_joints(FAR, SLOW_RAD_S, 3.0)


def test_a_dead_parent_stops_the_arm(emulated) -> None:
    code = (
        "import sys; from drivers.ur.control import UrControl; c = UrControl(sys.argv[1]); c.connect();"
        f"c.move_joints({HOME.tolist()}, 2.0, 10.0); print(flush=True);"
        f"c.move_joints({FAR.tolist()}, {SLOW_RAD_S}, 3.0)"
    )
    reader = UrReader(emulated.host)
    with subprocess.Popen([sys.executable, "-c", code, emulated.host], stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline()  # it is at home, and about to go far
        reader.connect()  # not before: what it saw meanwhile would be read first
        watch = Watch(reader)
        watch.until(lambda q, qd: bool(q[0] > 0.02 and qd[0] > 0.5 * SLOW_RAD_S))
        parent.kill()
    at_rest = watch.until_standing()
    reader.close()
    assert at_rest[0] < 2.0


def test_a_dead_parent_and_a_dead_controller_leave_no_process_behind(emulated) -> None:
    code = (
        "import sys; from drivers.ur.control import UrControl; c = UrControl(sys.argv[1]);"
        "c.connect(); print(flush=True); input()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, emulated.host], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline()
        child = int(Path(f"/proc/{parent.pid}/task/{parent.pid}/children").read_text().split()[0])
        watched = os.pidfd_open(child)
        try:
            emulated.do("robot.silence", on=True)
            parent.kill()
            ended, _, _ = select.select([watched], [], [], 30.0)
        finally:
            emulated.do("robot.silence", on=False)
            os.close(watched)
    assert ended


def test_local_control_is_refused_before_anything_moves(emulated) -> None:
    emulated.do("robot.remote_control", on=False)
    with pytest.raises(DeviceRefused, match="remote control"):
        UrControl(emulated.host).connect()


def test_numbers_that_the_controller_does_not_take(control) -> None:
    with pytest.raises(ValueError, match="six finite numbers"):
        control.move_joints([0.0] * 5, 1.0, 1.0)
    with pytest.raises(ValueError, match="positive"):
        control.move_joints(HOME, 0.0, 1.0)
    with pytest.raises(DeviceRefused, match="not within"):
        control.move_joints(HOME, 10.0, 1.0)  # ur_rtde's own range
    control.move_joints(HOME, 1.0, 1.0)


def test_close_ends_the_child_and_is_safe_more_than_once(control) -> None:
    child = control._child
    assert child is not None
    control.close()
    assert not child.alive
    control.close()


TOGETHER = 12


class FrozenDashboard:
    """Answers nobody until all have asked."""

    def __init__(self) -> None:
        self._asked = threading.Barrier(TOGETHER)

    def stop(self) -> None:
        self._asked.wait(PATIENCE_S)


def test_stops_of_a_frozen_controller_do_not_wait_for_each_other() -> None:
    control, answered = UrControl("127.0.0.1", dashboard=FrozenDashboard()), []
    presses = [threading.Thread(target=lambda: answered.append(control.hold())) for _ in range(TOGETHER)]
    for press in presses:
        press.start()
    for press in presses:
        press.join()
    assert len(answered) == TOGETHER


@pytest.mark.parametrize(
    ("number", "says"), [(signal.SIGKILL, "not the controller"), (signal.SIGSEGV, "see the pendant")]
)
def test_a_child_that_has_gone_is_this_programs_own(control, number, says) -> None:
    assert control._child is not None
    pid = control._child.pid
    os.kill(pid, number)
    with pytest.raises(DeviceLost, match=rf"control process of this program \({pid}\) has gone .*{says}"):
        control.move_joints(FAR, SLOW_RAD_S, 3.0)
