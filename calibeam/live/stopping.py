"""STOP: from any thread, in every state, as often as it is pressed; and what became of it."""

import threading
from collections.abc import Callable
from dataclasses import dataclass

from drivers.clock import Clock
from drivers.errors import DeviceError

NO_ARM = "nothing was stopped: no arm is connected to this page; press the red emergency stop if something moves"


@dataclass(frozen=True)
class Stopped:
    """What one STOP did. `delivered`: the controller took it."""

    host_s: float
    who: str
    delivered: bool
    says: str


class Stop:
    """Owns the way to the arm. Presses do not wait for each other: one that hangs keeps none from trying."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._how: Callable[[], None] | None = None
        self._telling = threading.Lock()
        self.last: Stopped | None = None

    def by(self, how: Callable[[], None] | None) -> None:
        """What to do from now on; it may raise DeviceError."""
        self._how = how

    @property
    def ready(self) -> bool:
        """Whether there is an arm."""
        return self._how is not None

    def press(self, who: str) -> Stopped:
        """Stop now; blocks until the controller has taken it, or until it is known that it does not."""
        how, host_s = self._how, self._clock.now_s()
        if how is None:
            return self._told(Stopped(host_s, who, delivered=False, says=NO_ARM))
        try:
            how()
        except DeviceError as error:
            says = f"NOT DELIVERED, press the red emergency stop now: {error}"
            return self._told(Stopped(host_s, who, delivered=False, says=says))
        return self._told(Stopped(host_s, who, delivered=True, says="the controller was told to stop, and took it"))

    def _told(self, stopped: Stopped) -> Stopped:
        with self._telling:
            if self.last is None or self.last.host_s <= stopped.host_s:
                self.last = stopped
        return stopped
