"""Digital outputs of a UR controller through ur_rtde's I/O interface, which leaves a running program alone.

    outputs = UrOutputs("192.168.0.10"); outputs.connect(); outputs.switch(3, True); outputs.close()

Numbers are the bits of `actual_digital_output_bits` (RTDE guide): 0 to 7 standard, 8 to 15 configurable, 16 and 17 of
the tool. Whether an output has switched is in the controller's stream, not here.
"""

import importlib
from typing import Any

from drivers.errors import DeviceLost, DeviceRefused

# First bit of each kind, and what ur_rtde calls it.
KINDS = ((16, "setToolDigitalOut"), (8, "setConfigurableDigitalOut"), (0, "setStandardDigitalOut"))
LAST = 17


class UrOutputs:
    """One thread switches."""

    def __init__(self, host: str, *, name: str = "robot") -> None:
        self.name = name
        self._host = host
        self._io: Any = None  # rtde_io.RTDEIOInterface has no type information

    @property
    def place(self) -> str:
        return f"{self.name} at {self._host}"

    def connect(self) -> None:
        """DeviceLost: no controller there, or another client holds its registers."""
        self.close()
        try:
            self._io = importlib.import_module("rtde_io").RTDEIOInterface(self._host)
        except (RuntimeError, ImportError) as error:  # ur_rtde raises the first for everything
            why = f"{self.place}: its outputs cannot be reached: {error}"
            raise DeviceLost(f"{why}; check power and cable, and that ur_rtde is installed") from error

    def switch(self, bit: int, level: bool) -> None:
        """ValueError for a bit that no output has. DeviceRefused, DeviceLost."""
        if not 0 <= bit <= LAST:
            raise ValueError(f"digital output {bit}: the controller has bits 0 to {LAST}")
        if self._io is None:
            raise DeviceLost(f"{self.place}: its outputs are not connected; call connect() first")
        first, verb = next(kind for kind in KINDS if bit >= kind[0])
        try:
            taken = getattr(self._io, verb)(bit - first, level)
        except RuntimeError as error:
            raise DeviceLost(f"{self.place}: output {bit} was not switched: {error}; connect again") from error
        if not taken:
            raise DeviceRefused(f"{self.place}: the controller did not take output {bit}; check its pendant")

    def close(self) -> None:
        """Safe in every state, and more than once."""
        io, self._io = self._io, None
        if io is not None:
            io.disconnect()
