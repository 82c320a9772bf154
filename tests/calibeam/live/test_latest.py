"""Readers tell, pages look: counts add up, the newest stays, nothing waits for anybody."""

import threading

from acquisition.wires.streams import Supervisor
from calibeam.live.feed import SILENT, Progress
from calibeam.live.health import LINES, Latest
from drivers.errors import DeviceLost


def test_samples_are_counted_and_missing_ones_too(latest, block) -> None:
    latest.heard("psd", block(0, 1, 2))
    latest.heard("psd", block(5, 6))
    latest.heard("psd", block(7, 9))
    heard = latest.of("psd")
    assert (heard.samples, heard.lost) == (7, 3)
    assert heard.block is not None
    assert heard.block.sequence[-1] == 9


def test_a_device_that_counts_anew_has_lost_nothing(latest, block) -> None:
    latest.heard("psd", block(1000, 1001))
    latest.heard("psd", block(0, 1))
    assert latest.of("psd").lost == 0


def test_a_lost_device_is_back_with_its_next_block(latest, block) -> None:
    latest.heard("robot", block(1))
    latest.lost("robot", "robot: power off")
    assert latest.of("robot").why == "robot: power off"
    assert latest.of("robot").samples == 1
    latest.heard("robot", block(2))
    assert latest.of("robot").why is None


def test_the_newest_lines_stay_in_order_whoever_says_them(latest) -> None:
    def talk(name: str) -> None:
        for k in range(LINES):
            latest.said(f"{name} {k}")

    threads = [threading.Thread(target=talk, args=(name,)) for name in "abc"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [line.number for line in latest.lines] == list(range(2 * LINES + 1, 3 * LINES + 1))


def test_a_session_without_a_page_tells_nobody(block) -> None:
    SILENT.heard("psd", block(1))
    SILENT.progress(Progress("collecting", 1, 2, 3.0))
    SILENT.stops_by(None)


def test_a_stop_holds_the_arm_even_after_another_failure() -> None:
    held: list[str] = []
    supervisor = Supervisor(lambda: held.append("held"))
    supervisor.failed(DeviceLost("psd: gone"))
    latest = Latest(_Still())
    latest.stops_by(lambda: supervisor.stop(DeviceLost("pressed")))
    assert latest.stop.press("a test").delivered
    assert held == ["held", "held"]
    assert str(supervisor.failure) == "psd: gone"


class _Still:
    def now_s(self) -> float:
        return 0.0

    def sleep_s(self, seconds: float) -> None: ...
