import socket
import threading
import time
from contextlib import suppress

import pytest

from drivers.errors import DeviceLost, DeviceRefused, DeviceStale, WireError
from drivers.ur.dashboard import ArmState, UrDashboard

BANNER = b"Connected: Universal Robots Dashboard Server\n"


def test_states_of_an_arm_that_is_ready(emulated) -> None:
    state = UrDashboard(emulated.host).state()
    assert state == ArmState("RUNNING", "NORMAL", remote_control=True)
    assert state.ready


def test_a_protective_stop_is_seen_and_unlocked(emulated) -> None:
    dashboard = UrDashboard(emulated.host)
    emulated.do("robot.protective_stop")
    assert dashboard.state().safety_status == "PROTECTIVE_STOP"
    dashboard.unlock_protective_stop()
    assert dashboard.state().ready


def test_the_way_back_from_an_emergency_stop(emulated) -> None:
    dashboard = UrDashboard(emulated.host)
    emulated.do("robot.emergency_stop", on=True)
    assert dashboard.state().safety_status == "ROBOT_EMERGENCY_STOP"
    with pytest.raises(DeviceRefused, match='"power on" is refused'):
        dashboard.power_on()
    emulated.do("robot.emergency_stop", on=False)
    dashboard.power_on()
    dashboard.brake_release()
    seen = {dashboard.state().robot_mode}
    end_s = time.monotonic() + 5.0
    while not dashboard.state().ready and time.monotonic() < end_s:
        seen.add(dashboard.state().robot_mode)
    assert dashboard.state().ready
    assert "IDLE" in seen


def test_an_unlock_that_comes_too_early_is_refused_in_the_controllers_words(emulated) -> None:
    emulated.do("robot.unlock_delay", seconds=1000.0)
    emulated.do("robot.protective_stop")
    with pytest.raises(DeviceRefused, match="Cannot unlock protective stop"):
        UrDashboard(emulated.host).unlock_protective_stop()
    emulated.do("robot.unlock_delay", seconds=0.0)


def test_nobody_there(emulated) -> None:
    with pytest.raises(DeviceLost, match=f"{emulated.host}:1"):
        UrDashboard(emulated.host, port=1).stop()


def test_another_server_is_recognised(scripted) -> None:
    server = scripted(lambda client: client.sendall(b"220 mail.example ESMTP\n"))
    with pytest.raises(WireError, match="no dashboard server"):
        UrDashboard("127.0.0.1", port=server.port).stop()


@pytest.mark.parametrize("drip", [False, True])
def test_silence_has_a_limit_also_when_single_bytes_drip_in(scripted, drip: bool) -> None:
    hung_up = threading.Event()

    def talk(client: socket.socket) -> None:
        client.sendall(BANNER)
        client.settimeout(0.05)
        with suppress(ConnectionError):  # hanging up may reach this end as a reset
            for _ in range(1000):  # a driver that waits as long as bytes come would wait for 50 s
                try:
                    if not client.recv(100):
                        break
                except TimeoutError:
                    if drip:
                        client.sendall(b".")
            else:
                return
        hung_up.set()

    server = scripted(talk)
    with pytest.raises(DeviceStale, match="no reply"):
        UrDashboard("127.0.0.1", port=server.port, timeout_s=0.3).stop()
    assert hung_up.wait(20.0)  # by the driver, before the bytes had ended


def test_a_controller_that_hangs_up_is_lost(scripted) -> None:
    server = scripted(lambda client: client.sendall(BANNER))
    with pytest.raises(DeviceLost, match="closed the connection"):
        UrDashboard("127.0.0.1", port=server.port).stop()
