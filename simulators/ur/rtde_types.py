"""RTDE's data types and frame layout, the controller's side.

Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide", sections "Field names and associated types" and
"RTDE package format". Everything is big-endian and packed.
"""

import struct
from enum import IntEnum

HEADER = struct.Struct(">HB")  # size of the whole frame, type


class FrameType(IntEnum):
    """ASCII letters of the guide."""

    REQUEST_PROTOCOL_VERSION = 86  # V
    GET_CONTROLLER_VERSION = 118  # v
    TEXT_MESSAGE = 77  # M
    DATA_PACKAGE = 85  # U
    SETUP_OUTPUTS = 79  # O
    SETUP_INPUTS = 73  # I
    START = 83  # S
    PAUSE = 80  # P


STRUCT_CODES = {
    "BOOL": "?",
    "UINT8": "B",
    "UINT32": "I",
    "UINT64": "Q",
    "INT32": "i",
    "DOUBLE": "d",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
    "VECTOR6UINT32": "6I",
}
LENGTHS = {"VECTOR3D": 3, "VECTOR6D": 6, "VECTOR6INT32": 6, "VECTOR6UINT32": 6}  # every other type: one number


def frame(frame_type: FrameType, payload: bytes = b"") -> bytes:
    """One frame; a payload never exceeds 65532 bytes here, because the longest recipe is far shorter."""
    return HEADER.pack(HEADER.size + len(payload), frame_type) + payload
