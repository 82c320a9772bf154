"""Readings of all encoders over a short time."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Window:
    """In the order of time."""

    t_s: Floats  # (sample,) of the encoders' own time
    host_s: Floats  # (sample,)
    q_rad: Floats  # (sample, n)

    def __len__(self) -> int:
        return len(self.t_s)

    def last(self, seconds: float) -> "Window":
        """The end of it."""
        keep = self.t_s >= self.t_s[-1] - seconds
        return Window(self.t_s[keep], self.host_s[keep], self.q_rad[keep])


class EncoderWatch(Protocol):
    """The encoders as they come in, wired or not."""

    def next(self, seconds: float) -> Window:
        """Waits for a new sample; then the newest `seconds` of rows with all encoders. DeviceError, RecordingError."""
        ...
