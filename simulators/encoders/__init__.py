"""Six CiA 406 encoders on a CAN bus behind an slcan adapter, or encoders that send without a protocol.

`emulator` is the bench, `node` one encoder on the bus, with its object dictionary, SDO and PDO servers beside it.
"""
