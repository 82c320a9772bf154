"""What an engineer reads: in the terminal, on plain output, in the log, on the live page; and who is asked."""

import os
import threading
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from acquisition.errors import AcquisitionError
from acquisition.session.control import RunControl, RunEvent, RunState
from acquisition.session.records import Phase, Progress
from calibeam.asking import Asking
from calibeam.live.feed import SILENT
from calibeam.live.feed import Progress as PageProgress
from calibeam.sessions.keys import Keys
from calibeam.sessions.person import Person
from calibeam.sessions.reporter import ReportingJournal, StatusReporter
from calibeam.sessions.status import Forecast, Pace, SessionStatus, clock_words
from calibeam.sessions.views import KEYS, PageView, PlainView, TerminalView, drawn
from drivers.errors import DeviceLost

PATIENCE_S = 30.0


class Clock:
    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_s(self, seconds: float) -> None:
        self.time_s += seconds


class Kept:
    def sample(self, sample) -> None: ...

    def event(self, kind, detail) -> None: ...


class Heard:
    """A listener that keeps all."""

    def __init__(self) -> None:
        self.lines: list[tuple[str, bool]] = []
        self.shown: list[SessionStatus] = []

    def report(self, text: str, on_screen: bool) -> None:
        self.lines.append((text, on_screen))

    def shows(self, shown: SessionStatus) -> None:
        self.shown.append(shown)


def text_of(shown: SessionStatus, width: int = 80) -> str:
    console = Console(file=StringIO(), width=width)
    console.print(drawn(shown))
    return console.file.getvalue()


def progress(done: int = 3, phase: Phase = Phase.COLLECT, place: int = 1) -> Progress:
    return Progress(phase, done, 78, 0, place, 1)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def heard() -> Heard:
    return Heard()


@pytest.fixture
def reporter(rig, clock, heard) -> StatusReporter:
    return StatusReporter(rig, clock, (heard,))


@pytest.mark.parametrize(
    ("state", "large", "keys"),
    [
        (RunState.RUNNING, "MEASUREMENT", "SPACE pause"),
        (RunState.PAUSING, "PAUSING, THE ARM COMES TO REST", "SPACE stop the arm now"),
        (RunState.BREAKING, "STOPPING THE ARM", "a abort    h halt"),
        (RunState.PAUSED, "PAUSED, THE ARM STANDS", "r go on    s finish here    a abort    h halt"),
        (RunState.ABORTING, "ABORTING", "h halt"),
        (RunState.HALTED, "HALTED, THE ARM IS HELD", "h repeat the stop"),
        (RunState.ABORTED, "ABORTED, THE ARM STANDS", ""),
    ],
)
def test_the_view_says_in_capitals_what_goes_on_and_which_keys_serve(state, large, keys) -> None:
    text = text_of(
        SessionStatus(state, progress=progress(), left_s=1080.0, forecast=Forecast(5, 2e-5, 34e-6, 12, 1e-5))
    )
    assert large in text
    assert keys in text
    assert "3 of 78   18 min left" in text
    assert "34 µm; 12 more poses bring it under 20 µm" in text


def test_the_view_fits_a_terminal_of_eighty_columns(reporter, samples) -> None:
    journal = ReportingJournal(Kept(), reporter, lambda all_: None)
    reporter.state(RunState.RUNNING)
    reporter.progress(progress())
    for sample in samples[:9]:
        journal.sample(sample)
    lines = text_of(reporter.shown).splitlines()
    assert max(map(len, (line.rstrip() for line in lines))) <= 80
    assert len(lines) < 24
    assert sum("°" in line for line in lines) == 3  # six joints, two a line


@pytest.mark.parametrize("keys", KEYS.values(), ids=[state.name for state in KEYS])
def test_the_keys_fit_a_terminal_of_eighty_columns(keys) -> None:
    assert max(map(len, f"   {keys}".splitlines())) <= 80


def test_a_stop_that_does_not_reach_the_arm_is_the_largest_thing_on_the_screen(reporter, heard) -> None:
    reporter.asked("put the fixture at place 2")
    reporter.undelivered(DeviceLost("robot: no way to the controller"))
    text = text_of(reporter.shown)
    assert "STOP NOT DELIVERED, PRESS THE RED EMERGENCY STOP" in text
    assert "robot: no way to the controller" in text
    assert heard.lines[-1] == (
        "STOP NOT DELIVERED, PRESS THE RED EMERGENCY STOP: robot: no way to the controller",
        True,
    )
    reporter.undelivered(None)
    assert "NOT DELIVERED" not in text_of(reporter.shown)


def test_a_dark_face_is_said(reporter, samples) -> None:
    journal = ReportingJournal(Kept(), reporter, lambda all_: None)
    look = samples[0].look
    from dataclasses import replace

    dark = replace(look, psd2=replace(look.psd2, x_m=np.nan, y_m=np.nan))
    journal.sample(replace(samples[0], look=dark))
    assert "dark" in text_of(reporter.shown)


def test_who_is_asked_sees_nothing_else() -> None:
    text = text_of(
        SessionStatus(RunState.RUNNING, progress=progress(), asked="put the fixture at place 2, then press ENTER")
    )
    assert "YOUR TURN" in text
    assert "then press ENTER" in text
    assert "SPACE" not in text


