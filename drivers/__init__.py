"""Devices: bytes on a wire to SI units, one device a folder, imports of ours: none.

A device is a codec (bytes to values, no I/O) and a class with `connect`, `read`, `close` (`device.Device`); one that
reads a byte stream has deadline, liveness and close from `device.StreamDevice`. All that can fail is a
`errors.DeviceError` with device, place and remedy. A new device is a folder here, its emulator one in `simulators`.
"""
