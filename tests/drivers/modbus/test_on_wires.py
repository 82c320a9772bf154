"""Reading, moving and stopping over real Modbus lines; every test runs over TCP and over RTU."""

import threading

import numpy as np
import pytest

from drivers.errors import DeviceError, DeviceLost, DeviceRefused, DeviceStale
from drivers.modbus.arm import ModbusArm
from drivers.modbus.line import RETRIES, TIMEOUT_S, ModbusLine, TcpAddress
from drivers.modbus.register_map import Register, RegisterMap
from tests.drivers.modbus.conftest import HOME

FAR = HOME + np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
SLOW_RAD_S = 0.2


def joints_of(cell, arm) -> np.ndarray:
    """As a reader sees them; a serial line has one master, so the arm's is closed."""
    arm.close()
    reader = cell.reader()
    reader.connect()
    try:
        return reader.read(1.0).values["actual_q_rad"][0]
    finally:
        reader.close()


def test_samples_come_one_by_one_in_si_units(cell, arm) -> None:
    arm.close()
    reader = cell.reader()
    reader.connect()
    blocks = [reader.read(1.0) for _ in range(5)]
    reader.close()
    sequence = np.concatenate([block.sequence for block in blocks])
    assert sequence[0] == 0
    assert (np.diff(sequence) >= 1).all()
    values = blocks[-1].values
    assert values["actual_q_rad"][0] == pytest.approx(HOME, abs=1e-4)
    assert values["joint_temperature_degC"].shape == (1, 6)
    assert 10.0 < values["joint_temperature_degC"][0, 0] < 60.0
    assert values["robot_mode"] == 7
    assert set(values) == {channel.name for channel in reader.describe()}


def test_a_move_blocks_until_the_arm_has_arrived(cell, arm) -> None:
    arm.move_joints(HOME + 0.2, 2.0, 10.0)
    assert cell.emulators.ask("robot.standing")
    assert joints_of(cell, arm) == pytest.approx(HOME + 0.2, abs=1e-4)


def test_a_closed_line_is_not_opened_again_by_a_late_request(cell, arm) -> None:
    arm.close()
    with pytest.raises(DeviceLost, match="closed; connect again"):
        arm.move_joints(HOME, 2.0, 10.0)
    arm.connect()
    arm.move_joints(HOME, 2.0, 10.0)


def read_until_it_fails(reader) -> None:
    for _ in range(200):
        reader.read(1.0)


def when_moving(cell, action) -> threading.Thread:
    def act() -> None:
        while cell.emulators.ask("robot.standing"):
            pass
        action()

    thread = threading.Thread(target=act)
    thread.start()
    return thread


def test_a_stop_from_another_thread_ends_a_move(cell, arm) -> None:
    stopper = when_moving(cell, arm.stop)
    with pytest.raises(DeviceRefused, match="the motion was ended: the stop register is set"):
        arm.move_joints(FAR, SLOW_RAD_S, 5.0)
    stopper.join()
    assert cell.emulators.ask("robot.standing")
    arm.move_joints(HOME, 2.0, 10.0)  # a stop is over when the arm stands


def test_after_hold_every_motion_is_refused_until_connect(cell, arm) -> None:
    arm.hold()
    with pytest.raises(DeviceRefused, match="connect again"):
        arm.move_joints(HOME + 0.1, 2.0, 10.0)
    assert cell.emulators.ask("robot.standing")
    arm.connect()
    arm.move_joints(HOME + 0.1, 2.0, 10.0)


def test_a_move_that_crosses_a_stop_on_the_way_never_runs(cell, arm) -> None:
    """The stop falls between the joint target and the command number."""
    stops = arm._stops
    arm.stop()
    with pytest.raises(DeviceRefused, match="before it began"):
        arm._order(stops, arm._clock.now_s())
    assert cell.emulators.ask("robot.standing")


def test_a_protective_stop_is_named_with_its_remedy(cell, arm) -> None:
    pusher = when_moving(cell, lambda: cell.emulators.ask("robot.protective_stop"))
    with pytest.raises(DeviceRefused, match="protective stop: clear the cause and unlock"):
        arm.move_joints(FAR, SLOW_RAD_S, 5.0)
    pusher.join()
    with pytest.raises(DeviceRefused, match="refused: protective stop"):
        arm.move_joints(HOME, 2.0, 10.0)
    cell.emulators.ask("robot.unlock")
    arm.move_joints(HOME, 2.0, 10.0)


