"""The PSD box on its serial port: `daq` is the box, `frames` its protocol, `emulator` the bench."""
