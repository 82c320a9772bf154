"""What can go wrong at an instrument, as one short tree.

    DeviceError            the instrument's side: what, where, value, remedy in the message
    |-- DeviceLost         cable, power, process gone (also a ConnectionError)
    |-- DeviceStale        no new sample in time (also a TimeoutError)
    |-- DeviceRefused      it answered "no": its code and text
    `-- WireError          bytes that make no sense: offset and first bytes

Vendor exceptions are converted once, where the vendor library is called, with the cause kept.
"""


class DeviceError(Exception):
    """Base of all instrument errors; the message names the device, the place, the value and the remedy."""


class DeviceLost(DeviceError, ConnectionError):  # noqa: N818 - the field says "device lost"
    """The instrument cannot be reached any more: unplugged, without power, its process ended, port busy."""


class DeviceStale(DeviceError, TimeoutError):  # noqa: N818 - see above
    """The line is open but no new sample or answer came in time."""


class DeviceRefused(DeviceError):  # noqa: N818 - see above
    """The instrument understood and refused: protective stop, wrong mode, abort code, wrong identity."""


class WireError(DeviceError):
    """Bytes that are not of the protocol; the message holds the offset and the first 32 bytes."""