def test_joints_out_of_range_are_refused(arm) -> None:
    with pytest.raises(DeviceRefused, match="outside what the arm can do"):
        arm.move_joints(HOME + 7.0, 2.0, 10.0)
    with pytest.raises(ValueError, match="six finite numbers"):
        arm.move_joints([0.0] * 5, 2.0, 10.0)
    with pytest.raises(ValueError, match="positive"):
        arm.move_joints(HOME, 0.0, 10.0)


def test_a_program_that_stands_is_stale(cell, arm) -> None:
    arm.close()
    reader = cell.reader()
    reader.connect()
    cell.emulators.ask("robot.program", on=False)
    with pytest.raises(DeviceStale, match="life register stands"):
        read_until_it_fails(reader)
    reader.close()


def test_a_program_that_takes_no_command_is_stale(cell, arm) -> None:
    cell.emulators.ask("robot.program", on=False)
    with pytest.raises(DeviceStale, match="was not taken"):
        arm.move_joints(HOME + 0.1, 2.0, 10.0)
    cell.emulators.ask("robot.program", on=True)
    arm.connect()
    assert cell.emulators.ask("robot.standing")  # a command that was given up must not run later
    assert joints_of(cell, arm) == pytest.approx(HOME, abs=1e-4)


@pytest.mark.parametrize(
    ("kind", "raised", "reason"),
    [
        ("silence", DeviceStale, "no good answer"),
        ("checksum", DeviceStale, "no good answer"),
        pytest.param("junk", DeviceStale, "no good answer", marks=pytest.mark.endure),  # daily: a wrong checksum
        ("error", DeviceRefused, "is refused, code"),
    ],
)
def test_a_line_in_trouble_is_one_kind_of_error_after_the_tries_of_one_request(cell, arm, kind, raised, reason) -> None:
    assert (RETRIES + 1) * TIMEOUT_S < 2.0  # seconds: what an operator waits for at most
    cell.emulators.inject("robot", kind)
    with pytest.raises(raised, match=reason):  # and not only when the motion's own 10 s are over
        arm.move_joints(HOME + 0.1, 2.0, 10.0)


@pytest.mark.parametrize("kind", ["delay", "split", "silence", "checksum", "junk"])
def test_a_fault_that_passes_is_survived(cell, arm, kind) -> None:
    cell.emulators.inject("robot", kind, count=1)
    arm.move_joints(HOME + 0.1, 2.0, 10.0)


def test_a_dropped_line_is_lost_and_connects_anew(cell, arm) -> None:
    cell.emulators.inject("robot", "disconnect", count=1)
    with pytest.raises(DeviceError):
        arm.move_joints(HOME + 0.1, 2.0, 10.0)
    cell.emulators.clear()
    for _ in range(1000):
        try:
            arm.connect()
            break
        except DeviceLost:
            cell.emulators.ask("world.time")
    arm.move_joints(HOME, 2.0, 10.0)


def test_a_map_that_does_not_fit_is_reported_when_connecting(cell) -> None:
    if cell.device.host is None:
        return
    line = ModbusLine(TcpAddress(cell.device.host, cell.device.port))
    wrong = RegisterMap([Register("actual_q_rad", 1000, "float32", 6)])
    from drivers.modbus.reader import ModbusReader

    with pytest.raises(DeviceRefused, match="the register map does not fit"):
        ModbusReader(line, wrong).connect()
    line.close()


def test_nobody_there() -> None:
    line = ModbusLine(TcpAddress("127.250.1.1", 5020))
    with pytest.raises(DeviceLost, match=r"127\.250\.1\.1:5020 unit 1: cannot connect"):
        line.connect()


def test_a_map_without_a_handshake_cannot_move(cell) -> None:
    only_joints = RegisterMap([Register("actual_q_rad", 0, "float32", 6)])
    with pytest.raises(ValueError, match="cannot move it, these are missing: command_q_rad"):
        ModbusArm(ModbusLine(TcpAddress("127.0.0.1")), only_joints)
