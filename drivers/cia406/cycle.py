"""One SYNC and its answers, and when the next SYNC is due. No I/O: times and frames come in, rows come out.

An answer says nothing of the SYNC that it answers, so a SYNC goes out only when the previous one is answered or given
up: never two on the way. A deadline missed for that reason is left out and shows as a step of the sequence.
"""

import math
from dataclasses import dataclass

ANSWER_LIMIT_S = 0.1  # answers take some ms; measured with an emulator on a busy host: now and then 50 ms


@dataclass(frozen=True)
class Row:
    """Positions latched by one SYNC; NaN where a node did not answer in time."""

    sequence: int
    sent_s: float  # host clock: when the encoders latched
    arrived_s: float  # host clock: the last answer
    position_rad: tuple[float, ...]


class SyncCycle:
    """The schedule of SYNCs at fixed deadlines from `start_s`, and the answers to the one under way."""

    def __init__(self, nodes: int, period_s: float, start_s: float, first_sequence: int) -> None:
        self.late_answers = 0
        self._silent_since_s: dict[int, float] = {}  # when the first of the SYNCs unanswered in a row was sent
        self._nodes = nodes
        self._period_s = period_s
        self._start_s = start_s
        self._first = first_sequence
        self._next = 0  # deadline number
        self._number = 0  # of the SYNC under way
        self._open = False
        self._sent_s = self._arrived_s = start_s
        self._answers: dict[int, float] = {}
        self._in_doubt: set[int] = set()  # an answer of theirs may be to the SYNC before

    @property
    def next_sequence(self) -> int:
        """The lowest number that no row has yet."""
        return self._first + self._next

    @property
    def wakes_s(self) -> float:
        """When something is to be done without any frame coming: give up, or send the next SYNC."""
        return self._sent_s + ANSWER_LIMIT_S if self._open else self._start_s + self._next * self._period_s

    def sync_due(self, now_s: float) -> bool:
        return not self._open and now_s >= self.wakes_s

    def sent(self, now_s: float) -> None:
        """A SYNC went out: it takes the number of the last deadline that has passed."""
        self._number = max(self._next, math.floor((now_s - self._start_s) / self._period_s))
        self._next = self._number + 1
        self._open, self._sent_s, self._arrived_s = True, now_s, now_s
        self._answers.clear()

    def awaits(self, node: int) -> bool:
        """True when an answer of this node belongs to the SYNC under way; else it is counted as late."""
        awaited = self._open and node not in self._answers
        self.late_answers += not awaited
        return awaited

    def answer(self, node: int, position_rad: float, now_s: float) -> Row | None:
        """Takes a node's answer; the row, if any position, when it was the last missing."""
        self._answers[node] = math.nan if node in self._in_doubt else position_rad
        self._arrived_s = now_s
        self._silent_since_s.pop(node, None)
        return self._close() if len(self._answers) == self._nodes else None

    def give_up(self, now_s: float) -> Row | None:
        """Ends a SYNC that waited too long; the row, when it holds any position."""
        if not self._open or now_s < self.wakes_s:
            return None
        for node in set(range(self._nodes)) - self._answers.keys():
            self._silent_since_s.setdefault(node, self._sent_s)
        return self._close()

    def silent(self, limit_s: float, now_s: float) -> list[int]:
        """Nodes that answered nothing for `limit_s`; each is told once, and again after as long."""
        mute = sorted(node for node, since_s in self._silent_since_s.items() if now_s - since_s >= limit_s)
        for node in mute:
            self._silent_since_s[node] = now_s
        return mute

    def _close(self) -> Row | None:
        self._open = False
        self._in_doubt = set(range(self._nodes)) - self._answers.keys()
        positions = tuple(self._answers.get(node, math.nan) for node in range(self._nodes))
        if all(math.isnan(position_rad) for position_rad in positions):
            return None
        return Row(self._first + self._number, self._sent_s, self._arrived_s, positions)
