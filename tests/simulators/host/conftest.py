"""A bench with one small instrument, and a host whose clock only moves when a test says so."""

import contextlib
from collections.abc import Callable, Iterator

import pytest

from simulators.host.loop import Host
from simulators.wire import Bench


class Diary:
    """World and instrument in one: writes down what is called, in order."""

    name = "diary"

    def __init__(self, time_s: float) -> None:
        self.time_s = time_s
        self.calls: list[tuple[str, float]] = []

    def before_step(self, t_s: float) -> None:
        self.calls.append(("before", t_s))

    def advance(self, until_s: float) -> None:
        self.time_s = until_s
        self.calls.append(("advance", until_s))

    def after_step(self, t_s: float) -> None:
        self.calls.append(("after", t_s))


class EchoWire:
    """Answers in capitals, streams what a test puts in `output`, and breaks on request."""

    def __init__(self) -> None:
        self.output = b""
        self.seen = b""
        self.closing = False

    def handle(self, data: bytes) -> bytes:
        self.seen += data
        if b"break" in data:
            raise RuntimeError("that was rubbish")
        if b"quit" in data:
            self.closing = True
        return data.upper()

    def due(self) -> bytes:
        data, self.output = self.output, b""
        return data


class Stage:
    """A host under test: `turns` serves it for a number of ticks of a clock that the test owns."""

    def __init__(self, bench: Bench, diary: Diary, time_scale: float = 1.0) -> None:
        self.now_s = 0.0
        self.logged: list[str] = []
        self.diary = diary
        self.host = Host(bench, diary, time_scale=time_scale, now_s=lambda: self.now_s, log=self.logged.append)

    def turns(self, count: int = 1) -> None:
        for _ in range(count):
            self.now_s = max(self.now_s, self.host.pace.next_s)
            self.host.turn(0.0)

    def until(self, happened: Callable[[], bool], limit: int = 2000) -> None:
        """Turns until it has happened; each waits up to 5 ms of real time for bytes of the kernel to arrive."""
        for _ in range(limit):
            if happened():
                return
            self.now_s = self.host.pace.next_s - 0.005  # not due yet: the turn waits for bytes
            self.host.turn(0.005)
            self.turns()
        raise AssertionError(f"did not happen within {limit} turns")


@pytest.fixture
def stage() -> Iterator[Callable[..., Stage]]:
    stages: list[Stage] = []

    def make(*ports, start_s: float = 0.0, time_scale: float = 1.0) -> Stage:
        diary = Diary(start_s)
        stages.append(Stage(Bench([diary], ports), diary, time_scale))
        return stages[-1]

    with contextlib.ExitStack() as cleanup:
        yield make
        for made in stages:
            cleanup.callback(made.host.close)


@pytest.fixture
def echo() -> type[EchoWire]:
    return EchoWire
