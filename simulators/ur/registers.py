"""The controller's memory that clients write and read over RTDE: general registers, outputs, speed slider.

Values stay until they are written again. An input field belongs to the client that set up a recipe with it, until
that client goes (RTDE guide, "IN_USE").
"""

from collections.abc import Callable
from dataclasses import dataclass, field

N_REGISTERS = 48  # of each number type (RTDE guide: 0..23 and, from 3.9 / 5.3 on, 24..47)
N_BITS = 128
Value = float | int | bool | tuple[float, ...]
MASKS = frozenset(  # a setting counts in the cycle in which its mask comes
    (
        *(f"{which}_digital_output_mask" for which in ("standard", "configurable", "tool")),
        "standard_analog_output_mask",
        "speed_slider_mask",
    )
)


def _zeros() -> list[float]:
    return [0.0] * N_REGISTERS


def _int_zeros() -> list[int]:
    return [0] * N_REGISTERS


@dataclass
class Registers:
    """General purpose registers of one direction; bits as one integer."""

    ints: list[int] = field(default_factory=_int_zeros)
    doubles: list[float] = field(default_factory=_zeros)
    bits: int = 0

    def word(self, low: int) -> int:
        """32 bits from `low` on."""
        return (self.bits >> low) & 0xFFFFFFFF

    def set_word(self, low: int, value: int) -> None:
        self.bits = (self.bits & ~(0xFFFFFFFF << low)) | (value << low)

    def bit(self, index: int) -> bool:
        return bool((self.bits >> index) & 1)

    def set_bit(self, index: int, value: bool) -> None:
        self.bits = (self.bits & ~(1 << index)) | (int(value) << index)


@dataclass
class Installation:
    """What the program may state about the arm's load; it is reported, and changes nothing in the emulated world."""

    payload_kg: float = 0.0
    payload_cog_m: tuple[float, ...] = (0.0, 0.0, 0.0)
    payload_inertia_kg_m2: tuple[float, ...] = (0.0,) * 6
    gravity_m_s2: tuple[float, ...] = (0.0, 0.0, 9.82)  # URScript set_gravity, default: what the base feels


class Memory:
    """Both directions, and what else a client may set."""

    def __init__(self, installation: Installation | None = None) -> None:
        self.installation = installation or Installation()
        self.inputs = Registers()
        self.outputs = Registers()
        self.settings: dict[str, Value] = {}  # input fields that are not registers, by their RTDE name
        self.digital_outputs = 0  # bits 0-7 standard, 8-15 configurable, 16-17 tool (RTDE guide)
        self.analog_outputs = [0.0, 0.0]  # V or A, by the type
        self.analog_types = 0b1111  # inputs 0 and 1, outputs 0 and 1: set is a voltage, clear a current (RTDE guide)
        self.tool_voltage_v = 0
        self.speed_slider = 1.0
        self.on_int_written: list[Callable[[int], None]] = []  # called with the index: what a watchdog listens to
        self._owners: dict[str, object] = {}

    def claim(self, name: str, owner: object) -> bool:
        """False when another client owns the field."""
        return self._owners.setdefault(name, owner) is owner

    def release(self, owner: object) -> None:
        """The client has gone; its values stay."""
        self._owners = {name: holder for name, holder in self._owners.items() if holder is not owner}

    def write_int(self, index: int, value: int) -> None:
        self.inputs.ints[index] = value
        for listener in self.on_int_written:
            listener(index)

    def apply_outputs(self) -> None:
        """Digital outputs and the speed slider from what the clients have set; once per cycle."""
        if MASKS.isdisjoint(self.settings):
            return
        for prefix, low, width in (("standard", 0, 8), ("configurable", 8, 8), ("tool", 16, 2)):
            mask = self._take(f"{prefix}_digital_output_mask") & ((1 << width) - 1)
            if mask:
                self.set_digital_outputs(mask << low, int(self._number(f"{prefix}_digital_output")) << low)
        mask = self._take("standard_analog_output_mask")
        for index in (0, 1):
            if mask >> index & 1:
                is_voltage = bool(int(self._number("standard_analog_output_type")) >> index & 1)
                self.set_analog_output(index, is_voltage, self._number(f"standard_analog_output_{index}"))
        if self._take("speed_slider_mask"):
            self.speed_slider = min(max(self._number("speed_slider_fraction"), 0.0), 1.0)

    def set_digital_outputs(self, mask: int, bits: int) -> None:
        """Those of `mask`; bits 0-7 standard, 8-15 configurable, 16-17 tool."""
        self.digital_outputs = (self.digital_outputs & ~mask) | (bits & mask)

    def set_analog_output(self, index: int, is_voltage: bool | None, ratio: float) -> None:
        """`ratio` 0..1 of 0 to 10 V, or of 4 to 20 mA; None keeps which of them it is (URScript, set_analog_out)."""
        bit = 1 << (2 + index)
        if is_voltage is not None:
            self.analog_types = self.analog_types | bit if is_voltage else self.analog_types & ~bit
        ratio = min(max(ratio, 0.0), 1.0)
        self.analog_outputs[index] = 10.0 * ratio if self.analog_types & bit else 0.004 + 0.016 * ratio

    def _take(self, name: str) -> int:
        """The mask once; a mask that has been applied is spent."""
        mask = int(self._number(name))
        self.settings.pop(name, None)
        return mask

    def _number(self, name: str) -> float:
        value = self.settings.get(name, 0)
        return float(value) if not isinstance(value, tuple) else 0.0
