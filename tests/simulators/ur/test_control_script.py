"""The command protocol behind RTDEControlInterface, register by register."""

import numpy as np
import pytest

from simulators.ur.states import RuntimeState, SafetyMode

PROGRAM = """def rtde_control():
    global reg_offset_float = {offset} # float register offset
    global reg_offset_int = {offset} # int register offset
    def exec_move_path():
        # inject move path{path}
    end
end
"""
RUNNING = 1 << 15
START = np.array([0.0, -1.5, 1.5, -1.5, -1.5, 0.0])


class Client:
    """Writes commands as ur_rtde does and waits for the answer."""

    def __init__(self, bench, offset: int = 0, path: str = "") -> None:
        self.bench, self.offset, self.memory = bench, offset, bench.controller.memory
        wire = bench.controller.script_wire()
        wire.handle(PROGRAM.format(offset=offset, path=path).encode())
        bench.run_until(lambda: bench.controller.runner.state is RuntimeState.PLAYING, 1.0)
        bench.run(0.004)

    @property
    def state(self) -> int:
        return self.memory.outputs.ints[self.offset]

    @property
    def progress(self) -> int:
        return self.memory.outputs.ints[self.offset + 2]

    def send(self, command: int, *numbers: float, integer: int = 0) -> None:
        self.memory.inputs.doubles[self.offset : self.offset + len(numbers)] = numbers
        self.memory.inputs.ints[self.offset + 1] = integer
        self.memory.write_int(self.offset, command)

    def do(self, command: int, *numbers: float, integer: int = 0, limit_s: float = 10.0) -> float:
        """Emulated seconds until "done"; then the command is taken back, as the client does."""
        assert self.state == 1
        self.send(command, *numbers, integer=integer)
        took_s = self.bench.run_until(lambda: self.state == 2, limit_s)
        assert self.state == 2
        self.memory.write_int(self.offset, 0)
        self.bench.run(0.004)
        assert self.state == 1
        return took_s

    def results(self, count: int) -> list[float]:
        return self.memory.outputs.doubles[self.offset : self.offset + count]


@pytest.mark.parametrize("offset", [0, 24])
def test_a_joint_move_is_done_when_the_arm_has_arrived(bench, offset: int) -> None:
    client = Client(bench, offset)
    took_s = client.do(1, *(START + 0.3), 1.0, 3.0)
    assert took_s == pytest.approx(0.3 + 1.0 / 3.0, abs=0.01)
    assert np.array_equal(bench.world.joints().q_rad, START + 0.3)


def test_an_asynchronous_move_is_done_at_once_and_reports_its_end(bench) -> None:
    client = Client(bench)
    assert client.do(1, *(START + 0.3), 1.0, 3.0, integer=1) < 0.01
    assert client.progress & RUNNING
    operation = client.progress >> 24
    bench.settle()
    bench.run(0.004)
    assert not client.progress & RUNNING
    assert client.progress >> 24 == operation
    client.do(1, *START, 1.0, 3.0, integer=1)
    assert client.progress >> 24 == operation + 1


def test_stopping_an_asynchronous_move(bench) -> None:
    client = Client(bench)
    client.do(1, *(START + 1.0), 1.0, 3.0, integer=1)
    bench.run(0.5)
    assert client.do(34, 5.0) == pytest.approx(0.2, abs=0.02)
    assert not client.progress & RUNNING
    assert not bench.arm.moving


def test_a_servo_command_stays_in_force_until_servo_stop(bench) -> None:
    client = Client(bench)
    client.send(11, *(START + 0.01), 0.0, 0.0, 0.002, 0.1, 300.0)
    bench.run(3.0)
    assert client.state == 1
    assert bench.world.joints().q_rad == pytest.approx(START + 0.01, abs=1e-6)
    client.memory.write_int(0, 0)
    bench.run(0.004)
    client.do(16, 10.0)


