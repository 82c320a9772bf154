"""What bytes and frames travel on: serial ports (`serial_port`) and CAN interfaces by python-can (`can_bus`: opening, a
tap that hears every frame, faults in one wording), with SLCAN over serial (`slcan_bus`, `slcan_stamps`). A device asks
for a `transport.Transport`, so that a test may pass its own.
"""
