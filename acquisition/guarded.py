"""A device whose failures are all DeviceErrors, whatever library is below it."""

from collections.abc import Generator
from contextlib import contextmanager

from drivers.device import Block, Channel, Device
from drivers.errors import DeviceError, DeviceLost, DeviceStale


class Guarded:
    """A `Device` around another; drivers convert what they know, this converts what nobody foresaw."""

    def __init__(self, device: Device) -> None:
        self.name = device.name
        self._device = device

    def connect(self) -> None:
        with one_error_tree(self.name, "connecting"):
            self._device.connect()

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
