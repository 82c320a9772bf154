"""The gate: set-points within the limits whoever interrupts, late cycles, an arm that is stopped in the end."""

from collections.abc import Callable

import numpy as np
import pytest

from acquisition.errors import InterruptedMotionError, RefusedMotionError
from acquisition.motion.cell import Box, Cell, body_points
from acquisition.motion.following import SetPointStream
from acquisition.motion.gate import Gate
from acquisition.motion.inverse.closed_form import closed_form
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.kinematics import transform
from acquisition.motion.paths.path import BeltState
from acquisition.motion.paths.segments import By, Pace, Place, Segment
from acquisition.motion.states import REST_S, MotionState
from drivers.errors import DeviceRefused
from tests.acquisition.motion.conftest import ur5e

SOLVER = Solver(ur5e(1e-3), closed_form(ur5e()))
HOME_RAD = np.array([0.3, -1.4, 1.6, -0.5, 1.3, 0.1])
HOME = SOLVER.flange(HOME_RAD)
PACE = Pace(np.full(6, 0.8), np.full(6, 4.0))
STREAM = SetPointStream(hz=100.0, solve_hz=50.0, rested_s=0.05)


class JumpingClock:
    """Time passes by sleeping only, and by `lose_s`."""

    def __init__(self) -> None:
        self.t_s = 0.0

    def now_s(self) -> float:
        return self.t_s

    def sleep_s(self, seconds: float) -> None:
        self.t_s += seconds


class Arm:
    """Keeps every set-point; `at_cycle` is called before each one."""

    def __init__(self, at_cycle: Callable[[int], None] = lambda n: None) -> None:
        self.q_rad: list[np.ndarray] = []
        self.stops: list[str] = []
        self.at_cycle = at_cycle

    def servo_joints(self, q_rad, period_s, lookahead_s, gain) -> None:
        self.at_cycle(len(self.q_rad))
        self.q_rad.append(q_rad)

    def servo_stop(self, deceleration_rad_s2) -> None:
        self.stops.append("servo_stop")

    def stop(self) -> None:
        self.stops.append("stop")


def there(*shift: float, action: str = "") -> list[Segment]:
    place = Place("there", HOME @ transform(shift), np.eye(4))
    stand = [Segment("act", By.STAND, place, 0.1, action=action)] if action else []
    return [Segment("there", By.LINE, place), *stand, Segment("back", By.JOINTS, Place("home", HOME, np.eye(4)))]


def gate_of(arm: Arm, clock: JumpingClock | None = None) -> Gate:
    return Gate(SOLVER, PACE, Cell(), arm, STREAM, clock or JumpingClock())


def largest_acceleration(arm: Arm) -> float:
    """By second differences over the periods of solution, between which set-points are interpolated."""
    solved = np.array([HOME_RAD] * 2 + arm.q_rad[:: int(STREAM.hz / STREAM.solve_hz)])
    return float(np.abs(np.diff(solved, 2, axis=0)).max() * STREAM.solve_hz**2)


def test_a_plan_is_followed_to_its_end_and_the_arm_stopped() -> None:
    arm = Arm()
    gate = gate_of(arm)
    made = gate.plan(HOME_RAD, there(0.1, 0.05, 0.0))
    followed = gate.run(made, HOME_RAD)
    assert gate.state is MotionState.DONE
    assert arm.stops == ["servo_stop"]
    assert followed.missed == 0
    np.testing.assert_allclose(arm.q_rad[-1], HOME_RAD, atol=1e-9)
    assert largest_acceleration(arm) <= 1.05 * PACE.acceleration_rad_s2[0]


@pytest.mark.parametrize("cycle", [1, 20, 45, 70, 100])
@pytest.mark.parametrize("ending", ["stop", "abort"])
def test_stopped_at_any_time_it_brakes_within_the_limit(cycle: int, ending: str) -> None:
    arm = Arm(lambda n: getattr(gate, ending)() if n == cycle else None)
    gate = gate_of(arm)
    made = gate.plan(HOME_RAD, there(0.15, 0.05, 0.0))
    if ending == "stop":
        gate.run(made, HOME_RAD)
        assert gate.state is MotionState.DONE
    else:
        with pytest.raises(InterruptedMotionError, match="aborted"):
            gate.run(made, HOME_RAD)
        assert gate.state is MotionState.ABORTED
    assert arm.stops == ["servo_stop"]
    longest_s = PACE.speed_rad_s[0] / PACE.acceleration_rad_s2[0]
    assert len(arm.q_rad) - cycle <= longest_s * STREAM.hz + 2
    # The path's own acceleration, then the brake's: each within the limit.
    assert largest_acceleration(arm) <= 2.0 * PACE.acceleration_rad_s2[0]


