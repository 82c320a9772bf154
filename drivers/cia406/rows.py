"""From rows, one for each SYNC, to a block."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from drivers.cia406.cycle import Row
from drivers.device import Block


@dataclass(frozen=True)
class WatchedRow:
    """Positions with the state of things at that time: of every node, and of the bus."""

    row: Row
    emergency_codes: tuple[int, ...]
    slip_rad: tuple[float, ...]
    bus_errors: int


def to_block(rows: Sequence[WatchedRow]) -> Block:
    """One block of at least one row; device_s is when the SYNC was sent."""
    values = {
        "position_rad": np.array([each.row.position_rad for each in rows]),
        "emergency_code": np.array([each.emergency_codes for each in rows], dtype=np.uint16),
        "slip_rad": np.array([each.slip_rad for each in rows], dtype=np.float64),
        "bus_errors": np.array([each.bus_errors for each in rows], dtype=np.uint32),
    }
    return Block(
        host_s=np.array([each.row.arrived_s for each in rows]),
        device_s=np.array([each.row.sent_s for each in rows]),
        sequence=np.array([each.row.sequence for each in rows], dtype=np.int64),
        values=MappingProxyType(values),
    )
