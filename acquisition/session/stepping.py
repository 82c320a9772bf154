"""The loop of every driven session, step by step: between two steps it may be paused; a step broken off is done again.

What a step does at its instrument, and what follows from a pause, is the session's own: before two detectors
(`session`) and with a tracker (`tracked`). The bench that a person can interrupt keeps what was broken off by a pause
apart from what has failed.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench, Look
from acquisition.session.control import EndedEarlyError, RunControl, RunEvent
from acquisition.session.records import Journal

Floats = NDArray[np.float64]
Steps = Iterator[Callable[[], None]]
Taken = TypeVar("Taken")
DISPLACED_RAD = 1e-3  # as acquisition/motion/gate.py: an arm further away was moved meanwhile


class InterruptibleBench:
    """Implements acquisition.bench.Bench. Every call may raise BrokenOffError or StoppedError beside what it raises."""

    def __init__(self, bench: Bench, control: RunControl) -> None:
        self._bench, self._control = bench, control

    def move(self, q_rad: Floats) -> None:
        self._control.move(self._bench.move, q_rad)

    def look(self, dwell_s: float) -> Look:
        self._control.check()
        return self._bench.look(dwell_s)

    def place_fixture(self, placement: int) -> None:
        self._bench.place_fixture(placement)

    def stop(self) -> None:
        self._bench.stop()


@dataclass(frozen=True)
class Summary(Generic[Taken]):
    """What a session brought."""

    samples: tuple[Taken, ...]
    centring_steps: tuple[int, ...]  # motions of every run that reached its tolerance on a centred pose
    skipped: int  # poses without a valid reading or out of reach; why is in the journal


class DrivenSession(ABC, Generic[Taken]):
    """The only owner of what was taken. Stopping the arm after an error is the caller's."""

    def __init__(self, journal: Journal[Taken], control: RunControl) -> None:
        self._journal, self._control = journal, control
        self._samples: list[Taken] = []
        self._steps: list[int] = []
        self._skipped = 0

    @property
    def taken(self) -> int:
        """Samples so far, also after the session was cut short."""
        return len(self._samples)

    def _run(self, steps: Steps) -> Summary[Taken]:
        """Each step until it was done without being broken off. Raises what ends a session.

        The next step is asked for when the one before is done. A person may end it sooner: that is no failure, and
        the arm stays where it is.
        """
        self._control.tell(RunEvent.START)
        try:
            for act in steps:
                self._control.step(act, self._come_back, self._astray)
        except EndedEarlyError:
            self._journal.event("ended by a person", {"samples": self.taken})
        self._control.finish()
        return Summary(tuple(self._samples), tuple(self._steps), self._skipped)

    @abstractmethod
    def _come_back(self) -> None:
        """After a pause the arm may stand elsewhere: a motion was broken off, or a person has moved it."""

    def _astray(self) -> None:
        """A step was broken off: what was known of where the arm stands may be wrong."""

    def _keep(self, sample: Taken, detail: Mapping[str, Any]) -> None:
        self._samples.append(sample)
        self._journal.sample(sample)
        self._journal.event("sample", detail)

    def _skip(self, where: Mapping[str, Any], why: str) -> None:
        self._journal.event("skipped", {**where, "why": why})
        self._skipped += 1
