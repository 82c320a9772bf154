"""The objects of CiA 301 and CiA 406 that the driver uses, by their place in the dictionary."""

from enum import IntEnum, IntFlag

DEVICE_TYPE = 0x1000
ERROR_REGISTER = 0x1001
STORE = 0x1010
HEARTBEAT_MS = 0x1017
IDENTITY = 0x1018
TPDO2_COMMUNICATION, TPDO2_MAPPING = 0x1801, 0x1A01
OPERATING_PARAMETERS = 0x6000
UNITS_PER_TURN, RANGE_UNITS = 0x6001, 0x6002
PRESET = 0x6003
POSITION = 0x6004
TURN_RESOLUTION, TURNS = 0x6501, 0x6502

PROFILE = 0x0196  # low word of 1000h: 406, encoders
PDO_INVALID = 1 << 31
SAVE = int.from_bytes(b"save", "little")  # 1010h:01
EVERY_SYNC = 1  # transmission type
EMERGENCY_ID, TPDO2_ID, HEARTBEAT_ID, SYNC_ID = 0x080, 0x280, 0x700, 0x080


class Operating(IntFlag):
    """Bits of 6000h."""

    COUNTER_CLOCKWISE = 0x0001  # position rises with counter-clockwise turning; else with clockwise
    SCALING = 0x0004  # 6001h and 6002h are in force


class NmtState(IntEnum):
    """What a heartbeat says (CiA 301, 7.2.8.3)."""

    BOOT_UP = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


EMERGENCY_TEXTS = {  # CiA 301 table 26 and encoder manuals (Baumer, SICK, POSITAL)
    0x0000: "no error any more",
    0x1000: "generic error",
    0x4200: "temperature",
    0x5010: "sensor error",
    0x5020: "sensor error",
    0x5530: "EEPROM",
    0x6010: "software reset by watchdog",
    0x7320: "position error",
    0x7510: "internal communication",
    0x8110: "CAN overrun",
    0x8120: "CAN error passive",
    0x8130: "heartbeat or life guard missing",
    0x8140: "recovered from bus off",
    0x8210: "PDO not processed, length",
    0x8220: "PDO too long",
    0xFF00: "vendor specific, often battery low",
}
