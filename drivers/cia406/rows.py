"""From rows, one for each SYNC, to a block."""

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from drivers.cia406.cycle import Row
from drivers.device import Block

WatchedRow = tuple[Row, tuple[int, ...]]  # with the emergency codes of all nodes at that time


def to_block(rows: Sequence[WatchedRow]) -> Block:
    """One block of at least one row; device_s is when the SYNC was sent."""
    values = {
        "position_rad": np.array([row.position_rad for row, _ in rows]),
        "emergency_code": np.array([codes for _, codes in rows], dtype=np.uint16),
    }
    return Block(
        host_s=np.array([row.arrived_s for row, _ in rows]),
        device_s=np.array([row.sent_s for row, _ in rows]),
        sequence=np.array([row.sequence for row, _ in rows], dtype=np.int64),
        values=MappingProxyType(values),
    )
