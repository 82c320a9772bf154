"""Pause, resume, stop, abort, halt from other threads, while a session waits at its checkpoint or for a motion."""

import threading

import pytest

from acquisition.errors import StoppedError
from acquisition.session.control import (
    PAUSE_AGAIN_S,
    REST_S,
    BrokenOffError,
    EndedEarlyError,
    RunControl,
    RunEvent,
    RunState,
)
from acquisition.session.stepping import InterruptibleBench
from drivers.errors import DeviceError, DeviceLost, DeviceRefused


class Clock:
    def __init__(self) -> None:
        self.time_s = 100.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_s(self, seconds: float) -> None:
        self.time_s += seconds


class Arm:
    """A bench whose motion takes until it is stopped, or let arrive."""

    def __init__(self) -> None:
        self.moving, self.stopped, self.arrive = threading.Event(), threading.Event(), threading.Event()
        self.begun = 0

    def move(self, q_rad: object) -> None:
        self.begun += 1
        self.moving.set()
        while not self.arrive.is_set():
            if self.stopped.wait(0.01):
                raise DeviceRefused("robot: the motion was ended by stop()")

    def look(self, dwell_s: float) -> None: ...

    def place_fixture(self, placement: int) -> None: ...

    def stop(self) -> None:
        self.stopped.set()


@pytest.fixture
def clock() -> Clock:
    return Clock()


def running(stop=lambda: None, clock=None, **more) -> RunControl:
    control = RunControl(stop, clock, **more)
    control.tell(RunEvent.START)
    return control


def in_thread(act) -> tuple[threading.Thread, list]:
    out: list = []

    def run() -> None:
        try:
            out.append(act())
        except Exception as error:
            out.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    return thread, out


def test_a_pause_waits_at_the_checkpoint_until_it_is_resumed(clock) -> None:
    paused = threading.Event()
    control = running(clock=clock, changed=lambda state: paused.set() if state is RunState.PAUSED else None)
    assert control.checkpoint() is False
    control.pause()
    thread, out = in_thread(control.checkpoint)
    assert paused.wait(10.0)
    assert thread.is_alive()
    control.resume()
    thread.join(10.0)
    assert out == [True]


@pytest.mark.parametrize(
    ("after_s", "state"), [(PAUSE_AGAIN_S, RunState.BREAKING), (PAUSE_AGAIN_S + 0.1, RunState.PAUSING)]
)
def test_a_second_pause_within_ten_seconds_is_at_once(clock, after_s, state) -> None:
    control = running(clock=clock)
    control.interrupt()
    clock.time_s += after_s
    control.interrupt()
    assert control.state is state


def test_a_pause_after_a_resume_is_a_first_one(clock) -> None:
    control = running(clock=clock)
    control.pause()
    control.resume()
    control.pause()
    assert control.state is RunState.PAUSING


def test_ctrl_c_while_paused_aborts(clock) -> None:
    control = running(clock=clock)
    control.pause()
    control.tell(RunEvent.CHECKPOINT)
    clock.time_s += PAUSE_AGAIN_S + 0.1
    control.interrupt()
    with pytest.raises(StoppedError, match="aborted"):
        control.checkpoint()


def test_stop_ends_at_the_checkpoint_and_not_before() -> None:
    control = running()
    control.stop()
    control.check()
    with pytest.raises(EndedEarlyError):
        control.checkpoint()


def test_a_device_that_fails_ends_the_pause() -> None:
    failed: list[Exception] = []
    paused = threading.Event()
    control = running(
        failure=lambda: failed[0] if failed else None,
        changed=lambda state: paused.set() if state is RunState.PAUSED else None,
    )
    control.pause()
    thread, out = in_thread(control.checkpoint)
    assert paused.wait(10.0)
    failed.append(DeviceLost("psd: gone"))
    thread.join(10.0)
    assert isinstance(out[0], DeviceLost)
    assert control.state is RunState.ABORTED


def test_a_motion_under_way_is_broken_off_by_the_second_pause_and_is_no_failure_of_the_arm() -> None:
    arm = Arm()
    control = running(arm.stop)
    thread, out = in_thread(lambda: InterruptibleBench(arm, control).move(None))
    assert arm.moving.wait(10.0)
    control.pause()
    assert not arm.stopped.is_set()
    control.pause()
    thread.join(10.0)
    assert isinstance(out[0], BrokenOffError)
    assert control.state is RunState.BREAKING


def test_no_motion_begins_while_the_arm_is_being_stopped() -> None:
    arm = Arm()
    control = running(arm.stop)
    control.tell(RunEvent.BREAK)
    with pytest.raises(BrokenOffError):
        InterruptibleBench(arm, control).move(None)
    assert arm.begun == 0


def test_a_stop_that_fell_before_the_motion_is_said_again() -> None:
    """The session had looked at the run control, and its motion was not sent yet when the arm was stopped."""
    arm = Arm()
    control = running(arm.stop)

    class Slips(Arm):
        def move(self, q_rad: object) -> None:
            control.tell(RunEvent.BREAK)
            arm.stopped.clear()  # nothing moved yet, so this stop ended nothing
            arm.move(q_rad)

    thread, out = in_thread(lambda: InterruptibleBench(Slips(), control).move(None))
    assert arm.moving.wait(10.0)
    control.insist()
    thread.join(10.0)
    assert isinstance(out[0], BrokenOffError)


