"""SYNCs and their answers, and when the next SYNC is due. No I/O: times and frames come in, rows and blocks come out.

An answer does not name the SYNC that it answers: a node's answers belong to the SYNCs in their order. That is certain
only when in the end each node has answered as often as it was asked. So rows are held until nothing is on the way any
more, which between two SYNCs of a quick bus is always; where it is not, no SYNC goes out after HOLD_S until it is. When
answers are missing then, what that node sent since is uncertain and becomes NaN. A deadline left out shows as a step of
the sequence.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from drivers.device import Block

ANSWER_LIMIT_S = 0.1  # answers take some ms; measured with an emulator on a busy host: now and then 50 ms
HOLD_S = 0.1  # rows are reported no later than this, and what waits for the file is no more
MOST_UNDER_WAY = 16  # feels right: 16 ms at 1 kHz, which is more than a USB adapter keeps back


class Row(NamedTuple):  # and no dataclass, which takes four times as long to make
    """Positions latched by one SYNC; NaN where a node did not answer in time."""

    sequence: int
    sent_s: float  # host clock: when the encoders latched
    arrived_s: float  # host clock: the last answer
    position_rad: tuple[float, ...]


@dataclass(slots=True)
class _Sync:
    """One that was sent."""

    number: int
    sent_s: float
    arrived_s: float
    answers: dict[int, float] = field(default_factory=dict[int, float])


class SyncCycle:
    """The schedule of SYNCs at fixed deadlines from `start_s`, and the answers to those under way."""

    def __init__(self, nodes: int, period_s: float, start_s: float, first_sequence: int) -> None:
        self.late_answers = 0
        self._silent_since_s: dict[int, float] = {}  # when the first of the SYNCs unanswered in a row was sent
        self._nodes = nodes
        self._period_s = period_s
        self._start_s = start_s
        self._first = first_sequence
        self._next = 0  # deadline number
        self._under_way: deque[_Sync] = deque()  # not answered by all
        self._answered: list[_Sync] = []  # by all, but since the last moment at which nothing was under way
        self._busy_since_s = start_s
        self._uncertain: set[int] = set()  # an answer of theirs may be to an earlier SYNC
        self.wakes_s = start_s  # when something is to be done without any frame coming: give up, or the next SYNC

    def sequence_at(self, now_s: float) -> int:
        """Number of the first deadline after `now_s`, for a schedule that goes on after this one; 0 if it sent none."""
        if self._next == 0:
            return self._first
        return self._first + max(self._next, math.ceil((now_s - self._start_s) / self._period_s))

    def sync_due(self, now_s: float) -> bool:
        return now_s >= self._due_s and (not self._under_way or self._has_room)

    def sent(self, now_s: float) -> None:
        """A SYNC went out: it takes the number of the last deadline that has passed."""
        if not self._under_way:
            self._busy_since_s = now_s
        number = max(self._next, math.floor((now_s - self._start_s) / self._period_s))
        self._next = number + 1
        self._under_way.append(_Sync(number, now_s, now_s))
        self._plan()

    def awaits(self, node: int) -> bool:
        """True when an answer of this node belongs to a SYNC under way; else it is counted as late."""
        if self._under_way and node not in self._under_way[-1].answers:
            return True
        self.late_answers += 1
        return False

    def answer(self, node: int, position_rad: float, now_s: float) -> tuple[Row, ...]:
        """Takes an answer that was awaited; all rows that are certain now, when it was the last missing."""
        for sync in self._under_way:  # the first that this node has not answered
            if node not in sync.answers:
                break
        else:
            return ()
        sync.answers[node] = math.nan if self._uncertain and node in self._uncertain else position_rad
        sync.arrived_s = now_s
        if self._silent_since_s:
            self._silent_since_s.pop(node, None)
        if len(self._under_way[0].answers) < self._nodes:
            return ()
        while self._under_way and len(self._under_way[0].answers) == self._nodes:
            self._answered.append(self._under_way.popleft())
        if not self._under_way:
            return self._close(set())
        self._plan()
        return ()

    def give_up(self, now_s: float) -> tuple[Row, ...]:
        """Ends the wait for answers, if it was too long; the rows that hold any position.

        To be called only when no frame waits to be taken: else what is late is the reader.
        """
        if not self._under_way or now_s < self._under_way[0].sent_s + ANSWER_LIMIT_S:
            return ()
        for sync in self._under_way:
            for node in set(range(self._nodes)) - sync.answers.keys():
                self._silent_since_s.setdefault(node, sync.sent_s)
        return self._close(set(range(self._nodes)) - self._under_way[-1].answers.keys())

    def silent(self, limit_s: float, now_s: float) -> list[int]:
        """Nodes that answered nothing for `limit_s`; each is reported once, and again after as long."""
        if not self._silent_since_s:
            return []
        mute = sorted(node for node, since_s in self._silent_since_s.items() if now_s - since_s >= limit_s)
        for node in mute:
            self._silent_since_s[node] = now_s
        return mute

    @property
    def _due_s(self) -> float:
        return self._start_s + self._next * self._period_s

    @property
    def _has_room(self) -> bool:
        """Whether the next SYNC may go out at its time while answers are on the way."""
        held_s = self._due_s - self._busy_since_s
        return not self._uncertain and held_s < HOLD_S and len(self._under_way) < MOST_UNDER_WAY

    def _close(self, short: set[int]) -> tuple[Row, ...]:
        """Nothing is under way any more; `short` are the nodes that answered too seldom, so that none of it counts."""
        syncs = [*self._answered, *self._under_way]
        self._answered, self._uncertain = [], short
        self._under_way.clear()
        rows: list[Row] = []
        for sync in syncs:
            positions = tuple([math.nan if n in short else sync.answers.get(n, math.nan) for n in range(self._nodes)])
            if not all(map(math.isnan, positions)):
                rows.append(Row(self._first + sync.number, sync.sent_s, sync.arrived_s, positions))
        self._plan()
        return tuple(rows)

    def _plan(self) -> None:
        """Kept, not asked for: it is looked at with every frame, and changes with few."""
        if not self._under_way:
            self.wakes_s = self._due_s
            return
        gives_up_s = self._under_way[0].sent_s + ANSWER_LIMIT_S
        self.wakes_s = min(gives_up_s, self._due_s) if self._has_room else gives_up_s


class WatchedRow(NamedTuple):
    """Positions with the state of things at that time: of every node, and of the bus."""

    row: Row
    emergency_codes: tuple[int, ...]
    slip_rad: tuple[float, ...]
    bus_errors: int


def to_block(rows: Sequence[WatchedRow]) -> Block:
    """One block of at least one row; device_s is when the SYNC was sent."""
    values = {
        "position_rad": np.array([each.row.position_rad for each in rows]),
        "emergency_code": np.array([each.emergency_codes for each in rows], dtype=np.uint16),
        "slip_rad": np.array([each.slip_rad for each in rows], dtype=np.float64),
        "bus_errors": np.array([each.bus_errors for each in rows], dtype=np.uint32),
    }
    return Block(
        host_s=np.array([each.row.arrived_s for each in rows]),
        device_s=np.array([each.row.sent_s for each in rows]),
        sequence=np.array([each.row.sequence for each in rows], dtype=np.int64),
        values=MappingProxyType(values),
    )
