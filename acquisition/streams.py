"""One reader thread per device: every block goes to the recording and into a short memory that the servo looks at.

A thread ends in one of two ways: it is told to, or the device failed; then the failure is kept and told at once.
"""

import threading
from collections import deque
from collections.abc import Callable

from drivers.clock import Clock
from drivers.device import Block, Device
from drivers.errors import DeviceStale

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
        except Exception as failure:  # kept and told to the supervisor, whatever it was
            if not self._stopping.is_set():
                with self._news:
                    self.failure = failure
                    self._news.notify_all()
                self._failed(failure)
