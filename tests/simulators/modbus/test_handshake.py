"""The motion program behind the registers, cycle by cycle (docs/protocols/modbus.md)."""

import numpy as np
import pytest

from simulators.modbus.emulator import SILENCE_LIMIT_S, Reason, State, build
from simulators.wire import TICK_S
from tests.simulators.modbus.conftest import FollowingWorld

GOAL = [0.4, 0.1, 0.0, 0.0, 0.2, 0.0]


class Cell:
    """A controller whose time is run by the test, and a host that writes registers."""

    def __init__(self, rig) -> None:
        self.world = FollowingWorld()
        self.bench = build(self.world, rig, "127.0.0.2")
        (self.controller,) = self.bench.instruments
        self.registers = self.controller.registers
        self.life = 0

    def put(self, name: str, *values: float) -> None:
        entry = self.registers.entries[name]
        assert self.controller.memory.write(entry.address, entry.encoded(values))

    def order(self, number: int, q_rad=GOAL, speed_rad_s: float = 1.0) -> None:
        self.put("command_q_rad", *q_rad)
        self.put("command_speed_rad_s", speed_rad_s)
        self.put("command_acceleration_rad_s2", 5.0)
        self.put("command_number", number)

    def run(self, seconds: float, *, alive: bool = True) -> None:
        for _ in range(round(seconds / TICK_S)):
            if alive:
                self.life += 1
                self.put("host_life", self.life % 65536)
            t_s = self.world.time_s
            self.controller.before_step(t_s)
            self.world.advance(t_s + TICK_S)
            self.controller.after_step(t_s)

    @property
    def shown(self) -> tuple[State, int, Reason]:
        state, number, reason = (int(self.registers.get(name)[0]) for name in ("state", "state_number", "reason"))
        return State(state), number, Reason(reason)

    @property
    def q_rad(self) -> list[float]:
        return self.registers.get("actual_q_rad")


@pytest.fixture
def cell(rig) -> Cell:
    cell = Cell(rig)
    cell.run(0.01)
    return cell


def test_a_new_number_is_a_command_and_its_end_is_shown_with_it(cell) -> None:
    assert cell.shown == (State.NONE, 0, Reason.NONE)
    cell.order(7)
    cell.run(0.1)
    assert cell.shown == (State.MOVING, 7, Reason.NONE)
    cell.run(1.0)
    assert cell.shown == (State.ARRIVED, 7, Reason.NONE)
    assert cell.q_rad == pytest.approx(GOAL, abs=1e-6)


def test_the_same_number_again_is_no_command(cell) -> None:
    cell.order(7)
    cell.run(1.0)
    cell.order(7, [0.0] * 6)
    cell.run(1.0)
    assert cell.q_rad == pytest.approx(GOAL, abs=1e-6)


def test_the_stop_register_brakes_and_keeps_refusing(cell) -> None:
    cell.order(1)
    cell.run(0.2)
    cell.put("stop", 1)
    cell.run(0.5)
    assert cell.shown == (State.STOPPED, 1, Reason.STOP)
    assert 0.0 < cell.q_rad[0] < GOAL[0]
    cell.order(2)
    cell.run(0.1)
    assert cell.shown == (State.REFUSED, 2, Reason.STOP)
    cell.put("stop", 0)
    cell.order(3)
    cell.run(1.0)
    assert cell.shown == (State.ARRIVED, 3, Reason.NONE)


def test_a_silent_host_stops_a_moving_arm(cell) -> None:
    cell.order(1, speed_rad_s=0.1)
    cell.run(0.1)
    cell.run(SILENCE_LIMIT_S + 0.3, alive=False)
    assert cell.shown == (State.STOPPED, 1, Reason.HOST_SILENT)
    assert not np.abs(cell.world.speed_rad_s).any()


def test_a_silent_host_is_no_matter_while_the_arm_stands(cell) -> None:
    cell.run(3.0, alive=False)
    cell.order(1)
    cell.run(1.0)
    assert cell.shown == (State.ARRIVED, 1, Reason.NONE)


@pytest.mark.parametrize("q_rad", [[9.0, 0, 0, 0, 0, 0], [float("nan"), 0, 0, 0, 0, 0]])
def test_what_the_arm_cannot_do_is_refused(cell, q_rad) -> None:
    cell.order(1, q_rad)
    cell.run(0.1)
    assert cell.shown == (State.REFUSED, 1, Reason.OUT_OF_RANGE)


def test_a_speed_of_nothing_is_refused(cell) -> None:
    cell.order(1, speed_rad_s=0.0)
    cell.run(0.1)
    assert cell.shown == (State.REFUSED, 1, Reason.OUT_OF_RANGE)


@pytest.mark.parametrize(
    ("verb", "reason"),
    [("robot.protective_stop", Reason.PROTECTIVE_STOP), ("robot.emergency_stop", Reason.EMERGENCY_STOP)],
)
def test_safety_stops_end_a_move_and_refuse_the_next(cell, verb, reason) -> None:
    cell.order(1)
    cell.run(0.2)
    cell.bench.verbs[verb]()
    cell.run(0.5)
    assert cell.shown == (State.STOPPED, 1, reason)
    cell.order(2)
    cell.run(0.1)
    assert cell.shown == (State.REFUSED, 2, reason)


def test_a_stopped_program_leaves_its_registers_as_they_are(cell) -> None:
    before = cell.registers.get("life")
    cell.bench.verbs["robot.program"](on=False)
    cell.run(0.2)
    assert cell.registers.get("life") == before
    cell.bench.verbs["robot.program"](on=True)
    cell.run(0.2)
    assert cell.registers.get("life") != before
