"""Two KPA101 position detectors on serial ports: `emulator` is the bench with its units and the protocol."""
