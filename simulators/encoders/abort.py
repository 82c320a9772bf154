"""Why an SDO server breaks a transfer off: the abort codes of CiA 301 (4.2.0, table 22)."""

from enum import IntEnum


class AbortCode(IntEnum):
    """What the server answers in the last four bytes."""

    TOGGLE = 0x05030000
    UNKNOWN_COMMAND = 0x05040001
    WRITE_ONLY = 0x06010001
    READ_ONLY = 0x06010002
    NO_OBJECT = 0x06020000
    NOT_MAPPABLE = 0x06040041
    PDO_TOO_LONG = 0x06040042
    WRONG_LENGTH = 0x06070010
    NO_SUBINDEX = 0x06090011
    INVALID_VALUE = 0x06090030
    TOO_HIGH = 0x06090031
    TOO_LOW = 0x06090032
    NOT_STORED = 0x08000020
    WRONG_STATE = 0x08000022


class SdoAbort(Exception):  # noqa: N818 - the field's term
    """Refuses an access to the object dictionary."""

    def __init__(self, code: AbortCode) -> None:
        super().__init__(f"SDO abort 0x{code:08X} {code.name}")
        self.code = code
