import io
import threading
from itertools import pairwise

import pytest
from rich.console import Console

from calibeam.printing.progress import Outlook, stages_shown
from calibrate.diagnose.stages import Stage


class Page(io.StringIO):
    """Text that says when something is written."""

    def __init__(self) -> None:
        super().__init__()
        self.written = threading.Event()

    def write(self, text: str) -> int:
        self.written.set()
        return super().write(text)


RECORDED = {  # when each stage began, in seconds, and the end
    "one cause": {"SEARCH": 2.3, "UNKNOWN": 9.4, "PREDICTION": 10.7, "SCATTER": 10.9, "SIZES": 12.6, "PROOFS": 13.3,
                  "FAR_ROWS": 13.9, "END": 14.2},
    "two causes, spots": {"SEARCH": 4.2, "UNKNOWN": 10.2, "PREDICTION": 12.5, "SCATTER": 24.0, "SIZES": 33.9,
                          "PROOFS": 39.8, "FAR_ROWS": 60.9, "END": 62.0},
    "nothing, a wire": {"SEARCH": 0.9, "UNKNOWN": 3.4, "PREDICTION": 4.6, "SCATTER": 4.7, "SIZES": 5.7, "PROOFS": 6.0,
                        "FAR_ROWS": 6.8, "END": 7.1},
}  # fmt: skip


@pytest.mark.parametrize("name", RECORDED)
@pytest.mark.parametrize("slower", [1.0, 8.0])
def test_what_is_left_lies_between_the_times_that_are_stated(name, slower):
    outlook, stages = Outlook(100.0), {k: 100.0 + slower * v for k, v in RECORDED[name].items()}
    times = list(stages.items())
    for (stage, begun_s), (_, ended_s) in pairwise(times):
        outlook.enter(Stage[stage], begun_s)
        for now_s in (begun_s, 0.5 * (begun_s + ended_s), ended_s):
            left = outlook.left_s(now_s)
            assert (left is None) is (stage == "SEARCH")
            if left is not None:
                assert left[0] <= stages["END"] - now_s + 1e-9 <= left[1] + 2e-9


def test_nothing_is_promised_before_the_search_has_ended():
    outlook = Outlook(0.0)
    outlook.enter(Stage.SEARCH, 4.0)
    assert outlook.text(10.0) == "search: 10 s gone; how much is left shows after the search"


def test_a_stage_that_takes_longer_leaves_more_for_those_to_come():
    outlook = Outlook(0.0)
    outlook.enter(Stage.UNKNOWN, 20.0)
    (least, most), (least_later, most_later) = outlook.left_s(500.0), outlook.left_s(1000.0)
    assert least_later > least > 0.0
    assert most_later > most > least


def test_a_range_is_stated_after_the_search():
    outlook = Outlook(0.0)
    outlook.enter(Stage.UNKNOWN, 60.0)
    assert outlook.text(60.0) == "unknown causes: 60 s gone, 15 s to 10 min left"
    outlook.enter(Stage.FAR_ROWS, 480.0)
    assert outlook.text(480.0) == "rows that no model explains: 8 min gone, 5 s to 3 min left"


def test_without_a_terminal_short_work_prints_nothing():
    page = Page()

    with stages_shown(Console(file=page)) as begun:
        begun(Stage.PROOFS)

    assert page.getvalue() == ""


def test_without_a_terminal_a_line_comes_at_every_interval(monkeypatch):
    monkeypatch.setattr("calibeam.printing.progress.LINE_S", 0.001)
    page = Page()

    with stages_shown(Console(file=page, width=120), lambda: 0.0) as begun:
        begun(Stage.SEARCH)
        assert page.written.wait(30.0)

    assert "0 s gone" in page.getvalue()
