"""What bytes and frames travel on: serial ports (`serial_port`), CAN interfaces by python-can (`can_interfaces`) with
SLCAN over serial (`slcan_bus`), a tap that hears every frame (`can_tap`), and their faults in one wording
(`can_faults`). A device asks for a `transport.Transport`, so that a test may pass its own.
"""
