"""A classic CAN frame and how long it occupies the bus."""

from dataclasses import dataclass

STANDARD_STUFFED_BITS, EXTENDED_STUFFED_BITS = 34, 54  # header and CRC bits that are subject to stuffing
UNSTUFFED_BITS = 13  # CRC delimiter, acknowledge slot and delimiter, end of frame, pause


@dataclass(frozen=True)
class CanFrame:
    """`dlc` is the number of data bytes; a remote frame has a dlc and no data."""

    id: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False
    dlc: int = -1  # -1: as many as there are data bytes

    def __post_init__(self) -> None:
        if self.dlc < 0:
            object.__setattr__(self, "dlc", len(self.data))


def bus_bits(frame: CanFrame) -> float:
    """Bit times on the bus, pause included: exact without stuff bits, plus half of the most that stuffing can add.

    An 8-byte frame takes 111 to 135 bits; the number between depends on the data, here it is always 123.
    Source: R. I. Davis et al., "Controller Area Network (CAN) schedulability analysis: refuted, revisited and
    revised", Real-Time Systems 35, 2007, equation (1): C = g + 8 s + 13 + floor((g + 8 s - 1) / 4), g = 34 or 54.
    """
    stuffed = (EXTENDED_STUFFED_BITS if frame.extended else STANDARD_STUFFED_BITS) + 8 * len(frame.data)
    return stuffed + UNSTUFFED_BITS + 0.5 * ((stuffed - 1) // 4)