def test_a_brake_stays_on_the_straight_way() -> None:
    arm = Arm(lambda n: gate.stop() if n == 60 else None)
    gate = gate_of(arm)
    gate.run(gate.plan(HOME_RAD, there(0.2, 0.1, 0.05)), HOME_RAD)
    flange_m = SOLVER.arm.frames(np.array(arm.q_rad))[:, -1, :3, 3]
    braked_m = np.linalg.norm(flange_m[-1] - flange_m[60])
    assert braked_m > 0.01
    way_m = HOME[:3, :3] @ np.array([0.2, 0.1, 0.05])
    off_m = np.linalg.norm(np.cross(flange_m - HOME[:3, 3], way_m / np.linalg.norm(way_m)), axis=1)
    assert off_m.max() < 2e-5  # solutions 5 mm apart, between which joints are interpolated


def test_held_and_resumed_it_stays_on_the_path() -> None:
    def at(n: int) -> None:
        if n == 60:
            gate.hold()
        if n == 160:
            assert gate.state is MotionState.HELD
            gate.resume()

    arm = Arm(at)
    gate = gate_of(arm)
    made = gate.plan(HOME_RAD, there(0.15, 0.05, 0.0))
    gate.run(made, HOME_RAD)
    held = np.array(arm.q_rad[120:160])
    assert np.abs(held - held[0]).max() == 0.0
    assert gate.state is MotionState.DONE
    np.testing.assert_allclose(arm.q_rad[-1], HOME_RAD, atol=1e-9)
    nearest = [np.abs(made.q_rad - q).max(axis=1).min() for q in arm.q_rad]
    assert max(nearest) < 0.02  # samples of the plan are 20 ms apart, and joints make 0.8 rad/s


def test_paused_it_rests_at_the_next_action_and_twice_at_once() -> None:
    pressed, paused = list[int](), list[int]()

    def at(n: int) -> None:
        if not paused and gate.rests_in_s() < 0.5:
            paused.append(n)
            gate.pause()
        if gate.state is MotionState.HELD and len(arm.q_rad) > 40 and not pressed:
            pressed.append(n)
        if pressed and n == pressed[0] + 60:
            gate.resume()

    done: list[str] = []
    arm = Arm(at)
    gate = gate_of(arm)
    made = gate.plan(HOME_RAD, there(0.1, 0.0, 0.0, action="GRASP"))
    gate.run(made, HOME_RAD, act=done.append)
    assert done == ["GRASP"]
    assert len(pressed) == 1
    rest = np.array(arm.q_rad[pressed[0] + 30 : pressed[0] + 60])
    np.testing.assert_allclose(SOLVER.flange(rest[0])[:3, 3], (HOME @ transform((0.1, 0.0, 0.0)))[:3, 3], atol=1e-6)
    twice = Arm(lambda n: gate2.pause() if n in (10, 12) else gate2.stop() if n == 100 else None)
    gate2 = gate_of(twice)
    gate2.run(gate2.plan(HOME_RAD, there(0.1, 0.0, 0.0)), HOME_RAD)
    assert np.abs(np.diff(twice.q_rad[70:100], axis=0)).max() == 0.0


def test_a_pause_rests_where_the_program_says_stop() -> None:
    rested, paused = list[np.ndarray](), list[int]()

    def at(n: int) -> None:
        if not paused and gate.rests_in_s() < 0.5:
            paused.append(n)
            gate.pause()
        if gate.state is MotionState.HELD:
            rested.append(arm.q_rad[-1])
            if len(rested) == 30:
                gate.resume()

    arm = Arm(at)
    gate = gate_of(arm)
    first, *_, last = there(0.1, 0.0, 0.0, action="GRASP")
    gate.run(gate.plan(HOME_RAD, [first, Segment("stop", By.STAND, first.place), last]), HOME_RAD)
    np.testing.assert_allclose(SOLVER.flange(rested[-1])[:3, 3], first.place.pos[:3, 3], atol=1e-6)
    assert gate.state is MotionState.DONE


