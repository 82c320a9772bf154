"""What encoders report of their own health: emergencies, heartbeats, a restart that nobody ordered.

A heartbeat that stays away is found within one and a half periods, without blaming nodes for a pause of the host: time
counts only while the bus is heard, between two frames of anybody one and a half SYNCs, at most PAUSE_S. A host that
slept, an adapter that was held up, an emulator that fell behind shows as a gap and makes nobody late. A bus on which
nothing is heard at all is no question of heartbeats: then SYNC is without answer.

Nodes send heartbeats by their own clocks, so between two heartbeats of anybody at most a period has passed for them,
however long it took here: no more than that makes a single node late. Where nodes send one after another each of these
gaps counts, so a period is what the slowest of the others last took. Where no heartbeat comes at all, what remains
is how late this program itself was: each second of it excuses ALLOWED seconds, up to MOST periods. Measured with ten
busy loops on two cores: emulators answer every SYNC, and send their heartbeats at a third to a seventh of the rate.
"""

from collections.abc import Sequence

from drivers.cia406 import codec
from drivers.cia406.codec import Emergency, NmtState, emergency, heartbeat_state
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale

LATE = 1.5  # periods
PAUSE_S = 0.05  # longer than any node at 20 SYNCs a second is silent
SHORTEST_PAUSE_S = 0.02  # USB adapters may hand frames over in bursts, those of FTDI every 16 ms
ALLOWED = 10.0  # an emulator on a busy machine was seen at a seventh of its speed
MOST = 15.0  # periods
LATE_S = 0.002  # on a quiet machine a thread wakes within 0.3 ms


class Heartbeats:
    """Alive time since the last heartbeat of every node, from `begin` on.

    `busy_s`: how late this program woke, in sum (s), since the last heartbeat of anybody.
    """

    def __init__(self, nodes: Sequence[int], period_s: float, sync_s: float) -> None:
        """The periods (s) of heartbeats and of SYNC."""
        self._nodes = tuple(nodes)
        self._period_s = period_s
        self._pause_s = min(max(LATE * sync_s, SHORTEST_PAUSE_S), PAUSE_S)
        # `since_any`: since the last heartbeat of anybody, alive time as this host counts it
        self._alive_s = self._since_any_s = self.busy_s = 0.0
        self._looked_s: float | None = None
        self._heard_s: dict[int, float] = {}  # in alive time
        self._took_s: dict[int, float] = {}  # between the newest two heartbeats of a node, in alive time

    def begin(self, now_s: float) -> None:
        """All nodes start to send heartbeats now."""
        self._alive_s, self._looked_s = 0.0, now_s
        self._since_any_s = self.busy_s = 0.0
        self._heard_s = dict.fromkeys(self._nodes, 0.0)
        self._took_s = {}

    def woke(self, late_s: float) -> float:
        """A wait of this program ended so much later than it was to; returns what of it counts (s): from LATE_S on."""
        self.busy_s += (late_s := late_s if late_s > LATE_S else 0.0)
        return late_s

    def excuse(self) -> str:
        """The beginning of a remedy, where it may be this computer; else nothing."""
        text = f"this computer was busy for {self.busy_s:.1f} s, end other programs; else "
        return text if self.busy_s >= PAUSE_S else ""

    def look(self, now_s: float) -> None:
        """A frame came."""
        if self._looked_s is not None:
            step_s = min(max(now_s - self._looked_s, 0.0), self._pause_s)
            self._alive_s += min(step_s, max(self._period_s - self._since_any_s, 0.0))
            self._since_any_s += step_s
            self._looked_s = now_s

    def heard(self, node: int) -> None:
        if node in self._heard_s:
            self._took_s[node] = max(self._alive_s - self._heard_s[node], self._period_s)
            self._heard_s[node] = self._alive_s
            self._since_any_s = self.busy_s = 0.0

    def late(self) -> tuple[int, ...]:
        """Nodes whose heartbeat is overdue; each is reported once, and again after as long."""
        limit_s = LATE * self._period_s
        nobody = self._since_any_s > min(limit_s + ALLOWED * self.busy_s, MOST * self._period_s)
        if not nobody and self._alive_s - min(self._heard_s.values(), default=self._alive_s) <= limit_s:
            return ()  # no node's expected period is shorter
        found = tuple(n for n, s in self._heard_s.items() if nobody or self._alive_s - s > LATE * self._expected_s(n))
        for node in found:
            self.heard(node)
            del self._took_s[node]  # it was not heard
        return found

    def _expected_s(self, node: int) -> float:
        """The period in alive time, by the other nodes."""
        others_s = (took_s for other, took_s in self._took_s.items() if other != node)
        return min(max(others_s, default=self._period_s), MOST / LATE * self._period_s)


