"""Finding a heartbeat that stays away, within one and a half periods, without blaming nodes for a pause of the host.

Time counts only while the bus is heard: between two frames of anybody, at most PAUSE_S. A host that slept, an adapter
that was held up, an emulator that fell behind shows as a gap and makes nobody late. A bus on which nothing is heard at
all is no question of heartbeats: then SYNC is without answer.
"""

from collections.abc import Sequence

LATE = 1.5  # periods
PAUSE_S = 0.05  # longer than any node at 20 SYNCs a second is silent


class Heartbeats:
    """Alive time since the last heartbeat of every node, from `begin` on."""

    def __init__(self, nodes: Sequence[int], period_s: float) -> None:
        self._nodes = tuple(nodes)
        self._limit_s = LATE * period_s
        self._alive_s = 0.0
        self._looked_s: float | None = None
        self._heard_s: dict[int, float] = {}  # in alive time

    def begin(self, now_s: float) -> None:
        """All nodes start to send heartbeats now."""
        self._alive_s, self._looked_s = 0.0, now_s
        self._heard_s = dict.fromkeys(self._nodes, 0.0)

    def look(self, now_s: float) -> None:
        """A frame came."""
        if self._looked_s is not None:
            self._alive_s += min(max(now_s - self._looked_s, 0.0), PAUSE_S)
            self._looked_s = now_s

    def heard(self, node: int) -> None:
        if node in self._heard_s:
            self._heard_s[node] = self._alive_s

    def late(self) -> tuple[int, ...]:
        """Nodes whose heartbeat is overdue; each is told once, and again after as long."""
        found = tuple(node for node, heard_s in self._heard_s.items() if self._alive_s - heard_s > self._limit_s)
        for node in found:
            self._heard_s[node] = self._alive_s
        return found