@pytest.mark.parametrize(("wait_s", "state"), [(5.0, MotionState.HELD), (12.0, MotionState.PAUSING)])
def test_a_second_pause_brakes_at_once_within_ten_seconds_only(wait_s: float, state: MotionState) -> None:
    clock, seen, near = JumpingClock(), list[MotionState](), list[int]()

    def at(n: int) -> None:
        if not near and gate.rests_in_s() > 0.5:
            return
        near.append(n)
        if len(near) in (1, 3):
            gate.pause()
        elif len(near) == 2:
            gate._paused_s -= wait_s
        elif len(near) == 4:
            seen.append(gate.state)
            gate.stop()

    gate = gate_of(Arm(at), clock)
    gate.run(gate.plan(HOME_RAD, there(0.15, 0.0, 0.0)), HOME_RAD)
    assert seen == [state]


def test_a_first_pause_far_from_the_next_rest_brakes_along_the_path() -> None:
    said: list[tuple[float, MotionState]] = []

    def at(n: int) -> None:
        if n == 10:
            said.append((gate.rests_in_s(), gate.state))
            gate.pause()
            said.append((gate.brake_s, gate.state))
        if n == 150:
            gate.stop()

    arm = Arm(at)
    gate = gate_of(arm)
    gate.run(gate.plan(HOME_RAD, there(0.4, 0.0, 0.0)), HOME_RAD)
    (left_s, _), (brake_s, state) = said
    assert left_s > REST_S > brake_s
    assert state is MotionState.HELD
    assert np.abs(np.diff(arm.q_rad[10 + int(np.ceil(brake_s * STREAM.hz)) : 150], axis=0)).max() == 0.0
    assert largest_acceleration(arm) <= 2.0 * PACE.acceleration_rad_s2[0]  # the path's own, and the brake's


class Conveyor:
    """A belt along y, whose way is told by the number of set-points sent."""

    def __init__(self, arm: Arm, way_m: Callable[[int], float]) -> None:
        self._arm, self._way_m = arm, way_m

    def now(self) -> BeltState:
        sent = len(self._arm.q_rad)
        return BeltState(self._way_m(sent), (self._way_m(sent + 1) - self._way_m(sent)) * STREAM.hz)

    @staticmethod
    def place(*shift: float) -> Place:
        return Place("part", HOME @ transform(shift), np.eye(4), lambda s_m: transform((0.0, s_m, 0.0)))


def test_the_hand_stays_with_its_belt_however_long_it_takes_to_grip() -> None:
    arm, gripped = Arm(), list[tuple[int, int]]()
    conveyor = Conveyor(arm, lambda sent: 2e-4 * sent)
    place = conveyor.place(0.05, 0.0, 0.0)

    def grip(action: str) -> None:
        begun = len(arm.q_rad)
        while len(arm.q_rad) < begun + 60:  # a stream that waits for the hand would wait for ever
            pass
        gripped.append((begun, begun + 60))

    gate = gate_of(arm)
    segments = [Segment("part", By.LINE, place), Segment("grip", By.STAND, place, action="GRASP")]
    gate.run(gate.plan(HOME_RAD, segments), HOME_RAD, conveyor.now, grip)
    for sent in gripped[0]:
        off_m = SOLVER.flange(arm.q_rad[sent])[:3, 3] - place.flange_at(2e-4 * sent)[:3, 3]
        assert np.linalg.norm(off_m) < 1e-3  # two periods are solved ahead by the belt's speed


def test_a_belt_that_runs_off_does_not_take_the_arm_beyond_its_speed() -> None:
    arm = Arm()
    conveyor = Conveyor(arm, lambda sent: 2e-4 * sent + max(0.0, 6e-3 * (sent - 60)))
    gate = gate_of(arm)
    made = gate.plan(HOME_RAD, [Segment("part", By.LINE, conveyor.place(0.05, 0.0, 0.0))])
    with pytest.raises(InterruptedMotionError, match=r"joint \d would run at .* of its speed; the arm was stopped"):
        gate.run(made, HOME_RAD, conveyor.now)
    assert arm.stops == ["stop"]
    assert np.abs(np.diff(arm.q_rad, axis=0)).max() * STREAM.hz <= 2.0 * PACE.speed_rad_s[0]