EMERGENCIES_KEPT = 256


class NodeWatch:
    """Takes every frame that is not a position. `codes` holds each node's last emergency code, 0 for none."""

    def __init__(self, name: str, nodes: Sequence[int], heartbeat_s: float, sync_s: float) -> None:
        """`heartbeat_s`: the period set at the nodes, `sync_s`: that of SYNC, in host time."""
        self.emergencies: tuple[Emergency, ...] = ()  # the newest EMERGENCIES_KEPT, in the order they came
        self.codes = tuple(0 for _ in nodes)
        self.bad_frames = 0
        self._name = name
        self._nodes = tuple(nodes)
        self._heard_s: dict[int, float] = {}  # last heartbeat
        self._operational = False
        self._started: set[int] = set()  # nodes that have reported that they are operational
        self.heartbeats = Heartbeats(nodes, heartbeat_s, sync_s)

    def set_operational(self, operational: bool, now_s: float) -> None:
        """From now on a boot-up, or another state than operational, is a fault; or no longer.

        Not the other states before a node has reported "operational": a heartbeat may cross the start command on its
        way.
        """
        self._operational = operational
        self._heard_s = {}
        self._started = set()
        self.heartbeats.begin(now_s)

    def check_heartbeats(self) -> None:
        """DeviceStale naming the nodes whose heartbeat stays away; call when nothing waits to be received."""
        busy = self.heartbeats.excuse()
        late = self.heartbeats.late() if self._operational else ()
        if late:
            raise DeviceStale(
                f"{self._name}: no heartbeat from encoder {', '.join(map(str, late))} for 1.5 periods; {busy}"
                "check its power and cable, and whether another master changed its 1017h"
            )

    def forget_codes(self) -> None:
        """Nodes were configured again: what they reported before is history."""
        self.codes = tuple(0 for _ in self._nodes)

    def take(self, can_id: int, data: bytes, now_s: float) -> None:
        """DeviceLost on a restart, DeviceRefused when a node was commanded to leave the operational state."""
        function, node = can_id & ~0x7F, can_id & 0x7F
        if node not in self._nodes:
            return
        if function == codec.EMERGENCY_ID:
            self._take_emergency(node, data, now_s)
        elif function == codec.HEARTBEAT_ID and self._operational:
            self._take_heartbeat(node, data, now_s)

    def heard_within(self, places: Sequence[int], limit_s: float, now_s: float) -> bool:
        """True when the heartbeat of every node at these places came within `limit_s`."""
        return all(now_s - self._heard_s.get(self._nodes[place], -limit_s) < limit_s for place in places)

    def _take_emergency(self, node: int, data: bytes, now_s: float) -> None:
        message = emergency(now_s, node, data)
        if message is None:
            self.bad_frames += 1
            return
        self.emergencies = (*self.emergencies, message)[-EMERGENCIES_KEPT:]
        at = self._nodes.index(node)
        self.codes = (*self.codes[:at], message.code, *self.codes[at + 1 :])

    def _take_heartbeat(self, node: int, data: bytes, now_s: float) -> None:
        state = heartbeat_state(data)
        self._heard_s[node] = now_s
        self.heartbeats.heard(node)
        if state is NmtState.BOOT_UP:
            raise DeviceLost(
                f"{self._name}: encoder {node} has restarted by itself (boot-up while operational); "
                "check its power supply and cable, then connect again"
            )
        if state is NmtState.OPERATIONAL:
            self._started.add(node)
        elif state is not None and node in self._started:
            raise DeviceRefused(
                f"{self._name}: encoder {node} is {state.name}, not operational; did another CANopen master stop it?"
            )
