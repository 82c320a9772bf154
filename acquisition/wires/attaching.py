"""Devices whose failures are all DeviceErrors, whatever library is below; and one that is attached again by itself.

The latter is for logs of days, in which a cable may be pulled and put back. A session does not use it: there a lost
device stops the arm, and a person decides.
"""

import logging
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from itertools import zip_longest

from drivers.clock import Clock
from drivers.device import Block, Channel, Device
from drivers.errors import DeviceError, DeviceLost, DeviceRefused, DeviceStale

log = logging.getLogger(__name__)


class Guarded:
    """A `Device` around another; drivers convert what they know, this converts what nobody foresaw."""

    def __init__(self, device: Device) -> None:
        self.name = device.name
        self._device = device

    def connect(self) -> None:
        with one_error_tree(self.name, "connecting"):
            self._device.connect()
        log.info("%s: connected", self.name)

    def describe(self) -> tuple[Channel, ...]:
        return self._device.describe()

    def read(self, timeout_s: float) -> Block:
        with one_error_tree(self.name, "reading"):
            return self._device.read(timeout_s)

    def close(self) -> None:
        with one_error_tree(self.name, "closing"):
            self._device.close()


@contextmanager
def one_error_tree(device: str, doing: str) -> Generator[None]:
    """DeviceStale for time-outs, DeviceLost for everything else that is no DeviceError yet; the cause is kept."""
    try:
        yield
    except DeviceError:
        raise
    except TimeoutError as error:
        raise DeviceStale(f"{device}: {doing}: no answer in time ({error}); check it, then connect again") from error
    except Exception as error:
        raise DeviceLost(
            f"{device}: {doing}: {type(error).__name__}: {error}; check power and cable, then connect again"
        ) from error


RETRY_S = 0.05  # a device that comes back is used within a second; a try on a port that is not there takes below 1 ms


class Reopening:
    """A `drivers.device.Device`. `lost` is informed of what went wrong and when; `back` from when to when it was away.

    `read` waits for the device as long as it takes; `give_up` or `close`, from another thread, ends that.
    """

    def __init__(
        self,
        device: Device,
        clock: Clock,
        lost: Callable[[DeviceError, float], None],
        back: Callable[[float, float], None],
        retry_s: float = RETRY_S,
        who: Callable[[], tuple[str, ...]] = tuple,
    ) -> None:
        """`who`: which instruments are connected, where they can report it; it must be the same after every outage."""
        self.name = device.name
        self._who = who
        self._were: tuple[str, ...] = ()
        self._retry_s = retry_s
        self._device, self._clock, self._lost, self._back = device, clock, lost, back
        self._closing = threading.Event()
        self._declared: tuple[Channel, ...] = ()

    def connect(self) -> None:
        """The first time it must be there: DeviceError as the device raises it."""
        self._device.connect()
        self._declared, self._were = self._device.describe(), self._who()

    def describe(self) -> tuple[Channel, ...]:
        return self._declared

    def read(self, timeout_s: float) -> Block:
        """DeviceRefused when another device has come back than the one that went."""
        while True:
            try:
                return self._device.read(timeout_s)
            except DeviceError as why:
                self._attach_again(why)

    def give_up(self) -> None:
        """Wait for the device no longer; a read that does raises what the device was lost by."""
        self._closing.set()

    def close(self) -> None:
        self.give_up()
        self._device.close()

    def _attach_again(self, why: DeviceError) -> None:
        from_s = self._clock.now_s()
        if self._closing.is_set():
            raise why
        self._lost(why, from_s)
        while not self._closing.wait(self._retry_s):
            try:
                self._device.close()
                self._device.connect()
            except DeviceError:
                continue  # what was lost is reported already; it stays lost
            self._check_same()
            self._back(from_s, self._clock.now_s())
            return
        raise why

    def _check_same(self) -> None:
        now = (*self._who(), *map(str, self._device.describe()))
        were = (*self._were, *map(str, self._declared))
        if now != were:
            changed = [f"{one} instead of {other}" for one, other in zip_longest(now, were) if one != other]
            raise DeviceRefused(
                f"{self.name}: came back as another device, {', '.join(changed)}; attach the one before, "
                "or begin a new log"
            )
