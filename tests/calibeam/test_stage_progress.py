import io
import threading

import pytest
from rich.console import Console

from calibeam.printing.progress import SHARES, Outlook, stages_shown
from calibrate.diagnose.stages import Stage


class Page(io.StringIO):
    """Text that says when something is written."""

    def __init__(self) -> None:
        super().__init__()
        self.written = threading.Event()

    def write(self, text: str) -> int:
        self.written.set()
        return super().write(text)


def test_time_left_is_said_from_the_first_second():
    outlook = Outlook(100.0, 300)

    assert outlook.text(100.4) == "faults of the file: 0 s gone, about 6 s left"


def test_time_left_follows_what_the_stages_before_took():
    outlook = Outlook(0.0, 300)
    done = SHARES[Stage.FAULTS] + SHARES[Stage.GEOMETRY]

    outlook.enter(Stage.SEARCH, 40.0)

    assert outlook.left_s(40.0) == pytest.approx(40.0 / done - 40.0)
    assert outlook.left_s(60.0) == pytest.approx(40.0 / done - 60.0)


def test_an_estimate_that_was_too_short_does_not_stand_still():
    outlook = Outlook(0.0, 300)
    outlook.enter(Stage.UNKNOWN, 20.0)
    ended = sum(SHARES[s] for s in (Stage.FAULTS, Stage.GEOMETRY, Stage.SEARCH, Stage.UNKNOWN))

    assert outlook.left_s(600.0) == pytest.approx(600.0 * (1.0 - ended) / ended)


def test_a_stage_that_takes_longer_leaves_time_for_those_to_come():
    outlook = Outlook(0.0, 300)
    outlook.enter(Stage.SEARCH, 20.0)

    late = outlook.left_s(1000.0)

    assert late > outlook.left_s(500.0) > 0.0


def test_without_a_terminal_short_work_prints_nothing():
    page = Page()

    with stages_shown(Console(file=page), 300) as begun:
        begun(Stage.PROOFS)

    assert page.getvalue() == ""


def test_without_a_terminal_a_line_comes_at_every_interval(monkeypatch):
    monkeypatch.setattr("calibeam.printing.progress.LINE_S", 0.001)
    page = Page()

    with stages_shown(Console(file=page, width=120), 300, lambda: 0.0) as begun:
        begun(Stage.SEARCH)
        assert page.written.wait(30.0)

    assert "0 s gone" in page.getvalue()
