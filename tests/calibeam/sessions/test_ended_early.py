"""However often a session and its clean-up are interrupted, and at whichever step: the arm is stopped in the end."""

from pathlib import Path

import pytest

from acquisition.errors import StoppedError
from acquisition.recording import RecordingError
from calibeam.devices.recorder import Earlier, kept
from calibeam.outcome import PartialResult
from drivers.errors import DeviceLost

STEPS = ("stop", "event", "flush")


class Trouble:
    """Bench, recording and session in one; `raises` says what each step does the first times it is made."""

    path = Path("recording.mcap")
    taken = 7

    def __init__(self, **raises: list[BaseException]) -> None:
        self.raises = raises
        self.done: list[str] = []

    def stop(self) -> None:
        self._make("stop")

    def event(self, event: object) -> None:
        self._make("event")

    def flush(self) -> None:
        self._make("flush")

    def now_s(self) -> float:
        return 1.0

    def _make(self, step: str) -> None:
        planned = self.raises.get(step, [])
        if planned:
            raise planned.pop(0)
        self.done.append(step)


def ended(trouble: Trouble, why: BaseException) -> str:
    def run() -> None:
        raise why

    with pytest.raises(PartialResult) as lines:
        kept(trouble, trouble, trouble, trouble, run)
    return str(lines.value)


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("times", [1, 3])
def test_a_clean_up_that_is_interrupted_begins_again_with_the_stop(step, times) -> None:
    trouble = Trouble(**{step: [KeyboardInterrupt() for _ in range(times)]})
    assert ended(trouble, KeyboardInterrupt()).startswith("Ctrl-C; samples kept in recording.mcap: 7")
    assert trouble.done[-3:] == ["stop", "event", "flush"]


@pytest.mark.parametrize("why", [StoppedError("the session was aborted"), DeviceLost("psd: gone"), KeyboardInterrupt()])
def test_whatever_ends_it_the_arm_is_asked_to_stop_first(why) -> None:
    trouble = Trouble()
    ended(trouble, why)
    assert trouble.done == ["stop", "event", "flush"]


def test_a_stop_that_cannot_be_delivered_is_said_and_the_samples_are_saved_all_the_same() -> None:
    trouble = Trouble(stop=[DeviceLost("robot: no way to the controller")])
    lines = ended(trouble, StoppedError("the session was aborted"))
    assert (
        "the stop command to the arm failed (robot: no way to the controller); check that the arm stands still" in lines
    )
    assert trouble.done == ["event", "flush"]


def test_a_disk_that_is_full_does_not_keep_the_arm_from_its_stop() -> None:
    trouble = Trouble(event=[RecordingError("disk full")])
    assert "disk full" in ended(trouble, DeviceLost("psd: gone"))
    assert trouble.done == ["stop"]


def test_what_ends_well_is_left_alone() -> None:
    trouble = Trouble()
    assert kept(trouble, trouble, trouble, trouble, lambda: 5) == 5
    assert trouble.done == []


def test_the_samples_of_the_whole_session_are_counted() -> None:
    trouble = Trouble()
    with pytest.raises(PartialResult) as lines:
        kept(trouble, trouble, trouble, trouble, _aborted, Earlier(Path("session-1"), 35))
    assert "samples kept in session-1: 42 (7 of them in recording.mcap); `calibeam identify session-1`" in str(
        lines.value
    )


def _aborted() -> None:
    raise StoppedError("the session was aborted")
