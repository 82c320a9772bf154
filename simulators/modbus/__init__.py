"""A controller that is driven over Modbus, TCP or RTU, over the motion of simulators/ur.

`emulator` is the bench and the handshake, `register_map` which register holds what, `server` the protocol.
"""