def test_a_motion_that_arrived_as_it_was_broken_off_counts_as_broken_off() -> None:
    arm = Arm()
    control = running()
    thread, out = in_thread(lambda: InterruptibleBench(arm, control).move(None))
    assert arm.moving.wait(10.0)
    control.tell(RunEvent.BREAK)
    arm.arrive.set()
    thread.join(10.0)
    assert isinstance(out[0], BrokenOffError)


def test_a_failure_of_the_arm_stays_one() -> None:
    class Fails(Arm):
        def move(self, q_rad: object) -> None:
            raise DeviceRefused("robot: protective stop")

    with pytest.raises(DeviceRefused, match="protective"):
        InterruptibleBench(Fails(), running()).move(None)


def test_a_stop_that_cannot_be_delivered_is_kept_and_the_session_ends_all_the_same() -> None:
    def no_way() -> None:
        raise DeviceLost("robot: no way to the controller")

    control = running(no_way)
    control.abort()
    assert isinstance(control.trouble, DeviceLost)
    with pytest.raises(StoppedError):
        control.checkpoint()


def test_a_stop_that_cannot_be_delivered_is_reported_once_and_so_is_the_one_that_is() -> None:
    ways, lines = [DeviceLost("robot: gone"), DeviceLost("robot: gone")], list[DeviceError | None]()

    def stop() -> None:
        if ways:
            raise ways.pop()

    control = running(stop, undelivered=lines.append)
    control.tell(RunEvent.BREAK)
    for _ in range(3):
        control.insist()
    assert [str(trouble) for trouble in lines] == ["robot: gone", "None"]


@pytest.mark.parametrize(
    ("say", "how"),
    [(RunControl.abort, "hold"), (RunControl.halt, "hold"), (lambda control: control.tell(RunEvent.BREAK), "stop")],
)
def test_only_a_pause_lets_the_arm_move_again(say, how) -> None:
    done: list[str] = []
    control = running(lambda: done.append("stop"), hold_arm=lambda: done.append("hold"))
    say(control)
    control.insist()
    assert done == [how, how]


def test_a_stop_said_while_the_arm_is_being_stopped_does_not_take_that_back() -> None:
    stops: list[int] = []
    control = running(lambda: stops.append(1))
    control.tell(RunEvent.BREAK)
    control.stop()
    control.insist()
    assert len(stops) == 2
    with pytest.raises(BrokenOffError):
        control.check()


def test_an_abort_in_the_last_moment_is_no_success() -> None:
    control = running()
    control.abort()
    with pytest.raises(StoppedError):
        control.finish()


@pytest.mark.parametrize(("left_s", "eases"), [(0.0, False), (0.9 * REST_S, False), (1.1 * REST_S, True), (10.0, True)])
def test_a_pause_lets_a_short_motion_arrive_and_brakes_a_long_one_softly(clock, left_s, eases) -> None:
    eased, lines = threading.Event(), list[tuple[float, bool]]()
    control = running(
        lambda: pytest.fail("a first pause is soft"),
        clock,
        rests_in_s=lambda: left_s,
        ease_arm=eased.set,
        pausing=lambda rests_in_s, eased: lines.append((rests_in_s, eased)),
    )
    control.interrupt()
    assert lines == [(left_s, eases)]
    assert eased.wait(10.0 if eases else 0.0) is eases
    if eases:
        with pytest.raises(BrokenOffError):
            control.check()
    else:
        control.check()


def test_a_pause_while_the_session_ends_rests_the_arm_as_any_other(clock) -> None:
    eased = threading.Event()
    control = running(clock=clock, rests_in_s=lambda: 8.0, ease_arm=eased.set)
    control.stop()
    control.interrupt()
    assert control.state is RunState.PAUSING
    assert eased.wait(10.0)
    with pytest.raises(BrokenOffError):
        control.check(begins=True)


def test_a_motion_that_outlasts_its_pause_is_braked(clock) -> None:
    """An operator has slowed the arm down, or the motion had not begun yet when the pause was said."""
    eased, left_s = threading.Event(), [0.5]
    control = running(clock=clock, rests_in_s=lambda: left_s[0], ease_arm=eased.set)
    control.pause()
    control.insist()
    assert not eased.is_set()
    clock.time_s += REST_S + 0.1
    control.insist()
    assert eased.wait(10.0)


def test_no_motion_begins_in_a_pause() -> None:
    arm = Arm()
    control = running(arm.stop)
    control.pause()
    with pytest.raises(BrokenOffError):
        InterruptibleBench(arm, control).move(None)
    assert arm.begun == 0


def test_a_motion_braked_by_a_pause_is_broken_off_also_after_a_resume(clock) -> None:
    arm = Arm()
    control = running(arm.stop, clock, rests_in_s=lambda: 5.0)
    thread, out = in_thread(lambda: InterruptibleBench(arm, control).move(None))
    assert arm.moving.wait(10.0)
    control.pause()
    control.resume()
    thread.join(10.0)
    assert isinstance(out[0], BrokenOffError)
    assert control.checkpoint() is False
    control.check(begins=True)


@pytest.mark.parametrize(
    ("moves", "states"),
    [
        (True, [RunState.PAUSING, RunState.BREAKING, RunState.ABORTING, RunState.ABORTING]),
        (False, [RunState.PAUSED, RunState.PAUSED, RunState.ABORTED, RunState.ABORTED]),
    ],
)
def test_ctrl_c_again_and_again(clock, moves, states) -> None:
    """The second one finds an arm that stands already, or brakes it now; the third gives up."""
    control = running(clock=clock)
    for state in states:
        control.interrupt()
        if not moves:
            control.tell(RunEvent.CHECKPOINT)
        assert control.state is state
