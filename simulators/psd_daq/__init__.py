"""The PSD box on its serial port: `emulator` is the box and its bench, `frames` the protocol."""