def test_a_belt_that_runs_out_of_reach_stops_the_arm() -> None:
    """No refusal, which a session would take for a pose that cannot be had: a motion was under way."""
    arm = Arm()
    conveyor = Conveyor(arm, lambda sent: 2e-4 * sent + max(0.0, 2e-2 * (sent - 60)))
    gate = gate_of(arm)
    made = gate.plan(HOME_RAD, [Segment("part", By.LINE, conveyor.place(0.05, 0.0, 0.0))])
    with pytest.raises(InterruptedMotionError, match=r"segment 1 'part' \(line\): .*; the arm was stopped"):
        gate.run(made, HOME_RAD, conveyor.now)
    assert arm.stops == ["stop"]


def test_a_belt_that_leads_into_a_keep_out_box_is_left_before_it() -> None:
    arm = Arm()
    conveyor = Conveyor(arm, lambda sent: -1e-3 * sent)
    x, y, z = HOME[:3, 3]
    cell = Cell(keep_out=(Box("pillar", (x - 0.2, y - 0.5, z - 0.3), (x + 0.2, y - 0.2, z + 0.3)),))
    gate = Gate(SOLVER, PACE, cell, arm, STREAM, JumpingClock())
    place = conveyor.place(0.02, 0.0, 0.0)
    made = gate.plan(HOME_RAD, [Segment("part", By.LINE, place), Segment("ride", By.STAND, place, 5.0)])
    with pytest.raises(InterruptedMotionError, match="keep-out box 'pillar'"):
        gate.run(made, HOME_RAD, conveyor.now)
    points = body_points(SOLVER.arm.frames(np.array(arm.q_rad)), ())
    assert cell.keep_out[0].distance_m(points).min() > cell.clearance_m - 2e-3


@pytest.mark.parametrize(("lost_s", "restarts"), [(0.036, 0), (0.205, 1)])
def test_missed_cycles_let_the_path_wait_and_after_a_silence_it_goes_on_from_rest(lost_s: float, restarts: int) -> None:
    clock = JumpingClock()

    def lose(n: int) -> None:
        clock.t_s += lost_s if n == 50 else 0.0

    arm = Arm(lose)
    gate = gate_of(arm, clock)
    followed = gate.run(gate.plan(HOME_RAD, there(0.1, 0.05, 0.0)), HOME_RAD)
    assert followed.missed == int((lost_s - 0.01) / 0.01)
    assert followed.worst_late_s == pytest.approx(lost_s - 0.01)
    assert followed.restarts == restarts
    way_rad = np.abs(np.diff(arm.q_rad, axis=0)).max(axis=1)
    assert way_rad.max() * STREAM.hz <= 1.05 * PACE.speed_rad_s[0]  # nothing is skipped
    assert (way_rad[50:53].max() < 1e-9) == bool(restarts)
    np.testing.assert_allclose(arm.q_rad[-1], HOME_RAD, atol=1e-9)


def test_a_stream_that_was_silent_too_long_is_given_up() -> None:
    clock = JumpingClock()

    def lose(n: int) -> None:
        clock.t_s += 1.2 if n == 50 else 0.0

    arm = Arm(lose)
    gate = gate_of(arm, clock)
    with pytest.raises(InterruptedMotionError, match="1190 ms late"):
        gate.run(gate.plan(HOME_RAD, there(0.1, 0.05, 0.0)), HOME_RAD)
    assert arm.stops == ["stop"]
    assert gate.state is MotionState.ABORTED


def test_halt_reaches_the_arm_in_every_state() -> None:
    arm = Arm(lambda n: gate.halt() if n == 30 else None)
    gate = gate_of(arm)
    gate.halt()
    assert arm.stops == ["stop"]
    with pytest.raises(InterruptedMotionError, match="halted"):
        gate.run(gate.plan(HOME_RAD, there(0.1, 0.05, 0.0)), HOME_RAD)
    assert arm.stops[:2] == ["stop", "stop"]
    assert len(arm.q_rad) == 31