def test_an_injected_path_runs_leg_by_leg(bench) -> None:
    path = "".join(
        f"\n        signal_async_progress({leg})\n        movej({q.tolist()},a=3.0,v=1.0,r=0.0)"
        for leg, q in enumerate((START + 0.2, START - 0.1))
    )
    client = Client(bench, path=path)
    client.do(45, integer=1)
    seen = set()
    while client.progress & RUNNING:
        seen.add(client.progress & 0x7FFF)
        bench.run(0.002)
    assert seen == {0, 1}
    assert np.array_equal(bench.world.joints().q_rad, START - 0.1)


def test_forward_and_inverse_kinematics_agree(bench) -> None:
    client = Client(bench)
    client.do(44, *(START + 0.1), *([0.0] * 6))
    pose = client.results(6)
    client.do(30, *pose, *START, 1e-6, 1e-6)
    assert client.results(6) == pytest.approx(START + 0.1, abs=1e-6)
    client.do(60, 3.0, 0, 0, 0, 0, 0)
    assert client.memory.outputs.ints[1] == 0
    client.do(37, *START)
    assert client.memory.outputs.ints[1] == 1


def test_tool_and_payload_are_kept(bench) -> None:
    client = Client(bench)
    client.do(29, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0)
    client.do(40)
    assert client.results(6) == pytest.approx([0, 0, 0.1, 0, 0, 0])
    client.do(17, 1.5, 0.0, 0.0, 0.04)
    assert bench.controller.memory.installation.payload_kg == 1.5


def test_the_watchdog_stops_a_moving_arm_when_nobody_writes(bench) -> None:
    client = Client(bench)
    client.do(35, 2.0)
    client.do(1, *(START + np.array([3.0, 0, 0, 0, 0, 0])), 0.5, 3.0, integer=1)
    for _ in range(10):  # kicks
        bench.run(0.1)
        client.memory.write_int(0, 0)
    assert bench.controller.runner.state is RuntimeState.PLAYING
    bench.run(0.6)
    assert bench.controller.runner.state is RuntimeState.STOPPED
    assert "watchdog" in bench.controller.runner.last_error
    bench.settle()
    assert bench.world.joints().q_rad[0] < 1.5


def test_a_protective_stop_ends_the_program_and_a_new_one_starts_only_after_the_unlock(bench) -> None:
    client = Client(bench)
    client.send(1, *(START + 1.0), 1.0, 3.0)
    bench.run(0.5)
    bench.arm.protective_stop()
    bench.run(0.002)
    assert bench.controller.runner.state is RuntimeState.STOPPED
    bench.settle()
    client.memory.write_int(0, 0)
    Client(bench)
    assert bench.controller.runner.state is RuntimeState.STOPPED
    bench.arm.unlock()
    assert bench.arm.power.safety_mode is SafetyMode.NORMAL
    Client(bench).do(1, *START, 1.0, 3.0)


def test_an_impossible_target_ends_the_program_with_a_reason(bench) -> None:
    client = Client(bench)
    client.send(1, 9.0, 0, 0, 0, 0, 0, 1.0, 3.0)
    bench.run(0.01)
    assert bench.controller.runner.state is RuntimeState.STOPPED
    assert "joint range" in bench.controller.runner.last_error


def test_stop_script_ends_the_program(bench) -> None:
    client = Client(bench)
    client.send(255)
    bench.run(0.004)
    assert bench.controller.runner.state is RuntimeState.STOPPED


def test_a_stop_behind_a_command_that_nobody_took_back_ends_the_program(bench) -> None:
    """As the next client sends it, when the one before died in the middle of a motion."""
    client = Client(bench)
    client.send(1, *(START + 0.3), 1.0, 3.0)
    bench.run(0.1)
    client.memory.write_int(0, 0)
    client.memory.write_int(0, 255)
    bench.run_until(lambda: bench.controller.runner.state is RuntimeState.STOPPED, 5.0)
    assert bench.controller.runner.state is RuntimeState.STOPPED
    assert np.array_equal(bench.world.joints().q_rad, START + 0.3)