def test_time_left_counts_only_when_the_arm_works(reporter, clock, samples) -> None:
    journal = ReportingJournal(Kept(), reporter, lambda all_: None)
    reporter.state(RunState.RUNNING)
    reporter.progress(progress(0))
    for sample in samples[:4]:
        clock.time_s += 10.0
        journal.sample(sample)
    reporter.state(RunState.PAUSED)
    clock.time_s += 3600.0
    reporter.state(RunState.RUNNING)
    reporter.asked("put the fixture there")
    clock.time_s += 3600.0
    reporter.asked("")
    reporter.progress(progress(4))
    assert reporter.shown.left_s == pytest.approx(74 * 10.0)


def test_the_first_poses_give_no_time(clock) -> None:
    pace = Pace(clock)
    pace.work(True)
    clock.time_s += 30.0
    pace.taken()
    assert pace.left_s(10) is None


@pytest.mark.parametrize(("seconds", "words"), [(2.0, "5 s"), (44.0, "45 s"), (90.0, "2 min"), (3900.0, "1 h 05 min")])
def test_times_are_reported_as_anybody_plans_by_them(seconds, words) -> None:
    assert clock_words(seconds) == words


def test_every_sample_and_everything_left_out_stands_in_the_log(reporter, heard, samples) -> None:
    journal = ReportingJournal(Kept(), reporter, lambda all_: None)
    reporter.progress(progress(0))
    journal.sample(samples[0])
    journal.event("skipped", {"placement": 1, "why": "no light, or saturated, when read"})
    journal.event("sample", {"pose": {}})
    assert heard.lines[1][0].startswith("pose 1 of 78: station 1, PSD 1 first, settled in 0.10 s; spots (")
    assert heard.lines[2] == ("pose left out at station 1: no light, or saturated, when read", True)
    assert len(heard.lines) == 3


def test_plain_output_is_a_line_every_ten_poses(heard) -> None:
    console = Console(file=StringIO(), width=200)
    view = PlainView(console)
    view.shows(SessionStatus(step="4 of 6  MEASURE"))
    for done in range(25):
        view.shows(SessionStatus(step="4 of 6  MEASURE", progress=progress(done), left_s=600.0))
    assert console.file.getvalue().splitlines() == [
        "4 of 6  MEASURE",
        "10 of 78 poses, about 10 min left",
        "20 of 78 poses, about 10 min left",
    ]


def test_the_page_is_reported_the_same_and_what_it_draws_by() -> None:
    class Feed(type(SILENT)):
        def __init__(self) -> None:
            self.shown_states: list[object] = []

        def progress(self, progress: PageProgress) -> None:
            self.shown_states.append(progress)

        def stands(self, placement: int, first_psd: int) -> None:
            self.shown_states.append((placement, first_psd))

        def believes(self, corrections) -> None:
            self.shown_states.append(corrections)

    feed = Feed()
    view = PageView(feed)
    shown = SessionStatus(
        RunState.RUNNING, progress=progress(), left_s=60.0, forecast=Forecast(5, 2e-5, corrections={"a": 1.0})
    )
    view.shows(shown)
    view.shows(shown)
    *once, last, again = feed.shown_states[:2] + feed.shown_states[2:]
    assert once == [(1, 1), {"a": 1.0}]
    assert last == again == PageProgress("measurement", 3, 78, 60.0, "accuracy: not determined yet: ")


def person(reporter, asking: Asking | None, *, agrees: bool) -> Person:
    return Person(Console(quiet=True), reporter, asking, agrees=agrees)


def test_where_nobody_can_be_asked_the_arm_does_not_move_without_yes(reporter) -> None:
    with pytest.raises(AcquisitionError, match="--yes"):
        person(reporter, None, agrees=False).arm()
    person(reporter, None, agrees=True).arm()


def test_a_script_gets_what_is_safe_and_nobody_puts_a_fixture_for_it(reporter) -> None:
    alone = person(reporter, None, agrees=True)
    assert alone.choose("does it stand?", {"y": "yes", "n": "no"}, "n", "n") == "n"
    with pytest.raises(AcquisitionError, match="nobody can be asked"):
        alone.place("put the fixture at place 2")


def test_the_question_for_the_fixture_is_on_the_screen_before_an_enter_counts(reporter, heard, typist) -> None:
    """Typed ahead, and typed while the question is being drawn: neither is an answer."""
    control = RunControl(lambda: None, changed=reporter.state)
    control.tell(RunEvent.START)
    asked = person(reporter, Asking(typist.terminal), agrees=False)
    typist.ahead("\n")
    typist.answers("then press ENTER", "\n")
    with Keys(control, typist.terminal) as keys, asked.at(keys):
        asker = threading.Thread(target=asked.place, args=("put the fixture at place 2",))
        asker.start()
        assert typist.shows("put the fixture at place 2, then press ENTER")
        while keys._question is None:
            asker.join(0.01)
        assert asker.is_alive()
        os.write(typist._ours, b"\n")
        asker.join(PATIENCE_S)
    assert not asker.is_alive()
    assert [shown.asked for shown in heard.shown][-2:] == ["put the fixture at place 2, then press ENTER", ""]


def test_what_a_person_is_asked_is_drawn_at_once(reporter) -> None:
    """Not at the next turn of the view, up to a quarter of a second later."""
    console = Console(file=StringIO(), width=80, force_terminal=True)
    view = TerminalView(console)
    with view.opened():
        view.shows(SessionStatus(asked="put the fixture at place 2"))
        assert "put the fixture at place 2" in console.file.getvalue()
