"""One reader thread per device: every block goes to the recording and into a short memory that the servo reads.

A thread ends in one of two ways: it is asked to, or the device failed; then the failure is kept and passed on at once.
The supervisor stops the arm when any device fails or falls silent, and lets the session know at its next step.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

from drivers.clock import Clock, SystemClock
from drivers.device import Block, Device
from drivers.errors import DeviceError, DeviceStale

log = logging.getLogger(__name__)
log.addHandler(logging.NullHandler())  # as in acquisition/recording/mcap/writer.py
FROZEN_S = 1.0  # in which this program did nothing at all: stopped by a signal, or the machine hung
STALE_S = 1.0  # twice what a reader itself waits: this is for one that hangs in a library and reports nothing
LOOK_S = 0.05


@contextmanager
def in_thread(work: Callable[[threading.Event], None], name: str) -> Generator[None]:
    """Inside, `work` runs in a thread of its own; at the end its event is set, and it is waited for."""
    done = threading.Event()
    thread = threading.Thread(target=work, args=(done,), name=name, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


@dataclass(frozen=True)
class _Watched:
    name: str
    newest_s: Callable[[], float | None]
    since_s: float
    limit_s: float


class Supervisor:
    """Owns the first failure of a session. `hold_arm` must work from any thread, and refuse every later motion."""

    def __init__(self, hold_arm: Callable[[], None], clock: Clock | None = None) -> None:
        self._hold_arm = hold_arm
        self._clock: Clock = clock or SystemClock()
        self._lock = threading.Lock()
        self._watching, self._turned_s = 0, 0.0
        self._failure: Exception | None = None

    @property
    def failure(self) -> Exception | None:
        """The first one; a freeze of this program counts as one."""
        self._notice_freeze()
        return self._failure

    def failed(self, failure: Exception) -> None:
        """A device, or the recording, cannot go on: stop the arm now; later failures are followers of the first.

        Called from reader threads, so it never raises: an arm that does not take the stop is reported by the session,
        which stops it again.
        """
        with self._lock:
            first, self._failure = self._failure is None, self._failure or failure
        if first:
            with suppress(DeviceError):
                self._hold_arm()
            log.warning("the arm was stopped: %s", failure)

    def stop(self, why: Exception) -> None:
        """A person commands it, from any thread and in every state: the arm is held, whatever was before.

        DeviceError when the stop cannot be delivered; the session ends all the same, at its next step.
        """
        with self._lock:
            self._failure = self._failure or why
        try:
            self._hold_arm()
        finally:  # the arm first, then the log
            log.warning("STOP: %s", why)

    def check(self) -> None:
        """Raise the first failure, if there was one; called before every motion."""
        failure = self.failure
        if failure is not None:
            raise failure

    @contextmanager
    def watching(self, name: str, newest_s: Callable[[], float | None], limit_s: float = STALE_S) -> Generator[None]:
        """Inside, the arm is stopped when the newest sample (host time; None: none yet) is older than the limit."""
        watched = _Watched(name, newest_s, self._clock.now_s(), limit_s)
        with self._lock:
            self._turned_s = self._turned_s if self._watching else self._clock.now_s()
            self._watching += 1
        try:
            with in_thread(lambda done: self._watch(watched, done), f"watch {name}"):
                yield
        finally:
            with self._lock:
                self._watching -= 1

    def look(self, watched: _Watched) -> bool:
        """Whether the samples are fresh enough; fails the session when they are not."""
        newest_s = watched.newest_s()
        age_s = self._clock.now_s() - (watched.since_s if newest_s is None else newest_s)
        if age_s <= watched.limit_s:
            return True
        self.failed(
            DeviceStale(f"{watched.name}: its newest sample is {age_s:.2f} s old, {watched.limit_s:.2f} s are allowed")
        )
        return False

    def _watch(self, watched: _Watched, done: threading.Event) -> None:
        while not done.wait(LOOK_S) and self.failure is None and self.look(watched):
            pass

    def _notice_freeze(self) -> None:
        """Whoever comes first after it notices: a watching thread, or the session before its next motion."""
        now_s = self._clock.now_s()
        with self._lock:
            gap_s, self._turned_s = now_s - self._turned_s, now_s
            frozen = bool(self._watching) and gap_s > FROZEN_S
        if frozen:
            self.failed(
                DeviceStale(
                    f"this program did not run for {gap_s:.1f} s (it was stopped, or the machine hung); the arm is "
                    "held, and nothing that was asked for before is carried out"
                )
            )


Sink = Callable[[Block], None]


class Pump:
    """Reads one device until stopped. `failed` is called once, from the reader thread, with what went wrong."""

    def __init__(
        self,
        device: Device,
        clock: Clock,
        sink: Sink,
        failed: Callable[[Exception], None],
        *,
        stale_s: float = 0.5,
        memory: int = 400,
    ) -> None:
        self._device, self._clock, self._sink, self._failed = device, clock, sink, failed
        self._stale_s = stale_s
        self._blocks: deque[Block] = deque(maxlen=memory)
        self._news = threading.Condition()
        self._stopping = threading.Event()
        self.failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, name=f"read {device.name}", daemon=True)

    def start(self) -> None:
        """The device must be connected."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread and close the device; safe to call again and in every state."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(timeout=2.0 * self._stale_s + 1.0)
        self._device.close()

    def recent(self, after_host_s: float) -> list[Block]:
        """Blocks of the memory that arrived after this host time, oldest first."""
        newest_first: list[Block] = []
        with self._news:
            for block in reversed(self._blocks):  # they arrived in order: mostly few are wanted of many
                if block.host_s[-1] <= after_host_s:
                    break
                newest_first.append(block)
        return newest_first[::-1]

    def latest(self) -> Block | None:
        with self._news:
            return self._blocks[-1] if self._blocks else None

    def wait(self, after_host_s: float, timeout_s: float) -> list[Block]:
        """Blocks that arrived after this host time; waits for one. Raises the device's failure, or DeviceStale."""
        with self._news:
            arrived = self._news.wait_for(lambda: self.failure or self._newer(after_host_s), timeout_s)
        if self.failure is not None:
            raise self.failure
        if not arrived:
            raise DeviceStale(f"{self._device.name}: no sample for {timeout_s:.2f} s; check its cable and power")
        return self.recent(after_host_s)

    def _newer(self, after_host_s: float) -> bool:
        return bool(self._blocks) and bool(self._blocks[-1].host_s[-1] > after_host_s)

    def _run(self) -> None:
        try:
            while not self._stopping.is_set():
                block = self._device.read(self._stale_s)
                with self._news:
                    self._blocks.append(block)
                    self._news.notify_all()
                self._sink(block)
        except Exception as failure:  # kept and handed to the supervisor, whatever it was
            if not self._stopping.is_set():
                with self._news:
                    self.failure = failure
                    self._news.notify_all()
                self._failed(failure)