def test_nothing_is_sent_after_a_halt_that_comes_while_a_set_point_waits_for_its_time() -> None:
    arm, clock = Arm(), JumpingClock()
    gate = gate_of(arm, clock)
    sent_at_halt: list[int] = []

    def sleep(seconds: float) -> None:
        clock.t_s += seconds
        if len(arm.q_rad) == 30 and not sent_at_halt:
            sent_at_halt.append(len(arm.q_rad))
            gate.halt()

    clock.sleep_s = sleep  # type: ignore[method-assign]
    with pytest.raises(InterruptedMotionError, match="halted"):
        gate.run(gate.plan(HOME_RAD, there(0.1, 0.05, 0.0)), HOME_RAD)
    assert len(arm.q_rad) == sent_at_halt[0]
    assert set(arm.stops) == {"stop"}


def test_a_set_point_that_is_refused_after_a_halt_is_the_halt() -> None:
    def halted(n: int) -> None:
        if n == 30:
            gate.halt()
            raise DeviceRefused("robot: the motion was ended by stop()")

    gate = gate_of(Arm(halted))
    with pytest.raises(InterruptedMotionError, match="halted"):
        gate.run(gate.plan(HOME_RAD, there(0.1, 0.05, 0.0)), HOME_RAD)


def test_a_stop_after_an_abort_makes_no_success_of_it() -> None:
    def at(n: int) -> None:
        if n == 40:
            gate.abort()
        if n == 42:
            gate.stop()

    gate = gate_of(Arm(at))
    with pytest.raises(InterruptedMotionError, match="aborted"):
        gate.run(gate.plan(HOME_RAD, there(0.15, 0.05, 0.0)), HOME_RAD)


@pytest.mark.parametrize("where", ["set-point", "action", "watch", "servo_stop"])
def test_interrupted_anywhere_the_arm_is_stopped(where: str) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    arm = Arm(interrupt if where == "set-point" else lambda n: None)
    if where == "servo_stop":
        arm.servo_stop = interrupt  # type: ignore[method-assign]
    gate = gate_of(arm)
    made = gate.plan(HOME_RAD, there(0.05, 0.0, 0.0, action="GRASP"))
    calls = {"act": interrupt} if where == "action" else {"watch": interrupt} if where == "watch" else {}
    with pytest.raises(KeyboardInterrupt):
        gate.run(made, HOME_RAD, **calls)
    assert arm.stops[-1] == "stop"


def test_what_was_not_planned_or_stands_at_another_place_is_refused() -> None:
    gate = gate_of(Arm())
    made = gate.plan(HOME_RAD, there(0.1, 0.0, 0.0))
    with pytest.raises(RefusedMotionError, match=r"joint 2 stands 2\.86° from where the plan begins"):
        gate.run(made, HOME_RAD + np.array([0.0, 0.05, 0.0, 0.0, 0.0, 0.0]))
    gate.plan(HOME_RAD, there(0.0, 0.1, 0.0))
    with pytest.raises(RefusedMotionError, match="not the last one"):
        gate.run(made, HOME_RAD)


@pytest.mark.parametrize("word", ["resume", "pause", "stop", "hold"])
@pytest.mark.parametrize("held", [True, False])
def test_nothing_is_sent_after_a_freeze_whatever_was_typed_in_it(word: str, held: bool) -> None:
    """The program is suspended for 5 s while it waits for the time of a set-point, moving or held."""
    clock, sent = JumpingClock(), list[int]()
    arm = Arm(lambda n: gate.hold() if held and n == 20 else None)
    gate = gate_of(arm, clock)

    def sleep(seconds: float) -> None:
        clock.t_s += seconds
        if len(arm.q_rad) == 60 and not sent:
            sent.append(len(arm.q_rad))
            assert gate.state is (MotionState.HELD if held else MotionState.MOVING)
            clock.t_s += 5.0
            getattr(gate, word)()

    clock.sleep_s = sleep  # type: ignore[method-assign]
    with pytest.raises(InterruptedMotionError, match="this program was suspended"):
        gate.run(gate.plan(HOME_RAD, there(0.15, 0.05, 0.0)), HOME_RAD)
    assert len(arm.q_rad) == sent[0]
    assert arm.stops == ["stop"]
    assert gate.state is MotionState.ABORTED
